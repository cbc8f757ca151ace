// How a path comes to light: by chance, or by light sampling at its vertices. Both together are weighted by multiple importance
// sampling (Veach and Guibas 1995).
#include "lib/path_state.glsl"
#include "lib/path_vertex.glsl"
#include "lib/path_aim.glsl"
#include "lib/light.glsl"
#include "lib/sky.glsl"
#include "lib/texture.glsl"
#include "lib/grid.glsl"

// Weight of what one way to the light finds, if another finds it with `ratio` times its density: the power heuristic with the exponent 2
// (Veach and Guibas 1995). Light sampling alone has little variance, so what scattering finds by chance must count for little beside it.
float power_heuristic(float ratio) {
    return 1.0 / (1.0 + ratio * ratio);
}

// Weight of a direction found by scattering that light sampling finds with density light_pdf. Scattering finds the light only if the flight
// survives, so its probability to do so is part of the density.
float scattering_mis_weight(Path path, float survival, float light_pdf) {
    float found = HAS_MIS ? abs(path.pdf) * survival : 0.0;
    if (path.pdf == 0.0 || light_pdf == 0.0) {
        return 1.0;
    }
    return found > light_pdf ? power_heuristic(light_pdf / found) : 1.0 - power_heuristic(found / light_pdf);
}

// The same where the density is that of light sampling, or of a guide: of directions that glass bends since, it alone is known. A probe has
// what is left.
float emission_weight(Path path, float light_pdf) {
    bool guided = HAS_GUIDES && path.guide_pdf > 0.0;
    float weight = scattering_mis_weight(path, survival(path), guided ? path.guide_pdf : light_pdf);
    return HAS_GUIDES && path.probe ? 1.0 - weight : weight;
}

bool emitters_seen(Path path) {
    return !(HAS_HIDDEN_EMITTERS && path.depth == 0u);
}

bool is_envmap(Light light) {
    return HAS_ENVMAPS && (light.kind & ((1u << LIGHT_TEXTURE_SHIFT) - 1u)) == LIGHT_ENVMAP;
}

// A direction in the axes of an environment map, and back.
vec3 to_envmap(Light light, vec3 direction) {
    return vec3(dot(light.edge_1, direction), dot(light.edge_2, direction), dot(light.normal, direction));
}

vec3 from_envmap(Light light, vec3 direction) {
    return normalize(light.edge_1 * direction.x + light.edge_2 * direction.y + light.normal * direction.z);
}

// Adds what comes from all directions of the sky to a path that leaves the scene.
void add_sky(inout Path path) {
    if (!(HAS_CONSTANT_LIGHT || HAS_ENVMAPS) || !emitters_seen(path)) {
        return;
    }
    [[dont_unroll]] for (uint i = params.first_sky; i < params.light_count; ++i) {
        Light light = LIGHT(i);
        vec3 radiance = light.radiance;
        // Light sampling takes the constant light's directions from the same scattering function (see sample_light).
        float pdf = path.scattered_pdf;
        if (is_envmap(light)) {
            Texture sky = TEXTURE(light.kind >> LIGHT_TEXTURE_SHIFT);
            vec3 direction = to_envmap(light, path.direction);
            vec2 uv = sky_uv(direction);
            radiance = sky_radiance(sky, uv);
            pdf = sky_pdf(sky, uv.x, direction.y);
        }
        float light_pdf = HAS_LIGHT_SAMPLING && path.pdf >= 0.0 ? light.probability * pdf : 0.0;
        path.radiance += survived_throughput(path) * radiance * emission_weight(path, light_pdf);
    }
}

// The colour of the texture in front of a light, for light in a direction from a point on it.
vec3 slide_color(Light light, vec3 point, vec3 direction) {
    if (!HAS_SLIDES || light.texture == 0u) {
        return vec3(1.0);
    }
    vec2 place;
    if (light.kind == LIGHT_SPOT) {
        place = vec2(dot(direction, light.edge_2), dot(direction, light.slide_y)) / dot(direction, light.normal);
    } else {
        // The coordinates along the edges, which need not be perpendicular.
        vec3 across = cross(light.edge_1, light.edge_2), offset = point - light.origin;
        place = vec2(dot(cross(offset, light.edge_2), across), dot(cross(light.edge_1, offset), across)) / dot(across, across);
    }
    return eval_texture(TEXTURE(light.texture - 1u), place);
}

// Whether what a camera ray finds of lamps is left to other rays: src/seen.rs.
bool seen_apart(uint pixel) {
    uint row = pixel / params.film_width - params.crop_y, column = pixel % params.film_width - params.crop_x;
    return VALUE(params.first_seen + row * params.crop_width + column) > 0.0;
}

