//! The one declaration of every struct that Rust and GLSL share.
//!
//! [`gpu_struct!`](crate::gpu_struct) declares a `#[repr(C)]` struct, its GLSL text with the same doc comments, the offsets of its members, and
//! asserts at compile time that these are the offsets of std430. A test compares all of it with what naga reads back
//! from each compiled kernel.
//!
//! A `Vec3` is followed by a scalar that fills its sixteen bytes; a struct's size is a multiple of sixteen.

use super::sobol;
use glam::{Vec2, Vec3};

/// A type that has a name in GLSL.
pub trait GlslType {
    /// The name.
    const NAME: &'static str;
    /// Alignment under std430, in bytes.
    const ALIGN: usize;
}

macro_rules! glsl_types {
    ($($rust:ty => $name:literal, $align:literal;)*) => {
        $(impl GlslType for $rust { const NAME: &'static str = $name; const ALIGN: usize = $align; })*
    };
}

glsl_types! {
    f32 => "float", 4;
    u32 => "uint", 4;
    i32 => "int", 4;
    Vec2 => "vec2", 8;
    Vec3 => "vec3", 16;
}

/// One member of a shared struct.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Its name, the same in both languages.
    pub name: &'static str,
    /// Its type in GLSL.
    pub glsl: &'static str,
    /// Bytes from the start of the struct.
    pub offset: usize,
    /// What it is, from the doc comment.
    pub doc: &'static str,
}

/// A struct that Rust and GLSL share.
pub trait GpuStruct: bytemuck::Pod {
    /// Its name, the same in both languages.
    const NAME: &'static str;
    /// Its members, in order.
    const FIELDS: &'static [Field];

    /// Its declaration in GLSL.
    fn glsl() -> String {
        let mut text = format!("struct {} {{\n", Self::NAME);
        for field in Self::FIELDS {
            text += &format!("    {} {}; //{}\n", field.glsl, field.name, field.doc);
        }
        text + "};\n"
    }
}

/// Declares a struct for Rust and GLSL at once. See the module's documentation.
#[macro_export]
macro_rules! gpu_struct {
    ($(#[$meta:meta])* pub struct $name:ident { $( $(#[doc = $doc:literal])+ $field:ident : $ty:ty ),* $(,)? }) => {
        $(#[$meta])*
        #[repr(C)]
        #[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
        pub struct $name { $( $(#[doc = $doc])+ pub $field: $ty ),* }

        impl $crate::pack::layout::GpuStruct for $name {
            const NAME: &'static str = stringify!($name);
            const FIELDS: &'static [$crate::pack::layout::Field] = &[ $( $crate::pack::layout::Field {
                name: stringify!($field),
                glsl: <$ty as $crate::pack::layout::GlslType>::NAME,
                offset: std::mem::offset_of!($name, $field),
                doc: concat!($($doc),+),
            } ),* ];
        }

        const _: () = {
            $( assert!(
                std::mem::offset_of!($name, $field) % <$ty as $crate::pack::layout::GlslType>::ALIGN == 0,
                concat!(stringify!($name), ".", stringify!($field), " is not aligned as std430 asks")
            ); )*
            assert!(size_of::<$name>() % 16 == 0, concat!(stringify!($name), ": its size is not a multiple of 16"));
        };
    };
}

gpu_struct! {
    /// A primitive of the BVH's leaves: a triangle, or a sphere.
    pub struct Primitive {
        /// First corner; the centre of a sphere.
        a: Vec3,
        /// Index of its surface; bit 31: crossing it is no event but a change of medium; bit 30: a sphere.
        surface: u32,
        /// Second corner; (radius, +1 or −1 for normals out or in, 0) of a sphere.
        b: Vec3,
        /// Index of its light plus one; 0 if it does not emit.
        light: u32,
        /// Third corner, counter-clockwise seen from where the normal points to.
        c: Vec3,
        /// Of a boundary: sigma_t inside minus sigma_t outside, red channel. The other channels are in the surface.
        sigma_t_step: f32,
    }
}

gpu_struct! {
    /// What the primitives of one shape have in common.
    pub struct Surface {
        /// Diffusely reflected fraction of each channel.
        reflectance: Vec3,
        /// The `SURFACE_` bits, and the kind of BSDF above [`SURFACE_KIND_SHIFT`].
        flags: u32,
        /// Of a boundary: sigma_t inside minus sigma_t outside.
        sigma_t_step: Vec3,
        /// Of a boundary: the medium inside (low 16 bits) and outside (high 16 bits); 0 is vacuum.
        media: u32,
        /// Factor of specular reflection.
        specular: Vec3,
        /// Refractive index inside over the one outside.
        eta: f32,
        /// Factor of specular transmission; of a conductor, the real part of its index.
        transmittance: Vec3,
        /// Roughness of microfacets; 0 is smooth.
        alpha: f32,
        /// Of a conductor, the imaginary part of its index.
        extinction: Vec3,
        /// Of plastic, the diffuse reflectance of its boundary from inside.
        internal_reflectance: f32,
        /// Of plastic, the share of the specular lobe in sampling, before Fresnel.
        specular_weight: f32,
        /// Roughness across the tangent, where it differs from `alpha`; else the same.
        alpha_v: f32,
        /// Textures that stand for `reflectance` (low 16 bits) and `specular` (high 16 bits), plus one; 0 is none.
        textures_1: u32,
        /// Textures of `transmittance` (low 16 bits) and of `opacity` (high 16 bits), plus one; 0 is none.
        textures_2: u32,
        /// Of a mask, the probability that light meets the surface at all.
        opacity: f32,
        /// Of rough plastic: index among the values of what its varnish lets through, at cosines from 0 to 1.
        first_value: u32,
        /// Of rough plastic: values from there on.
        value_count: u32,
        /// Index of a surface that may be in the place of this one, plus one; 0 is none.
        other: u32,
        /// With which probability it is, where that is no matter of sides.
        share: f32,
        /// Texture that stands for `share`, plus one; 0 is none.
        share_texture: u32,
        /// Texture of turned normals or of heights, plus one; 0 is none.
        relief_texture: u32,
        /// Factor of heights, canonical units.
        relief_scale: f32,
    }
}

gpu_struct! {
    /// A medium. Entry 0 of the table is vacuum.
    pub struct Medium {
        /// Extinction coefficient, 1/canonical unit.
        sigma_t: Vec3,
        /// Mean cosine of Henyey and Greenstein's phase function.
        g: f32,
        /// Single-scattering albedo.
        albedo: Vec3,
        /// 0: the phase function is Henyey and Greenstein's with `g`. Else it is a mixture of entries of the table of phase
        /// functions: index of the first plus one (low 24 bits), their number (high 8 bits).
        phase: u32,
        /// Radiance that is added per canonical unit of length.
        emission: Vec3,
        /// Index of the light that stands for the medium's emission, plus one; 0 if it does not emit or is not sampled.
        light: u32,
        /// Smallest of the channels of `sigma_t`.
        least_sigma_t: f32,
        /// Share of equiangular sampling among the distances at which light scatters; 0: free flights alone.
        equiangular: f32,
        /// Share of the emission that is counted where flights end; the rest is counted along the way. In \[0, 1).
        collision_share: f32,
        /// 0: homogeneous. Else the index plus one of the first of three grids (low 24 bits), factors of `sigma_t`, `albedo` and
        /// `emission`, and the `MEDIUM_` bits that say which of these there are.
        grids: u32,
        /// The part of the extinction coefficient that free flights are sampled by, in \[0, 1\]; the rest is a weight. 0: no flight ends here.
        flight_share: f32,
        /// Fills the sixteen bytes.
        unused_1: u32,
        /// Fills the sixteen bytes.
        unused_2: u32,
        /// Fills the sixteen bytes.
        unused_3: u32,
    }
}

gpu_struct! {
    /// A component of a mixture of phase functions.
    pub struct Phase {
        /// One of the `PHASE_` constants.
        kind: u32,
        /// Share in the mixture; the shares of one mixture add up to 1.
        weight: f32,
        /// Mean cosine of Henyey and Greenstein's.
        g: f32,
        /// Of a table: index of its first number among the values. The densities come first, then as many numbers of the
        /// distribution function.
        first_value: u32,
        /// Of a table: densities in it, at cosines from -1 to 1 in equal steps.
        value_count: u32,
        /// Fills the sixteen bytes.
        unused_1: u32,
        /// Fills the sixteen bytes.
        unused_2: u32,
        /// Fills the sixteen bytes.
        unused_3: u32,
    }
}

gpu_struct! {
    /// What the corners of a triangle carry beside their places. Entry k belongs to primitive k.
    pub struct Corners {
        /// Shading normal of the first corner; 0 if the triangle is flat.
        normal_a: Vec3,
        /// Its first texture coordinate.
        u_a: f32,
        /// Shading normal of the second corner.
        normal_b: Vec3,
        /// Its first texture coordinate.
        u_b: f32,
        /// Shading normal of the third corner.
        normal_c: Vec3,
        /// Its first texture coordinate.
        u_c: f32,
        /// Second texture coordinates of the three corners.
        v: Vec3,
        /// Number of the triangle in its shape.
        number: u32,
    }
}

gpu_struct! {
    /// A colour that depends on the place, or the pixels of an environment map.
    pub struct Texture {
        /// u of the look-up is `row_u · (u, v, 1)`.
        row_u: Vec3,
        /// One of the `TEXTURE_` constants.
        kind: u32,
        /// v of the look-up is `row_v · (u, v, 1)`.
        row_v: Vec3,
        /// Bits of filter and wrap mode; of an environment map, the binary logarithms of the columns (low 8 bits) and rows of
        /// the grid of its distribution.
        flags: u32,
        /// Of a checkerboard: the colour at (0, 0).
        color_0: Vec3,
        /// Of an image: pixels in a row.
        width: u32,
        /// Of a checkerboard: the other colour.
        color_1: Vec3,
        /// Of an image: rows.
        height: u32,
        /// Of an image: index of its first number among the values; three for each pixel, row by row.
        first_value: u32,
        /// Of an environment map: index of the first number of its distribution among the values.
        first_weight: u32,
        /// Fills the sixteen bytes.
        unused_1: u32,
        /// Fills the sixteen bytes.
        unused_2: u32,
    }
}

gpu_struct! {
    /// A field in space, a factor of a medium's coefficient: voxels in a box, or a density that falls with height, which has no
    /// more than the first row.
    pub struct Grid {
        /// The first coordinate in the unit cube of the voxels is `row_x · p + shift_x`. Of a height: that over its base, in units of
        /// the scale height.
        row_x: Vec3,
        /// See `row_x`.
        shift_x: f32,
        /// Of the second coordinate.
        row_y: Vec3,
        /// See `row_y`.
        shift_y: f32,
        /// Of the third coordinate.
        row_z: Vec3,
        /// See `row_z`.
        shift_z: f32,
        /// Voxels along the first coordinate, which grows fastest.
        size_x: u32,
        /// Voxels along the second coordinate.
        size_y: u32,
        /// Voxels along the third coordinate.
        size_z: u32,
        /// The `GRID_` bits.
        flags: u32,
        /// Of an extinction coefficient: cells along the first coordinate.
        cells_x: u32,
        /// Cells along the second coordinate.
        cells_y: u32,
        /// Cells along the third coordinate.
        cells_z: u32,
        /// Index of the first voxel's first number among the values.
        first_value: u32,
        /// Index of the first cell's first number among the values. A cell has four: the largest, the smallest and the mean
        /// extinction coefficient in it, 1/canonical unit, and the rate of tentative collisions, no less than the first. Of a density,
        /// `cells_x` and so on count blocks of its cells, which have one number: the value that all voxels there have, or −1.
        first_cell: u32,
        /// Fills the sixteen bytes.
        unused_1: u32,
        /// Fills the sixteen bytes.
        unused_2: u32,
        /// Fills the sixteen bytes.
        unused_3: u32,
    }
}

gpu_struct! {
    /// A light, with its line of the alias table by which lights are chosen.
    pub struct Light {
        /// A corner; the position of a point or spot; the centre of a sphere; of a light infinitely far, the middle of the strongest
        /// light that is not, if there is one.
        origin: Vec3,
        /// One of the `LIGHT_` constants; of an environment map, its texture above [`LIGHT_TEXTURE_SHIFT`].
        kind: u32,
        /// First edge, from the corner; (radius, side, 0) of a sphere; (cutoff, beam width, 1/their difference) of a spot, in
        /// radians; the first axis of an environment map.
        edge_1: Vec3,
        /// Probability to choose this light.
        probability: f32,
        /// Second edge, from the corner; the second axis of an environment map.
        edge_2: Vec3,
        /// Area, canonical units²; of a light infinitely far, that of the lamp at `origin`; 0 where it has no meaning.
        area: f32,
        /// Emitted radiance; the intensity of a point or spot; the irradiance of a directional light; the mean radiance of an
        /// environment map.
        radiance: Vec3,
        /// Alias table: the light of this line is taken if the rescaled number is below.
        alias_threshold: f32,
        /// Unit normal of the emitting side; where the light of a spot or directional light goes; the third axis of an
        /// environment map.
        normal: Vec3,
        /// Alias table: the light that is taken otherwise.
        alias: u32,
        /// The second axis of a spot's picture; `edge_2` is the first one.
        slide_y: Vec3,
        /// Index plus one of a texture that colours the light, or 0: of a plane light over the coordinates along its edges, of a spot
        /// over the tangents of the angles along the axes of its picture.
        texture: u32,
    }
}

gpu_struct! {
    /// What holds for a whole render.
    pub struct Params {
        /// The camera's centre.
        camera_origin: Vec3,
        /// Index of the medium at the camera.
        camera_medium: u32,
        /// Direction through the film's top left corner; its component along the optical axis has length 1.
        camera_corner: Vec3,
        /// Rays begin at this plane.
        near_clip: f32,
        /// Step of the direction from the left edge of the film to the right.
        camera_right: Vec3,
        /// Rays end at this plane.
        far_clip: f32,
        /// Step of the direction from the top edge of the film to the bottom.
        camera_down: Vec3,
        /// Seed of every random number.
        seed: u32,
        /// Lower corner of the nodes' grid.
        grid_origin: Vec3,
        /// Where lamps are found apart, index of the first of as many numbers as the crop window has pixels: 1 where paths leave them out.
        first_seen: u32,
        /// Grid step of the nodes' bounds.
        grid_step: Vec3,
        /// Lights in the table.
        light_count: u32,
        /// The corner of the tree opposite to `grid_origin`, in steps.
        tree_size: Vec3,
        /// Fills up.
        unused: u32,
        /// 1 / width of the whole film.
        inverse_width: f32,
        /// 1 / height of the whole film.
        inverse_height: f32,
        /// First column of the crop window.
        crop_x: u32,
        /// First row of the crop window.
        crop_y: u32,
        /// Columns of the crop window.
        crop_width: u32,
        /// Rows of the crop window.
        crop_height: u32,
        /// Entries in the table of media.
        medium_count: u32,
        /// Columns of the whole film.
        film_width: u32,
        /// Extinction coefficient outside of all boundaries.
        world_sigma_t: Vec3,
        /// Index of the first light that shines from all directions; these come last in the table.
        first_sky: u32,
        /// Of a filter wider than a pixel: where its samples may lie begins here, in pixels of the film.
        sample_area_begin: Vec2,
        /// Where it ends.
        sample_area_end: Vec2,
        /// Index among the values of the filter's distribution: one more number than cells, and as many of its signed form.
        first_filter_value: u32,
        /// Cells of the table, from one end of the filter to the other.
        filter_cells: u32,
        /// Distance from the pixel's centre to the filter's ends, in pixels.
        filter_radius: f32,
        /// Of a thin lens, 1 / distance of the plane in focus.
        inverse_focus: f32,
        /// Of a thin lens, its first axis with the radius as its length; of an orthographic camera, the direction of view, while
        /// `camera_corner` and its companions are places relative to the camera's centre.
        lens_u: Vec3,
        /// Pixels of a side of the pilot's blocks.
        block_side: u32,
        /// Of a thin lens, its second axis.
        lens_v: Vec3,
        /// Blocks in a row.
        block_columns: u32,
        /// Lower corner of the cells of the pilot.
        pilot_origin: Vec3,
        /// Index of the first number of the pilot's cells: of each its mean, its worth and two that fill up.
        first_cell: u32,
        /// Cells of the pilot per unit of length, on each axis.
        pilot_scale: Vec3,
        /// Index of the first number of the pilot's blocks of pixels: of each one over the square of its radiance, and one that fills up.
        first_block: u32,
        /// Lower corner of the cells of the guides.
        guide_origin: Vec3,
        /// Index of the first number of the guides: of each cell the axis and the sharpness of its lobe.
        first_guide: u32,
        /// Cells of the guides per unit of length, on each axis.
        guide_scale: Vec3,
        /// Fills the sixteen bytes.
        unused_2: u32,
    }
}

gpu_struct! {
    /// What holds for one dispatch. It travels as push constants, behind the addresses of the buffers.
    pub struct Dispatch {
        /// First sample of each pixel.
        first_sample: u32,
        /// Samples of each pixel.
        sample_count: u32,
        /// Tiles.
        tile_count: u32,
        /// Among the samples, the first vector of the tiles' numbers in the crop window, four to a vector.
        first_tile: u32,
        /// Where pixels share paths: among the samples, the first vector of the records of the paths.
        first_record: u32,
        /// There, the first vector of the densities of connections.
        first_pair: u32,
        /// Fills the sixteen bytes.
        unused_1: u32,
        /// Fills the sixteen bytes.
        unused_2: u32,
    }
}

/// Cells of the pilot on each axis.
pub const PILOT_CELLS: u32 = 12;
/// Cells of the guides on each axis.
pub const GUIDE_CELLS: u32 = 8;
/// Bit 31 of [`Primitive::surface`].
pub const PRIMITIVE_BOUNDARY: u32 = 1 << 31;
/// Bit 30 of [`Primitive::surface`].
pub const PRIMITIVE_SPHERE: u32 = 1 << 30;
/// Bit 0 of [`Surface::flags`].
pub const SURFACE_TWO_SIDED: u32 = 1;
/// Bit 1: microfacets are those of GGX, else of Beckmann.
pub const SURFACE_GGX: u32 = 2;
/// Bit 2: a thin sheet, which bends no light.
pub const SURFACE_THIN: u32 = 4;
/// Bit 3: colours of plastic shift with depth.
pub const SURFACE_NONLINEAR: u32 = 8;
/// Bit 4: the two sides differ, and directions are those of the outside.
pub const SURFACE_ORIENTED: u32 = 16;
/// Bit 5: light meets the surface with a probability only, and else goes straight on.
pub const SURFACE_MASK: u32 = 32;
/// Bit 6: the corners of the triangles have shading normals.
pub const SURFACE_SMOOTH: u32 = 64;
/// Bit 7: texture coordinates are needed.
pub const SURFACE_UVS: u32 = 128;
/// Bit 8: `other` takes the place of the surface where it is seen from behind.
pub const SURFACE_SIDES: u32 = 256;
/// Bit 9: where the choice of `other` is by sides, it is seen in front; where it is by a texture, 1 minus that is its share.
pub const SURFACE_INVERTED: u32 = 512;
/// Bit 10: `relief_texture` has heights, not normals.
pub const SURFACE_HEIGHTS: u32 = 1024;
/// Bit 11: turned normals that are seen from behind are turned the other way.
pub const SURFACE_RELIEF_FLIPS: u32 = 2048;
/// Bit 12: light fades out where it grazes the surface under turned normals.
pub const SURFACE_RELIEF_FADES: u32 = 4096;
/// Bit 13: seen from behind, normals are turned to the same sides as in front.
pub const SURFACE_RELIEF_TURNS: u32 = 8192;
/// Bit 14: a thin pane, which light passes straight on with the probability `opacity` times what is not reflected.
pub const SURFACE_PANE: u32 = 16384;
/// Where the kind of BSDF begins in [`Surface::flags`].
pub const SURFACE_KIND_SHIFT: u32 = 16;
/// Kind of BSDF: Lambert's law.
pub const BSDF_DIFFUSE: u32 = 0;
/// Kind of BSDF: smooth or rough glass.
pub const BSDF_DIELECTRIC: u32 = 1;
/// Kind of BSDF: smooth or rough metal.
pub const BSDF_CONDUCTOR: u32 = 2;
/// Kind of BSDF: a diffuse body under a smooth or rough varnish.
pub const BSDF_PLASTIC: u32 = 3;
/// Kind of BSDF: the principled one, whose parameters stand where `lib/principled.glsl` says.
pub const BSDF_PRINCIPLED: u32 = 4;
/// [`Phase::kind`]: Henyey and Greenstein's.
pub const PHASE_HENYEY_GREENSTEIN: u32 = 0;
/// [`Phase::kind`]: Rayleigh's.
pub const PHASE_RAYLEIGH: u32 = 1;
/// [`Phase::kind`]: a table.
pub const PHASE_TABULATED: u32 = 2;
/// [`Texture::kind`]: an image.
pub const TEXTURE_BITMAP: u32 = 0;
/// [`Texture::kind`]: a pattern of squares.
pub const TEXTURE_CHECKERBOARD: u32 = 1;
/// Bit 0 of [`Texture::flags`]: the nearest pixel counts alone.
pub const TEXTURE_NEAREST: u32 = 1;
/// Bit 1: outside of the unit square the image is repeated, mirrored every other time.
pub const TEXTURE_MIRROR: u32 = 2;
/// Bit 2: outside of the unit square the pixels at the edge go on. With neither bit, the image is repeated.
pub const TEXTURE_CLAMP: u32 = 4;
/// Bit 3: numbers of the triangles of a mesh, a block of 2 × 2 pixels for each.
pub const TEXTURE_ATTRIBUTE: u32 = 8;
/// [`Light::kind`]: a triangle.
pub const LIGHT_TRIANGLE: u32 = 0;
/// [`Light::kind`]: a parallelogram.
pub const LIGHT_QUAD: u32 = 1;
/// [`Light::kind`]: the outside of a sphere.
pub const LIGHT_SPHERE: u32 = 2;
/// [`Light::kind`]: a point.
pub const LIGHT_POINT: u32 = 3;
/// [`Light::kind`]: the same radiance from every direction.
pub const LIGHT_CONSTANT: u32 = 4;
/// [`Light::kind`]: a point that shines into a cone.
pub const LIGHT_SPOT: u32 = 5;
/// [`Light::kind`]: parallel light from infinitely far.
pub const LIGHT_DIRECTIONAL: u32 = 6;
/// [`Light::kind`], low 8 bits: radiance from infinitely far, from an image.
pub const LIGHT_ENVMAP: u32 = 7;
/// Where the index of an environment map's texture begins in [`Light::kind`].
pub const LIGHT_TEXTURE_SHIFT: u32 = 8;
/// [`Texture::kind`]: an environment map, which only a light refers to.
pub const TEXTURE_SKY: u32 = 255;
/// [`Light::kind`]: a medium that emits, within a sphere about it: `origin` and `edge_1.x` are its centre and radius, `alias` and
/// the rest as ever, `radiance` what the medium emits per canonical unit of length, `edge_1.y` the index of the medium.
pub const LIGHT_VOLUME: u32 = 8;
/// [`Light::kind`]: a parallelogram whose edges are perpendicular, sampled by solid angle.
pub const LIGHT_RECTANGLE: u32 = 9;
/// Bit 0 of [`Grid::flags`]: the voxel in which a point lies counts alone.
pub const GRID_NEAREST: u32 = 1;
/// Bit 1: outside of the unit cube the voxels are repeated, mirrored every other time.
pub const GRID_MIRROR: u32 = 2;
/// Bit 2: outside of the unit cube the voxels at its faces go on. With neither bit, the voxels are repeated.
pub const GRID_CLAMP: u32 = 4;
/// Bit 3: voxels have three numbers.
pub const GRID_RGB: u32 = 8;
/// [`Medium::grids`]: voxels, through which light is tracked, are a factor of the extinction coefficient.
pub const MEDIUM_VOXELS: u32 = 1 << 24;
/// [`Medium::grids`]: a density is a factor of the extinction coefficient whose optical depths are known: voxels of one number, or one that
/// falls with height.
pub const MEDIUM_DENSITY: u32 = 1 << 25;
/// [`Medium::grids`]: voxels are a factor of the albedo.
pub const MEDIUM_ALBEDO_GRID: u32 = 1 << 26;
/// [`Medium::grids`]: voxels are a factor of the emission.
pub const MEDIUM_EMISSION_GRID: u32 = 1 << 27;
/// [`Medium::grids`]: no shadow ray leaves the medium, and light is not sampled in it.
pub const MEDIUM_SEALED: u32 = 1 << 28;
/// Pixels along the side of a tile; a workgroup of the path tracer renders one tile.
pub const TILE: u32 = 8;
/// Vectors of four numbers in the record of a path that pixels share: see `lib/path_share.glsl`.
pub const RECORD_VECTORS: u32 = 15;
/// Which of them holds the weight of the first vertex, and in the end what the group brought.
pub const RECORD_WEIGHT: u32 = 3;
/// Longest distance; rays that end nowhere end here.
pub const INFINITE_DISTANCE: f32 = 1e30;

/// The text of `layout.glsl`: all shared structs and constants.
pub fn glsl() -> String {
    let structs = [
        Primitive::glsl(),
        Surface::glsl(),
        Medium::glsl(),
        Phase::glsl(),
        Corners::glsl(),
        Texture::glsl(),
        Grid::glsl(),
        Light::glsl(),
        Params::glsl(),
        Dispatch::glsl(),
    ]
    .concat();
    let constants = [
        ("PILOT_CELLS", PILOT_CELLS),
        ("GUIDE_CELLS", GUIDE_CELLS),
        ("PRIMITIVE_BOUNDARY", PRIMITIVE_BOUNDARY),
        ("PRIMITIVE_SPHERE", PRIMITIVE_SPHERE),
        ("SURFACE_TWO_SIDED", SURFACE_TWO_SIDED),
        ("SURFACE_GGX", SURFACE_GGX),
        ("SURFACE_THIN", SURFACE_THIN),
        ("SURFACE_NONLINEAR", SURFACE_NONLINEAR),
        ("SURFACE_ORIENTED", SURFACE_ORIENTED),
        ("SURFACE_MASK", SURFACE_MASK),
        ("SURFACE_SMOOTH", SURFACE_SMOOTH),
        ("SURFACE_UVS", SURFACE_UVS),
        ("SURFACE_SIDES", SURFACE_SIDES),
        ("SURFACE_INVERTED", SURFACE_INVERTED),
        ("SURFACE_HEIGHTS", SURFACE_HEIGHTS),
        ("SURFACE_RELIEF_FLIPS", SURFACE_RELIEF_FLIPS),
        ("SURFACE_RELIEF_FADES", SURFACE_RELIEF_FADES),
        ("SURFACE_RELIEF_TURNS", SURFACE_RELIEF_TURNS),
        ("SURFACE_PANE", SURFACE_PANE),
        ("SURFACE_KIND_SHIFT", SURFACE_KIND_SHIFT),
        ("BSDF_DIFFUSE", BSDF_DIFFUSE),
        ("BSDF_DIELECTRIC", BSDF_DIELECTRIC),
        ("BSDF_CONDUCTOR", BSDF_CONDUCTOR),
        ("BSDF_PLASTIC", BSDF_PLASTIC),
        ("BSDF_PRINCIPLED", BSDF_PRINCIPLED),
        ("PHASE_HENYEY_GREENSTEIN", PHASE_HENYEY_GREENSTEIN),
        ("PHASE_RAYLEIGH", PHASE_RAYLEIGH),
        ("PHASE_TABULATED", PHASE_TABULATED),
        ("TEXTURE_BITMAP", TEXTURE_BITMAP),
        ("TEXTURE_CHECKERBOARD", TEXTURE_CHECKERBOARD),
        ("TEXTURE_NEAREST", TEXTURE_NEAREST),
        ("TEXTURE_MIRROR", TEXTURE_MIRROR),
        ("TEXTURE_CLAMP", TEXTURE_CLAMP),
        ("TEXTURE_ATTRIBUTE", TEXTURE_ATTRIBUTE),
        ("LIGHT_TRIANGLE", LIGHT_TRIANGLE),
        ("LIGHT_QUAD", LIGHT_QUAD),
        ("LIGHT_SPHERE", LIGHT_SPHERE),
        ("LIGHT_POINT", LIGHT_POINT),
        ("LIGHT_CONSTANT", LIGHT_CONSTANT),
        ("LIGHT_SPOT", LIGHT_SPOT),
        ("LIGHT_DIRECTIONAL", LIGHT_DIRECTIONAL),
        ("LIGHT_ENVMAP", LIGHT_ENVMAP),
        ("LIGHT_TEXTURE_SHIFT", LIGHT_TEXTURE_SHIFT),
        ("LIGHT_VOLUME", LIGHT_VOLUME),
        ("LIGHT_RECTANGLE", LIGHT_RECTANGLE),
        ("GRID_NEAREST", GRID_NEAREST),
        ("GRID_MIRROR", GRID_MIRROR),
        ("GRID_CLAMP", GRID_CLAMP),
        ("GRID_RGB", GRID_RGB),
        ("MEDIUM_VOXELS", MEDIUM_VOXELS),
        ("MEDIUM_DENSITY", MEDIUM_DENSITY),
        ("MEDIUM_SEALED", MEDIUM_SEALED),
        ("MEDIUM_ALBEDO_GRID", MEDIUM_ALBEDO_GRID),
        ("MEDIUM_EMISSION_GRID", MEDIUM_EMISSION_GRID),
        ("TILE", TILE),
        ("RECORD_VECTORS", RECORD_VECTORS),
        ("RECORD_WEIGHT", RECORD_WEIGHT),
        ("BLOCK_SAMPLES", crate::render::BLOCK_SAMPLES),
        ("RUN_SAMPLES", crate::render::RUN_SAMPLES),
        ("RUN_SHIFTS", crate::render::RUN_SHIFTS),
        ("POINT_BITS", sobol::POINT_BITS),
        ("POINT_COUNT", sobol::POINT_COUNT),
        ("SOBOL_SETS", sobol::SOBOL_SETS),
        ("LENS_SET", sobol::LENS_SET),
    ]
    .map(|(name, value)| format!("const uint {name} = {value}u;\n"))
    .concat();
    format!("{structs}\n{constants}const float INFINITE_DISTANCE = {INFINITE_DISTANCE:e};\n")
}
