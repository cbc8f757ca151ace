// What a surface is at a point: texture coordinates, colours, opacity, and the frame of its BSDF.
#include "lib/path_state.glsl"
#include "lib/math.glsl"
#include "lib/texture.glsl"
#include "lib/bsdf.glsl"

bool is_sphere(Primitive primitive) {
    return HAS_SPHERES && (primitive.surface & PRIMITIVE_SPHERE) != 0u;
}

// From the centre of a sphere to a point, in the axes of the sphere, which stand in the place of its corners' normals.
vec3 to_sphere(Primitive primitive, Corners axes, vec3 point) {
    vec3 outwards = point - primitive.a;
    return vec3(dot(axes.normal_a, outwards), dot(axes.normal_b, outwards), dot(axes.normal_c, outwards));
}

// A vector in the axes of a sphere, in those of the scene.
vec3 from_sphere(Corners axes, vec3 v) {
    return axes.normal_a * v.x + axes.normal_b * v.y + axes.normal_c * v.z;
}

// Texture coordinates of a point on a primitive: a sphere's from the direction from its centre, (u, v) = (azimuth / 2 pi, polar angle / pi).
vec2 texture_coordinates(Primitive primitive, uint index, vec3 point, vec2 barycentric) {
    if (is_sphere(primitive)) {
        vec3 outwards = to_sphere(primitive, CORNERS(index), point);
        float azimuth = arctan2(outwards.y, outwards.x) * (0.5 * INV_PI);
        return vec2(azimuth < 0.0 ? azimuth + 1.0 : azimuth, arctan2(length(outwards.xy), outwards.z) * INV_PI);
    }
    Corners corners = CORNERS(index);
    vec3 weights = vec3(1.0 - barycentric.x - barycentric.y, barycentric);
    return vec2(dot(vec3(corners.u_a, corners.u_b, corners.u_c), weights), dot(corners.v, weights));
}

// The normal of the BSDF's frame: that of the surface, or the interpolated one.
vec3 shading_normal(uint index, vec2 barycentric, vec3 normal) {
    Corners corners = CORNERS(index);
    vec3 sum = corners.normal_a * (1.0 - barycentric.x - barycentric.y) + corners.normal_b * barycentric.x + corners.normal_c * barycentric.y;
    float squared = dot(sum, sum);
    return squared > 0.0 ? sum * inversesqrt(squared) : normal;
}

// Optical depth at which a share is left. What is not there at all is out of reach for any flight.
float color_depth(float share) {
    return share > 1e-30 ? minus_log(min(share, 1.0)) : 1000.0;
}

// A colour at a place on a primitive.
vec3 texture_at(uint texture_index, uint index, vec2 uv, vec2 barycentric) {
    Texture texture = TEXTURE(texture_index);
    if (HAS_ATTRIBUTES && (texture.flags & TEXTURE_ATTRIBUTE) != 0u) {
        return eval_attribute(texture, CORNERS(index).number, barycentric);
    }
    return eval_texture(texture, uv);
}

// What a thin pane leaves of the light that it does not reflect.
vec3 pane_transmittance(Surface surface, Primitive primitive, uint index, vec3 point, vec2 barycentric) {
    uint texture = surface.textures_2 & 0xffffu;
    if (HAS_TEXTURES && texture != 0u) {
        return texture_at(texture - 1u, index, texture_coordinates(primitive, index, point, barycentric), barycentric);
    }
    return surface.transmittance;
}

// The colour of a thin pane as an optical depth of each channel, 0 for the one that it leaves the most of: of the rest `opacity_at` knows.
vec3 pane_depth(Surface surface, Primitive primitive, uint index, vec3 point, vec2 barycentric) {
    vec3 color = pane_transmittance(surface, primitive, index, point, barycentric);
    vec3 share = color / max(max_component(color), 1e-30);
    return vec3(color_depth(share.x), color_depth(share.y), color_depth(share.z));
}