// Adds what a primitive emits towards the path.
void add_emission(inout Path path, Primitive primitive, float t, vec3 normal) {
    float cos_light = -dot(path.direction, normal);
    if (!HAS_AREA_LIGHTS || primitive.light == 0u || cos_light <= 0.0 || !emitters_seen(path)) {
        return;
    }
    if (HAS_SEEN && path.depth == 0u && seen_apart(path.pixel)) {
        return;
    }
    Light light = LIGHT(primitive.light - 1u);
    float pdf;
    if (HAS_SPHERE_LIGHTS && light.kind == LIGHT_SPHERE) {
        pdf = sphere_light_pdf(light.edge_1.x, distance(path.origin, light.origin));
    } else if (HAS_RECTANGLE_LIGHTS && light.kind == LIGHT_RECTANGLE) {
        // Of the vertex itself, as light sampling has it: near the light the offset of the ray's origin counts.
        pdf = rectangle_light_pdf(light, path.point, t, cos_light);
    } else if (HAS_PLANE_LIGHTS) {
        pdf = area_pdf(light.area, t, cos_light);
    }
    // In a mirror's direction the choice of the light alone counts.
    float light_pdf = HAS_LIGHT_SAMPLING ? light.probability * (path.pdf < 0.0 ? 1.0 : pdf) : 0.0;
    vec3 radiance = light.radiance * slide_color(light, path.origin + path.direction * t, -path.direction);
    path.radiance += survived_throughput(path) * radiance * emission_weight(path, light_pdf);
}

// Adds what voxels emit along the flight through a homogeneous medium: one point stands for the way through them.
void add_field_emission(inout Path path, Medium medium, float way) {
    Grid grid = GRID((medium.grids & 0xffffffu) + 1u);
    vec2 clipped = clip_to_grid(grid, path.origin, path.direction, path.t_min, path.t_min + way);
    if (clipped.x >= clipped.y) {
        return;
    }
    float u = sample_set(path, EMISSION_SETS + path.segment).x;
    float t = clipped.x + u * (clipped.y - clipped.x);
    vec3 emitted = medium.emission * grid_value(grid, grid_local(grid, path.origin + path.direction * t)) * (clipped.y - clipped.x);
    if (HAS_CHROMATIC) {
        emitted *= survival_weight(channel_weights(path.throughput), path.tau_rgb + medium.sigma_t * (t - path.t_min));
    }
    path.radiance += path.throughput * emitted;
}

// Adds what a medium emits along the flight through it, from t_min on.
void add_medium_emission(inout Path path, Medium medium, float way, bool ended) {
    if (max_component(medium.emission) == 0.0 || !emitters_seen(path)) {
        return;
    }
    if (HAS_GRIDS && (medium.grids & MEDIUM_EMISSION_GRID) != 0u) {
        add_field_emission(path, medium, way);
        return;
    }
    vec3 length_rgb;
    if (HAS_CHROMATIC) {
        float u = sample_set(path, EMISSION_SETS + path.segment).x;
        vec3 weights = channel_weights(path.throughput);
        length_rgb = emitting_length_rgb(medium.collision_share, weights, path.tau_rgb, medium.sigma_t, way, ended, u);
    } else {
        length_rgb = vec3(emitting_length(medium.collision_share, medium.sigma_t.x, way, ended));
    }
    float mis_weight = 1.0;
    if (HAS_VOLUME_LIGHTS && HAS_LIGHT_SAMPLING && medium.light != 0u) {
        // Of the direction alone: whatever lies on the way, light sampling has the same density for all of its points.
        Light light = LIGHT(medium.light - 1u);
        float pdf = path.pdf < 0.0 ? 0.0 : volume_light_pdf(light, path.origin, path.direction);
        mis_weight = scattering_mis_weight(path, 1.0, light.probability * pdf);
    }
    path.radiance += path.throughput * medium.emission * length_rgb * mis_weight;
}

// What a lamp sends to a vertex from exactly this direction, if it is of a kind that has a surface.
LightSample lamp_in(Light light, vec3 point, vec3 direction) {
    LightSample found = LightSample(direction, 0.0, vec3(0.0), 0.0);
    if (HAS_SPHERE_LIGHTS && light.kind == LIGHT_SPHERE) {
        found = sphere_light_in(light, point, direction);
    } else if (light.kind == LIGHT_TRIANGLE || light.kind == LIGHT_QUAD || light.kind == LIGHT_RECTANGLE) {
        found = plane_light_in(light, point, direction);
    }
    if (HAS_SLIDES && light.texture != 0u && max_component(found.weight) > 0.0) {
        found.weight *= slide_color(light, point + direction * found.distance, -direction);
    }
    return found;
}

