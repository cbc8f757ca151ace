// Directions in which a medium scatters the light of a point towards the vertex. Along a ray that leaves at the angle θ to the point, at
// the distance r, ∫ dt / distance² = (π − θ) / (r sin θ): the density is as this is, per solid angle (π − θ) / (π³ sin θ). Where the
// phase function alone chooses directions, few paths come near a lamp, and those bring so much that the variance has no bounds.
// Together with equiangular distances this is the sampling of double scattering by Georgiev, Křivánek, Hachisuka, Nowrouzezahrai and
// Jarosz 2013 ("Joint Importance Sampling of Low-Order Volumetric Scattering", section 4), for a medium without extinction.
#include "lib/math.glsl"

// Smallest sine of the angle: closer to the point the density stays as it is there.
const float LEAST_SINE = 1e-6;

// `axis` is the unit vector to the point.
vec3 sample_toward_light(vec3 axis, vec2 u) {
    float theta = PI * u.x / (1.0 + sqrt(1.0 - u.x));
    float phi = 2.0 * PI * u.y;
    return from_frame(axis, vec3(sin(theta) * vec2(cos(phi), sin(phi)), cos(theta)));
}

float toward_light_pdf(vec3 axis, vec3 direction) {
    float sine = max(length(cross(axis, direction)), LEAST_SINE);
    return arctan2(sine, -dot(axis, direction)) / (PI * PI * PI * sine);
}
