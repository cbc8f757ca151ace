// Where a path goes next: where its vertex scatters light, and in thin media past a lamp as well, where the medium shines brightest.
#include "lib/path_state.glsl"
#include "lib/path_vertex.glsl"
#include "lib/light.glsl"
#include "lib/toward_light.glsl"

// Sets of random numbers that choose what a segment's sampling goes by: its direction, and then equiangular distances.
const uint PIVOT_SET = 0x40000000u;

// A point of a lamp, by which a segment goes.
struct Pivot {
    vec3 point;
    float area; // of the lamp
};

// Share of directions that go by a small lamp...
const float AIMED_SHARE = 0.25;
// ...and half as many by one whose area is the squared distance over this: what a broad lamp brings varies little with direction.
const float BROAD = 8.0;

struct Aim {
    vec3 axis;      // to a point of the lamp
    float share;    // probability of directions by the lamp; 0 where only scattering counts
    float u;        // decides between the two
};

// A point of the light, chosen with two random numbers; of the strongest lamp, where the light is infinitely far. A path that may
// meet light near a lamp must know of it, whatever light was chosen here: without, such paths are rare and bright.
vec3 light_pivot(Light light, vec2 u) {
    vec3 pivot = light.origin;
    if (light.kind == LIGHT_TRIANGLE || light.kind == LIGHT_QUAD || (HAS_RECTANGLE_LIGHTS && light.kind == LIGHT_RECTANGLE)) {
        vec2 v = plane_light_point(light, u);
        pivot += light.edge_1 * v.x + light.edge_2 * v.y;
    }
    return pivot;
}

// What the direction of a segment goes by, and its distances. The lamp is the one that the vertex at its end samples: each lamp's light is
// found where the path looks for it, and none by paths that went by another one, which would come near it seldom and bring much.
Pivot find_pivot(Path path, uint segment) {
    float u = vertex_numbers(path, segment).x;
    Light light = LIGHT(choose_light(u));
    return Pivot(light_pivot(light, sample_set(path, PIVOT_SET + segment).zw), light.area);
}

// What directions from a point in a medium go by.
Aim aim_at(Pivot pivot, vec3 point, Medium medium, float u) {
    vec3 way = pivot.point - point;
    float squared = dot(way, way);
    if (medium.equiangular == 0.0 || squared == 0.0) {
        return Aim(vec3(0.0, 0.0, 1.0), 0.0, u);
    }
    return Aim(way * inversesqrt(squared), AIMED_SHARE * squared / (squared + BROAD * pivot.area), u);
}

// What a vertex's next direction goes by. Glass is left to its own: a direction through it is not seen from the other side.
Aim find_aim(Path path, Vertex vertex, Pivot pivot) {
    bool may = HAS_EQUIANGULAR && (vertex.in_medium || !HAS_DIELECTRIC || (vertex.surface.flags & SURFACE_ORIENTED) == 0u);
    if (!may) {
        return Aim(vec3(0.0, 0.0, 1.0), 0.0, 0.0);
    }
    return aim_at(pivot, vertex.point, MEDIUM(valid_medium(path.medium)), sample_set(path, PIVOT_SET + path.segment + 1u).y);
}

// Density of a direction that scattering has with the density `pdf`, by both ways to choose it.
float aimed_pdf(Aim aim, float pdf, vec3 direction) {
    return HAS_EQUIANGULAR && aim.share > 0.0 ? mix(pdf, toward_light_pdf(aim.axis, direction), aim.share) : pdf;
}

// Whether it is the vertex of a medium that others scatter at as well, each of them from where it comes: lib/path_share.glsl.
bool is_common(Path path, Vertex vertex) {
    return HAS_SHARING && HAS_HENYEY_GREENSTEIN && path.sharing == 2u && path.depth == 2u && vertex.in_medium;
}

// The density of scattering that the weights of multiple importance sampling go by. Any will do that the two ways to a light agree on; at
// a common vertex all paths must, wherever they come from.
float weighing_pdf(Path path, Vertex vertex, float scattered) {
    return is_common(path, vertex) ? INV_4PI : scattered;
}

// The next direction: by the one-sample model of multiple importance sampling (Veach and Guibas 1995), with the balance heuristic.
// `scattered` is the density by scattering alone.
BsdfSample sample_next(Vertex vertex, Aim aim, vec2 u, float lobe, out float scattered) {
    BsdfSample next = sample_scattering(vertex, u, lobe);
    scattered = next.pdf;
    if (HAS_EQUIANGULAR && aim.share > 0.0) {
        bool aimed = aim.u < aim.share;
        if (aimed || next.pdf > 0.0) {
            next.direction = aimed ? sample_toward_light(aim.axis, u) : next.direction;
            next.eta = aimed ? 1.0 : next.eta;
            BsdfValue value = eval_scattering(vertex, next.direction);
            scattered = value.pdf;
            next.pdf = aimed_pdf(aim, value.pdf, next.direction);
            next.weight = value.value / next.pdf;
        } else {
            next.weight /= 1.0 - aim.share;
        }
    }
    return next;
}
