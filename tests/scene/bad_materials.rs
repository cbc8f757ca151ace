//! Faults in materials, textures, spots and skies, each with its place and what the message must say.

use crate::bad_input::table;

#[test]
fn glass_metal_and_plastic() {
    let bsdf = |plugin: &str, inside: &str| format!("<bsdf type=\"{plugin}\">{inside}</bsdf>");
    for (plugin, inside, parts) in [
        ("dielectric", "‸<float name=\"int_ior\" value=\"0\"/>", &["int_ior is 0; it must be greater than 0"][..]),
        ("plastic", "‸<float name=\"ext_ior\" value=\"-1.5\"/>", &["ext_ior is -1.5; it must be greater than 0"]),
        (
            "thindielectric",
            "‸<string name=\"int_ior\" value=\"watr\"/>",
            &["\"watr\" is not known", "did you mean \"water\"?", "give a number or one of: vacuum"],
        ),
        ("dielectric", "‸<rgb name=\"int_ior\" value=\"1 2 3\"/>", &["accepted: <float> or <string>"]),
        ("dielectric", "‸<rgb name=\"specular_reflectance\" value=\"2\"/>", &["between 0 and 1"]),
        (
            "dielectric",
            "‸<float name=\"alpha\" value=\"0.1\"/>",
            &["no property \"alpha\"", "accepted: int_ior, ext_ior"],
        ),
        (
            "conductor",
            "‸<string name=\"material\" value=\"au\"/>",
            &["did you mean \"Au\"?", "one of: Ag, Al, AlAs", "none"],
        ),
        (
            "conductor",
            "<string name=\"material\" value=\"Au\"/>‸<rgb name=\"eta\" value=\"1\"/>",
            &["either material or eta and k"],
        ),
        ("conductor", "‸<rgb name=\"eta\" value=\"1 -1 1\"/>", &["eta is [1, -1, 1]; it must not be negative"]),
        ("conductor", "‸<float name=\"k\" value=\"-1\"/>", &["must not be negative"]),
        (
            "roughconductor",
            "‸<float name=\"alpha\" value=\"0\"/>",
            &["alpha is 0; it must be greater than 0 and at most 1"],
        ),
        ("roughconductor", "‸<float name=\"alpha\" value=\"1.5\"/>", &["greater than 0 and at most 1"]),
        (
            "roughdielectric",
            "<float name=\"alpha_v\" value=\"1\"/>‸<float name=\"alpha_u\" value=\"2\"/>",
            &["alpha_u is 2"],
        ),
        ("roughdielectric", "‸<float name=\"alpha_u\" value=\"0.1\"/>", &["only accepted together"]),
        (
            "roughconductor",
            "<float name=\"alpha\" value=\"0.1\"/>‸<float name=\"alpha_v\" value=\"0.1\"/>",
            &["either alpha or alpha_u and alpha_v"],
        ),
        ("roughplastic", "‸<float name=\"alpha_u\" value=\"0.1\"/>", &["no property \"alpha_u\""]),
        (
            "roughplastic",
            "‸<string name=\"distribution\" value=\"phong\"/>",
            &["distribution is \"phong\"; accepted: beckmann, ggx"],
        ),
        ("mask", "<bsdf type=\"null\"/>‸<float name=\"opacity\" value=\"2\"/>", &["opacity is [2, 2, 2]"]),
        ("twosided", "‸<bsdf type=\"dielectric\"/>", &["cannot hold <bsdf type=\"dielectric\">", "diffuse, conductor"]),
        ("twosided", "‸<bsdf type=\"mask\"><bsdf type=\"diffuse\"/></bsdf>", &["cannot hold <bsdf type=\"mask\">"]),
    ] {
        table(&[(&bsdf(plugin, inside), parts)]);
    }
    table(&[
        ("‸<bsdf type=\"mask\"/>", &["<bsdf type=\"mask\"> holds 0 BSDFs; it must hold one"]),
        (
            "‸<bsdf type=\"roughplastic\"><float name=\"int_ior\" value=\"1.5\"/><float name=\"ext_ior\" value=\"1.5\"/></bsdf>",
            &["are both 1.5; they must differ"],
        ),
    ]);
}

