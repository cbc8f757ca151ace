// What surfaces do to light. Cosines are those to the normal on the side of the incident ray.
#include "lib/constants.glsl"

// Lambert's law: BSDF times cosine, divided by the reflectance. [1/sr]
float eval_diffuse(float cos_out) {
    return max(cos_out, 0.0) * INV_PI;
}

// Density, per solid angle, of cosine-distributed directions; equal to eval_diffuse, so the sampling weight is the reflectance.
float diffuse_pdf(float cos_out) {
    return max(cos_out, 0.0) * INV_PI;
}
