// What is to be expected of the rest of a path, from a pilot run (see src/pilot.rs), and roulette by it.
//
// Roulette that ends a path with the probability 1 - q and weights the others with 1/q adds the variance (1/q - 1) L² of all that
// it may lose. Here a path that ends brings what was expected of it, and one that goes on only its difference to that, times 1/q,
// which costs no more than the difference is worth: L' + (L - L')/q for any L'. The best q is the root of the variance that the
// rest of the path adds to the pixel over the time it takes, in units of those of the image (Rath et al. 2022, "EARS").
#include "lib/constants.glsl"
#include "lib/math.glsl"

// The least probability to go on: no weight grows beyond 1/LEAST_KEEP at a vertex, whatever the pilot has missed.
const float LEAST_KEEP = 0.3;

// Of the vertices in a cell of space, apart for media and the six directions that a surface can face.
struct Outlook {
    vec3 mean;   // radiance to be expected, for a throughput of 1
    vec3 worth;  // variance over the rays it takes, times those of the image over its variance; negative where nothing is known
};

// The cell of a point, in units of cells from the lower corner.
uint outlook_cell(vec3 place, bool in_medium, vec3 axis) {
    uvec3 cell = whole(clamp(place, vec3(0.0), vec3(float(PILOT_CELLS) - 0.5)));
    vec3 size = abs(axis);
    uint along = size.x > size.y && size.x > size.z ? 0u : (size.y > size.z ? 1u : 2u);
    float component = along == 0u ? axis.x : (along == 1u ? axis.y : axis.z);
    uint face = in_medium ? 6u : 2u * along + (component < 0.0 ? 1u : 0u);
    return ((cell.z * PILOT_CELLS + cell.y) * PILOT_CELLS + cell.x) * 7u + face;
}

// The probability with which a path goes on. `focus` is one over the square of the pixel's radiance.
float keep_by_outlook(Outlook outlook, vec3 throughput, vec3 focus) {
    return clamp(sqrt(dot(throughput * throughput * focus, outlook.worth)), LEAST_KEEP, 1.0);
}
