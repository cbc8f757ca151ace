// Unit kernel of lib/light.glsl: (point, v), (u, which light, u of the distance to an emitting medium, 0) in; (direction, distance), (weight, density), and
// (density asked for by what the light is, line of the alias table, rescaled number, whether the line is kept), and of a
// lamp in the direction of a point of its plane or near its centre, 1.5 u - 0.25 along its edges, (what it sends, distance) out.
#version 460
#include "lib/layout.glsl"
#include "lib/light.glsl"

layout(local_size_x = WORKGROUP) in;
layout(set = 0, binding = 0, std430) readonly buffer Inputs { vec4 inputs[]; };
layout(set = 0, binding = 1, std430) readonly buffer Lights { Light lights[]; };
layout(set = 0, binding = 2, std430) buffer Outputs { vec4 outputs[]; };

void main() {
    uint i = gl_GlobalInvocationID.x;
    if (i >= uint(inputs.length()) / 2u) {
        return;
    }
    vec3 point = inputs[2u * i].xyz;
    vec2 u = vec2(inputs[2u * i + 1u].x, inputs[2u * i].w);
    Light light = lights[uint(inputs[2u * i + 1u].y)];
    LightSample found;
    float pdf = 0.0;
    if (light.kind == LIGHT_POINT) {
        found = sample_point_light(light, point);
    } else if (light.kind == LIGHT_SPOT) {
        found = sample_spot_light(light, point);
    } else if (light.kind == LIGHT_DIRECTIONAL) {
        found = sample_directional_light(light);
    } else if (light.kind == LIGHT_VOLUME) {
        found = sample_volume_light(light, point, u, inputs[2u * i + 1u].z);
        pdf = volume_light_pdf(light, point, found.direction);
    } else if (light.kind == LIGHT_SPHERE) {
        found = sample_sphere_light(light, point, u);
        pdf = sphere_light_pdf(light.edge_1.x, distance(point, light.origin));
    } else if (light.kind == LIGHT_RECTANGLE) {
        found = sample_rectangle_light(light, point, u);
        pdf = rectangle_light_pdf(light, point, found.distance, -dot(found.direction, light.normal));
    } else {
        found = sample_plane_light(light, point, u);
        pdf = area_pdf(light.area, found.distance, -dot(found.direction, light.normal));
    }
    float rescaled = u.x;
    uint line = alias_line(uint(lights.length()), rescaled);
    bool keeps = alias_keeps(lights[line].alias_threshold, rescaled);
    vec2 v = 1.5 * u - 0.25;
    vec3 towards = normalize(light.origin + light.edge_1 * v.x + light.edge_2 * v.y - point);
    LightSample met = light.kind == LIGHT_SPHERE ? sphere_light_in(light, point, towards) : plane_light_in(light, point, towards);
    outputs[4u * i] = vec4(found.direction, found.distance);
    outputs[4u * i + 1u] = vec4(found.weight, found.pdf);
    outputs[4u * i + 3u] = vec4(met.weight, met.distance);
    outputs[4u * i + 2u] = vec4(pdf, float(line), rescaled, float(keeps));
}