#[test]
fn textures() {
    let of = |file: &str, more: &str| {
        format!("<texture type=\"bitmap\" id=\"t\">\n‸<string name=\"filename\" value=\"{file}\"/>{more}</texture>")
    };
    for (file, parts) in [
        ("textures/none.png", &["cannot read the image ", "none.png: ", "No such file"][..]),
        ("textures/text.png", &["text.png: it is neither a PNG, a JPEG, an OpenEXR nor"]),
        ("textures/broken.png", &["cannot read the image ", "broken.png: "]),
        ("textures/nan.exr", &["nan.exr: pixel (5, 2) is not finite"]),
        (
            "textures/nocolor.exr",
            &["nocolor.exr: it has the channels a.W, a.X, a.Z; R, G and B are needed, or Y alone"],
        ),
        ("textures", &["cannot read the image "]),
    ] {
        table(&[(&of(file, ""), parts)]);
    }
    let bitmap = |more: &str| {
        format!(
            "<texture type=\"bitmap\" id=\"t\"><string name=\"filename\" value=\"textures/colors.png\"/>{more}</texture>"
        )
    };
    let with = |bsdf: &str, name: &str, texture: &str| {
        format!("<bsdf type=\"{bsdf}\"><bsdf type=\"diffuse\"/>‸<texture name=\"{name}\" {texture}</texture></bsdf>")
    };
    let sky = "type=\"bitmap\"><string name=\"filename\" value=\"textures/sky.exr\"/>";
    let checker = "type=\"checkerboard\"><float name=\"color1\" value=\"3\"/>";
    table(&[
        ("‸<texture type=\"bitmap\" id=\"t\"/>", &["<texture type=\"bitmap\"> needs <string name=\"filename\""]),
        ("‸<texture type=\"wood\" id=\"t\"/>", &["accepted types: bitmap, checkerboard"]),
        (&bitmap("‸<string name=\"filter_type\" value=\"cubic\"/>"), &["\"cubic\"; accepted: bilinear, nearest"]),
        (&bitmap("‸<string name=\"wrap_mode\" value=\"wrap\"/>"), &["\"wrap\"; accepted: repeat, mirror, clamp"]),
        (&bitmap("‸<float name=\"gamma\" value=\"1\"/>"), &["no property \"gamma\"", "filename"]),
        (
            &bitmap("‸<transform name=\"to_uv\"><rotate x=\"1\" angle=\"45\"/></transform>"),
            &["out of itself", "rotations about z"],
        ),
        (&with("mask", "opacity", sky), &["opacity is [2, 2, 0] in pixel (2, 0)", "between 0 and 1"][..]),
        (&with("mask", "opacity", checker), &["opacity is [3, 3, 3]; it must lie between 0 and 1"]),
        (
            "<texture type=\"checkerboard\" id=\"t\">‸<texture type=\"checkerboard\" name=\"color0\"/></texture>",
            &["given as <texture type=\"checkerboard\">; accepted: <rgb>"],
        ),
    ]);
}

#[test]
fn spots_and_skies() {
    let sky = |more: &str| {
        format!("<emitter type=\"envmap\"><string name=\"filename\" value=\"textures/sky.exr\"/>{more}</emitter>")
    };
    table(&[
        (
            "<emitter type=\"spot\">‸<float name=\"cutoff_angle\" value=\"0\"/></emitter>",
            &["greater than 0 and at most 180"],
        ),
        (
            "<emitter type=\"spot\">‸<float name=\"cutoff_angle\" value=\"181\"/></emitter>",
            &["cutoff_angle is 181 degrees"],
        ),
        (
            "<emitter type=\"spot\">‸<float name=\"beam_width\" value=\"21\"/></emitter>",
            &["beam_width is 21 degrees", "between 0 and cutoff_angle, which is 20"],
        ),
        ("<emitter type=\"spot\">‸<float name=\"beam_width\" value=\"-1\"/></emitter>", &["beam_width is -1"]),
        (
            "<emitter type=\"spot\">‸<transform name=\"to_world\"><scale x=\"2\"/></transform></emitter>",
            &["the spot's to_world stretches or shears"],
        ),
        (
            "<emitter type=\"spot\">‸<texture type=\"checkerboard\" name=\"picture\"/></emitter>",
            &["has no use for <texture"],
        ),
        ("<emitter type=\"spot\">‸<rgb name=\"intensity\" value=\"-1\"/></emitter>", &["must not be negative"]),
        (
            "<emitter type=\"directional\">‸<vector name=\"direction\" x=\"0\" y=\"0\" z=\"0\"/></emitter>",
            &["direction is zero"],
        ),
        (
            "<emitter type=\"directional\"><vector name=\"direction\" x=\"0\" y=\"0\" z=\"1\"/>‸<transform name=\"to_world\"/></emitter>",
            &["either direction or to_world"],
        ),
        ("‸<emitter type=\"envmap\"/>", &["<emitter type=\"envmap\"> needs <string name=\"filename\""]),
        (&sky("‸<float name=\"scale\" value=\"-1\"/>"), &["scale is -1; it must not be negative"]),
        (
            &sky("‸<transform name=\"to_world\"><scale y=\"2\"/></transform>"),
            &["the environment map's to_world stretches or shears"],
        ),
        (
            "‸<emitter type=\"envmap\"><string name=\"filename\" value=\"textures/gray.png\"/></emitter>",
            &["has 2 x 2 pixels; it must have at least 2 x 3"],
        ),
        (
            "<emitter type=\"envmap\">‸<string name=\"filename\" value=\"textures/nan.exr\"/></emitter>",
            &["nan.exr: pixel (5, 2) is not finite"],
        ),
    ]);
}