// Sets up a shadow ray to a lamp that a surface mirrors (see mirrored()). A path would see few of them, for it seldom goes that way where glass
// mirrors little. Returns whether there is anything to ask for.
bool sample_mirrored(inout Path path, Vertex vertex, BsdfValue mirror, float u) {
    uint index = choose_light(u);
    Light light = LIGHT(index);
    path.direction = from_surface_frame(vertex.tangent, vertex.axis, reflect_z(vertex.incident));
    LightSample found = lamp_in(light, vertex.point, path.direction);
    path.t_max = found.distance;
    path.light = index;
    path.light_channels = path.throughput * mirror.value;
    path.light_weight = path.light_channels * found.weight / light.probability;
    path.pdf_ratio = HAS_MIS ? mirror.pdf / light.probability : 0.0;
    path.light_medium = path.medium;
    path.origin = offset_origin(path, path.direction);
    return sides_agree(vertex, vertex.incident.z, path.direction) && (max_component(path.light_weight) > 0.0 || !is_finite(path.light_weight));
}

// Chooses a light and a point on it by u, and where a sampler has more to decide, by `decision`, and sets up the shadow ray. Returns whether there is anything to ask for.
bool sample_light(inout Path path, Vertex vertex, Aim aim, vec2 u, vec2 decision) {
    if (!HAS_LIGHT_SAMPLING) {
        return false;
    }
    uint index = choose_light(u.x);
    Light light = LIGHT(index);
    LightSample found;
    if (HAS_CONSTANT_LIGHT && light.kind == LIGHT_CONSTANT) {
        // No direction is better than another, so the scattering function samples them; what light sampling adds is the
        // transmittance, exact instead of 0 or 1.
        BsdfSample scattered = sample_scattering(vertex, u, decision.x);
        vec3 weight = scattered.pdf > 0.0 ? light.radiance / scattered.pdf : vec3(0.0);
        found = LightSample(scattered.direction, INFINITE_DISTANCE, weight, weighing_pdf(path, vertex, scattered.pdf));
    } else if (HAS_VOLUME_LIGHTS && light.kind == LIGHT_VOLUME) {
        found = sample_volume_light(light, vertex.point, u, sample_set(path, EMISSION_SETS + path.segment).y);
    } else if (HAS_POINT_LIGHTS && light.kind == LIGHT_POINT) {
        found = sample_point_light(light, vertex.point);
    } else if (HAS_SPOT_LIGHTS && light.kind == LIGHT_SPOT) {
        found = sample_spot_light(light, vertex.point);
    } else if (HAS_DIRECTIONAL_LIGHTS && light.kind == LIGHT_DIRECTIONAL) {
        found = sample_directional_light(light);
    } else if (is_envmap(light)) {
        if (HAS_MANY_LIGHTS) {
            // The digits that went into the choice of the light.
            u.x += decision.x / (SKY_STEPS * light.probability);
        }
        SkySample sky = sample_sky(TEXTURE(light.kind >> LIGHT_TEXTURE_SHIFT), u);
        found = LightSample(from_envmap(light, sky.direction), INFINITE_DISTANCE, sky.radiance / sky.pdf, sky.pdf);
    } else if (HAS_SPHERE_LIGHTS && light.kind == LIGHT_SPHERE) {
        found = sample_sphere_light(light, vertex.point, u);
    } else if (HAS_RECTANGLE_LIGHTS && light.kind == LIGHT_RECTANGLE) {
        found = sample_rectangle_light(light, vertex.point, u);
    } else if (HAS_PLANE_LIGHTS) {
        found = sample_plane_light(light, vertex.point, u);
    }
    // Where nothing arrives, there need be no point.
    if (HAS_SLIDES && light.texture != 0u && max_component(found.weight) > 0.0) {
        found.weight *= slide_color(light, vertex.point + found.direction * found.distance, -found.direction);
    }
    BsdfValue scattering = eval_scattering(vertex, found.direction);
    path.direction = found.direction;
    path.t_max = found.distance;
    path.light = index;
    path.light_channels = path.throughput * scattering.value;
    path.light_weight = path.light_channels * found.weight / light.probability;
    float pdf = aimed_pdf(aim, weighing_pdf(path, vertex, scattering.pdf), found.direction);
    path.pdf_ratio = HAS_MIS && found.pdf > 0.0 ? pdf / (found.pdf * light.probability) : 0.0;
    path.light_medium = medium_towards(vertex, path.medium, found.direction);
    path.origin = offset_origin(path, found.direction);
    return max_component(path.light_weight) > 0.0 || !is_finite(path.light_weight);
}
