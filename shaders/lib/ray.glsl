// Rays against primitives. All tests are free of any length scale.
#include "lib/constants.glsl"

// A ray with the frame in which triangles are seen along it.
struct Ray {
    vec3 origin;
    vec3 direction; // unit
    vec3 tangent;
    vec3 bitangent;
    float t_min;    // hits lie behind it, or at it with a primitive after `last`
    uint last;      // the primitive that was crossed at t_min; NONE if the ray begins there
};

// A hit on a plane figure: distance, barycentric coordinates of the second and third corner, and whether the ray goes along
// the normal there (leaves) or against it.
struct TriangleHit {
    bool hit;
    bool along_normal;
    float t;
    vec2 barycentric;
};

// Whether a point lies to the left of a directed edge. `cross_product` is the edge function, `edge` its direction. A point on
// the line belongs to one side or the other by the direction of the edge alone, like pixels on edges in a rasteriser, so of
// two triangles that share an edge exactly one is hit, and a closed mesh is always entered as often as left.
bool left_of(float cross_product, vec2 edge) {
    bool upward = edge.y > 0.0 || (edge.y == 0.0 && edge.x > 0.0);
    return cross_product > 0.0 || (cross_product == 0.0 && upward);
}

// Watertight test: corners are projected along the ray, each by the same operations whatever triangle asks, and the signs of
// edge functions decide in the plane (Woop, Benthin and Wald 2013, with an orthonormal frame for their shear).
TriangleHit intersect_triangle(Ray ray, vec3 a, vec3 b, vec3 c) {
    precise vec3 ra = a - ray.origin, rb = b - ray.origin, rc = c - ray.origin;
    precise vec2 pa = vec2(dot(ray.tangent, ra), dot(ray.bitangent, ra));
    precise vec2 pb = vec2(dot(ray.tangent, rb), dot(ray.bitangent, rb));
    precise vec2 pc = vec2(dot(ray.tangent, rc), dot(ray.bitangent, rc));
    precise float u = pb.x * pc.y - pb.y * pc.x;
    precise float v = pc.x * pa.y - pc.y * pa.x;
    precise float w = pa.x * pb.y - pa.y * pb.x;
    bool su = left_of(u, pc - pb), sv = left_of(v, pa - pc), sw = left_of(w, pb - pa);
    float determinant = u + v + w;
    float inverse = 1.0 / determinant;
    TriangleHit hit;
    hit.barycentric = vec2(v, w) * inverse;
    hit.t = (u * dot(ray.direction, ra) + v * dot(ray.direction, rb) + w * dot(ray.direction, rc)) * inverse;
    hit.along_normal = determinant > 0.0;
    hit.hit = su == sv && sv == sw && determinant != 0.0;
    return hit;
}

// Distances to the two points of a sphere on the line of a ray; far < near if there are none. The discriminant comes from the
// vector of closest approach, which does not cancel (Haines et al. 2019).
vec2 intersect_sphere(Ray ray, vec3 center, float radius) {
    vec3 offset = ray.origin - center;
    float along = dot(offset, ray.direction);
    vec3 closest = offset - along * ray.direction;
    float discriminant = radius * radius - dot(closest, closest);
    if (discriminant < 0.0) {
        return vec2(1.0, -1.0);
    }
    float half_chord = sqrt(discriminant);
    return vec2(-along - half_chord, -along + half_chord);
}

// How far a ray that leaves a surface must begin from it: a few roundings of the largest coordinate that made the point.
float offset_distance(float largest_coordinate) {
    return 4e-7 * largest_coordinate;
}

// How far from a surface a vertex in a medium is kept: one rounding of the largest coordinate, enough for its rays to find the
// surface. More would matter in a medium whose mean free path is not much longer.
float vertex_clearance(float largest_coordinate) {
    return 1.2e-7 * largest_coordinate;
}