// Probability that light in a direction meets a surface that it may also pass: a mask, or a thin pane, of which `opacity` says how
// much of the light is left that it does not reflect.
float opacity_at(Surface surface, Primitive primitive, uint index, vec3 point, vec2 barycentric, vec3 direction) {
    if (HAS_PANES && (surface.flags & SURFACE_PANE) != 0u) {
        vec3 normal = is_sphere(primitive) ? normalize(point - primitive.a) : normalize(cross(primitive.b - primitive.a, primitive.c - primitive.a));
        if (HAS_SHADING_NORMALS && (surface.flags & SURFACE_SMOOTH) != 0u) {
            normal = shading_normal(index, barycentric, normal);
        }
        float most = surface.opacity;
        if (HAS_TINTS && (surface.textures_2 & 0xffffu) != 0u) {
            most = max_component(pane_transmittance(surface, primitive, index, point, barycentric));
        }
        return 1.0 - (1.0 - pane_reflectance(dot(normal, direction), surface.eta)) * most;
    }
    uint texture = surface.textures_2 >> 16;
    if (HAS_TEXTURES && texture != 0u) {
        vec2 uv = texture_coordinates(primitive, index, point, barycentric);
        return clamp(texture_at(texture - 1u, index, uv, barycentric).x, 0.0, 1.0);
    }
    return surface.opacity;
}

// Puts the colours at a place in the place of their means.
void apply_textures(inout Surface surface, uint index, vec2 uv, vec2 barycentric) {
    uint reflectance = surface.textures_1 & 0xffffu, specular = surface.textures_1 >> 16, transmittance = surface.textures_2 & 0xffffu;
    if (reflectance != 0u) {
        surface.reflectance = texture_at(reflectance - 1u, index, uv, barycentric);
    }
    if (specular != 0u) {
        surface.specular = texture_at(specular - 1u, index, uv, barycentric);
    }
    if (transmittance != 0u) {
        surface.transmittance = texture_at(transmittance - 1u, index, uv, barycentric);
        if (HAS_TINTS && (surface.flags & SURFACE_PANE) != 0u) {
            surface.opacity = max_component(surface.transmittance);
        }
    }
}

// The tangent of the BSDF's frame: the direction in which u grows, where it has one.
vec3 surface_tangent(Primitive primitive, uint index, vec3 point, vec3 axis) {
    vec3 along;
    if (is_sphere(primitive)) {
        vec3 outwards = to_sphere(primitive, CORNERS(index), point);
        along = from_sphere(CORNERS(index), vec3(-outwards.y, outwards.x, 0.0));
    } else {
        Corners corners = CORNERS(index);
        vec2 v = corners.v.yz - corners.v.x;
        float side = (corners.u_b - corners.u_a) * v.y - (corners.u_c - corners.u_a) * v.x;
        along = ((primitive.b - primitive.a) * v.y - (primitive.c - primitive.a) * v.x) * (side < 0.0 ? -1.0 : 1.0);
    }
    along -= axis * dot(axis, along);
    float squared = dot(along, along);
    vec3 tangent, bitangent;
    orthonormal_frame(axis, tangent, bitangent);
    return squared > 0.0 ? along * inversesqrt(squared) : tangent;
}

// With which probability the other surface is in the place of a surface.
float share_at(Surface surface, Primitive primitive, uint index, vec3 point, vec2 barycentric) {
    if (!HAS_TEXTURES || surface.share_texture == 0u) {
        return surface.share;
    }
    vec2 uv = texture_coordinates(primitive, index, point, barycentric);
    float share = clamp(texture_at(surface.share_texture - 1u, index, uv, barycentric).x, 0.0, 1.0);
    return (surface.flags & SURFACE_INVERTED) != 0u ? 1.0 - share : share;
}

