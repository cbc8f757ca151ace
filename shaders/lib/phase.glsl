// Phase functions, [1/sr]. cos is the dot product of the directions of propagation before and after scattering: +1 is straight
// on, and the mean cosine is g. This convention is stated here and nowhere else. PHASE(i) and VALUE(i), the tables of components
// and of numbers, are those of the file that includes this one.
#include "lib/constants.glsl"
#include "lib/layout.glsl"
#include "lib/math.glsl"

// A scattering angle. 1 - cos (of Henyey and Greenstein's with g < 0: 1 + cos) and the sine keep full relative accuracy.
struct PhaseAngle {
    float one_minus_cos;
    float cos_theta;
    float sin_theta;
};

// Henyey and Greenstein (1941) from 1 - cos (mirrored for g < 0), which keeps its accuracy where |g| is near 1.
float henyey_greenstein_from(float g, float m) {
    float a = abs(g);
    float o = 1.0 - a;
    float d = o * o + 2.0 * a * m;
    return o * (1.0 + a) * INV_4PI / (d * sqrt(d));
}

// The phase function for unit directions before and after. Their difference keeps the accuracy that their dot product loses.
float eval_henyey_greenstein(float g, vec3 before, vec3 after) {
    vec3 difference = g >= 0.0 ? after - before : after + before;
    return henyey_greenstein_from(g, 0.5 * dot(difference, difference));
}

// The angle at which the distribution function reaches u in [0, 1). Every factor is non-negative, there is no cancellation
// and no branch but the sign of g, so the form holds for all |g| < 1 including 0. The density is eval_henyey_greenstein.
//   F(cos) = (1 - g^2)/(2 g) (1/sqrt(1 + g^2 - 2 g cos) - 1/(1 + g)), solved for cos, then factored.
PhaseAngle sample_henyey_greenstein(float g, float u) {
    float a = abs(g);
    float x = g >= 0.0 ? u : 1.0 - u;
    float o = 1.0 - a;
    float d = o + 2.0 * a * x;
    float q = o / d;
    float r = (1.0 + a) / d;
    float m = 2.0 * (1.0 - x) * (1.0 + a * x) * q * q;
    float p = 2.0 * x * (o + a * x) * r * r;
    float c = m < 1.0 ? 1.0 - m : p - 1.0;
    return PhaseAngle(m, g >= 0.0 ? c : -c, sqrt(m * p));
}

// Rayleigh's (1871), for unpolarised light.
float eval_rayleigh(float cos_theta) {
    return 0.75 * INV_4PI * (1.0 + cos_theta * cos_theta);
}

// The angle at which the distribution function reaches u in [0, 1): F(cos) = 1/2 + (3 cos + cos^3)/8. With m = 1 - |cos| and
// v = min(u, 1 - u), which is exact, this is m (6 - 3 m + m^2) = 8 v. The cubic is monotonic and concave in [0, 1], and
// Newton's method from the ratio below, which is right at both ends, is exact to single precision after three steps. Keeping m
// keeps the sine near both poles.
PhaseAngle sample_rayleigh(float u) {
    float v = min(u, 1.0 - u);
    float b = 2.0 - 4.0 * v;
    float m = 16.0 * v * (1.0 + v) / (12.0 + b * b);
    for (uint k = 0u; k < 3u; ++k) {
        m = (8.0 * v - m * m * (3.0 - 2.0 * m)) / (3.0 * (1.0 + (1.0 - m) * (1.0 - m)));
    }
    return u < 0.5 ? PhaseAngle(2.0 - m, m - 1.0, sqrt(m * (2.0 - m))) : PhaseAngle(m, 1.0 - m, sqrt(m * (2.0 - m)));
}

// A table's numbers are the densities at `count` cosines from -1 to 1 in equal steps, with straight lines between them, and
// then the values of the distribution function there, from 0 to 1.
//
// The table at a cosine in [-1, 1].
float eval_tabulated(uint first, uint count, float cos_theta) {
    float place = (0.5 * cos_theta + 0.5) * float(count - 1u);
    uint index = min(whole(max(place, 0.0)), count - 2u);
    float share = place - float(index);
    return (1.0 - share) * VALUE(first + index) + share * VALUE(first + index + 1u);
}

// The angle at which the distribution function reaches u in [0, 1). The interval is found by bisection; one of probability 0
// is never found. Within it the density is linear from a to b, and the distribution function reaches the share r at
//   x = r (a + b) / (a + sqrt((1 - r) a^2 + r b^2)),
// where nothing cancels; 1 - x is the same from the other end. So both poles keep their accuracy.
PhaseAngle sample_tabulated(uint first, uint count, float u) {
    uint distribution = first + count;
    uint low = 0u, high = count - 1u;
    [[dont_unroll]] while (high - low > 1u) {
        uint middle = (low + high) >> 1u;
        if (VALUE(distribution + middle) <= u) {
            low = middle;
        } else {
            high = middle;
        }
    }
    float below = VALUE(distribution + low), above = VALUE(distribution + high);
    float a = VALUE(first + low), b = VALUE(first + high);
    // Relative to the larger one, so that squares neither overflow nor underflow.
    float most = max(a, b);
    a /= most;
    b /= most;
    float r = (u - below) / (above - below), rest = (above - u) / (above - below);
    float root = sqrt(rest * a * a + r * b * b);
    float x = r > 0.0 ? r * (a + b) / (a + root) : 0.0;
    float y = rest > 0.0 ? rest * (a + b) / (b + root) : 0.0;
    float steps = float(count - 1u);
    float p = 2.0 * (float(low) + x) / steps;
    float m = 2.0 * (float(count - 1u - high) + y) / steps;
    return PhaseAngle(m, m < 1.0 ? 1.0 - m : p - 1.0, sqrt(m * p));
}

// One component for unit directions before and after.
float eval_component(Phase component, vec3 before, vec3 after) {
    if (component.kind == PHASE_HENYEY_GREENSTEIN) {
        return eval_henyey_greenstein(component.g, before, after);
    }
    float cos_theta = clamp(dot(before, after), -1.0, 1.0);
    return component.kind == PHASE_RAYLEIGH ? eval_rayleigh(cos_theta)
                                            : eval_tabulated(component.first_value, component.value_count, cos_theta);
}

// A mixture is named as in Medium.phase. Its density is that of all components together.
float eval_mixture(uint phase, vec3 before, vec3 after) {
    uint first = (phase & 0xffffffu) - 1u, count = phase >> 24u;
    float sum = 0.0;
    [[dont_unroll]] for (uint k = 0u; k < count; ++k) {
        Phase component = PHASE(first + k);
        sum += component.weight * eval_component(component, before, after);
    }
    return sum;
}

// An angle of the component in which `choice` in [0, 1) falls. The number that chooses is not used again: what a small share
// leaves of its digits would be too coarse for an angle.
PhaseAngle sample_mixture(uint phase, float u, float choice) {
    uint first = (phase & 0xffffffu) - 1u, count = phase >> 24u;
    uint index = 0u;
    float below = PHASE(first).weight;
    [[dont_unroll]] while (index + 1u < count && choice >= below) {
        index += 1u;
        below += PHASE(first + index).weight;
    }
    Phase component = PHASE(first + index);
    if (component.kind == PHASE_HENYEY_GREENSTEIN) {
        return sample_henyey_greenstein(component.g, u);
    }
    if (component.kind == PHASE_RAYLEIGH) {
        return sample_rayleigh(u);
    }
    return sample_tabulated(component.first_value, component.value_count, u);
}
