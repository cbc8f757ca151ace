// What a surface is at a point: texture coordinates, colours, opacity, and the frame of its BSDF.
#include "lib/path_state.glsl"
#include "lib/texture.glsl"

bool is_sphere(Primitive primitive) {
    return HAS_SPHERES && (primitive.surface & PRIMITIVE_SPHERE) != 0u;
}

// Texture coordinates of a point on a primitive: a sphere's from the direction from its centre, (u, v) = (azimuth / 2 pi, polar angle / pi).
vec2 texture_coordinates(Primitive primitive, uint index, vec3 point, vec2 barycentric) {
    if (is_sphere(primitive)) {
        vec3 outwards = point - primitive.a;
        float azimuth = arctan2(outwards.y, outwards.x) * (0.5 * INV_PI);
        return vec2(azimuth < 0.0 ? azimuth + 1.0 : azimuth, arctan2(length(outwards.xy), outwards.z) * INV_PI);
    }
    Corners corners = CORNERS(index);
    vec3 weights = vec3(1.0 - barycentric.x - barycentric.y, barycentric);
    return vec2(dot(vec3(corners.u_a, corners.u_b, corners.u_c), weights), dot(corners.v, weights));
}

// Probability that light meets a mask.
float opacity_at(Surface surface, Primitive primitive, uint index, vec3 point, vec2 barycentric) {
    uint texture = surface.textures_2 >> 16;
    if (HAS_TEXTURES && texture != 0u) {
        vec2 uv = texture_coordinates(primitive, index, point, barycentric);
        return clamp(eval_texture(TEXTURE(texture - 1u), uv).x, 0.0, 1.0);
    }
    return surface.opacity;
}

// Puts the colours at a place in the place of their means.
void apply_textures(inout Surface surface, vec2 uv) {
    uint reflectance = surface.textures_1 & 0xffffu, specular = surface.textures_1 >> 16, transmittance = surface.textures_2 & 0xffffu;
    if (reflectance != 0u) {
        surface.reflectance = eval_texture(TEXTURE(reflectance - 1u), uv);
    }
    if (specular != 0u) {
        surface.specular = eval_texture(TEXTURE(specular - 1u), uv);
    }
    if (transmittance != 0u) {
        surface.transmittance = eval_texture(TEXTURE(transmittance - 1u), uv);
    }
}

// The normal of the BSDF's frame: that of the surface, or the interpolated one.
vec3 shading_normal(uint index, vec2 barycentric, vec3 normal) {
    Corners corners = CORNERS(index);
    vec3 sum = corners.normal_a * (1.0 - barycentric.x - barycentric.y) + corners.normal_b * barycentric.x + corners.normal_c * barycentric.y;
    float squared = dot(sum, sum);
    return squared > 0.0 ? sum * inversesqrt(squared) : normal;
}

// The tangent of the BSDF's frame: the direction in which u grows, where it has one.
vec3 surface_tangent(Primitive primitive, uint index, vec3 point, vec3 axis) {
    vec3 along;
    if (is_sphere(primitive)) {
        vec3 outwards = point - primitive.a;
        along = vec3(-outwards.y, outwards.x, 0.0);
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