// The derivatives of the place on a primitive by the texture coordinates; false where these are degenerate.
bool place_derivatives(Primitive primitive, uint index, vec3 point, out vec3 dp_du, out vec3 dp_dv) {
    if (is_sphere(primitive)) {
        vec3 outwards = to_sphere(primitive, CORNERS(index), point);
        float flat_length = length(outwards.xy);
        dp_du = from_sphere(CORNERS(index), 2.0 * PI * vec3(-outwards.y, outwards.x, 0.0));
        dp_dv = from_sphere(CORNERS(index), PI * vec3(outwards.xy * (outwards.z / flat_length), -flat_length));
        return flat_length > 0.0;
    }
    Corners corners = CORNERS(index);
    vec2 u = vec2(corners.u_b, corners.u_c) - corners.u_a, v = corners.v.yz - corners.v.x;
    vec3 edge_1 = primitive.b - primitive.a, edge_2 = primitive.c - primitive.a;
    float determinant = u.x * v.y - u.y * v.x;
    dp_du = (edge_1 * v.y - edge_2 * v.x) / determinant;
    dp_dv = (edge_2 * u.x - edge_1 * u.y) / determinant;
    return determinant != 0.0;
}

// The normal of a height field over a surface with the normal n, in (s, t, n); not normalised. The change of n itself is left out.
vec3 height_normal(Surface surface, Primitive primitive, uint index, vec3 point, vec2 uv, vec3 s, vec3 t, vec3 n) {
    vec3 dp_du, dp_dv;
    if (!place_derivatives(primitive, index, point, dp_du, dp_dv)) {
        return vec3(0.0, 0.0, 1.0);
    }
    vec2 slope = texture_gradient(TEXTURE(surface.relief_texture - 1u), uv) * surface.relief_scale;
    vec3 found = cross(dp_du + n * (slope.x - dot(n, dp_du)), dp_dv + n * (slope.y - dot(n, dp_dv)));
    found = dot(found, n) < 0.0 ? -found : found;
    return vec3(dot(s, found), dot(t, found), dot(n, found));
}

// Turns the frame of a BSDF by a map of normals or heights. `towards` is where the path comes from; `turned` says that the axis is on the
// back of the surface. Returns the squared roughness by which light fades where it grazes the surface, 0 if it does not.
float turn_frame(Surface surface, Primitive primitive, uint index, vec3 point, vec2 barycentric, vec3 towards, bool turned, inout vec3 axis, inout vec3 tangent) {
    vec2 uv = texture_coordinates(primitive, index, point, barycentric);
    vec3 s = surface_tangent(primitive, index, point, axis), front = turned ? -axis : axis, t = cross(front, s), n;
    if ((surface.flags & SURFACE_HEIGHTS) != 0u) {
        n = height_normal(surface, primitive, index, point, uv, s, t, front);
    } else {
        n = 2.0 * eval_texture(TEXTURE(surface.relief_texture - 1u), uv) - 1.0;
    }
    n.xy = turned && (surface.flags & SURFACE_RELIEF_TURNS) != 0u ? -n.xy : n.xy;
    vec3 local = vec3(dot(s, towards), dot(t, towards), dot(axis, towards));
    n.xy = (surface.flags & SURFACE_RELIEF_FLIPS) != 0u && local.z * dot(local, n) <= 0.0 ? -n.xy : n.xy;
    float squared = dot(n, n);
    n = squared > 0.0 ? n * inversesqrt(squared) : vec3(0.0, 0.0, 1.0);
    vec3 along = vec3(1.0, 0.0, 0.0) - n * n.x;
    along = dot(along, along) > 0.0 ? normalize(along) : vec3(0.0, 1.0, 0.0);
    tangent = normalize(s * along.x + t * along.y + axis * along.z);
    axis = normalize(s * n.x + t * n.y + axis * n.z);
    bool fades = (surface.flags & SURFACE_RELIEF_FADES) != 0u;
    return fades ? min(0.125 * dot(n.xy, n.xy) / max(n.z * n.z, 1e-12), 1.0) : 0.0;
}

// What is left of light in a direction whose cosine to the interpolated normal is given (Conty Estevez, Lecocq and Stein 2019).
float relief_fading(float squared_roughness, float cosine) {
    float c2 = max(cosine * cosine, 1e-12);
    return 2.0 / (1.0 + sqrt(1.0 + squared_roughness * max(1.0 - c2, 0.0) / c2));
}
