//! What single precision makes of each function of the kernels, declared in one place.

use super::comparison::{Comparison, Tolerance};

/// What each function of the kernels promises. Single precision resolves 6e-8; sine and cosine of drivers have an
/// absolute error of some 2e-7 (the Vulkan specification allows 2^-11); below 1e-37 drivers may flush to zero.
const TOLERANCES: &[Tolerance] = &[
    Tolerance { function: "minus_log_1m", relative: 3e-7, absolute: 0.0 },
    Tolerance { function: "exp_minus", relative: 3e-7, absolute: 2e-38 },
    Tolerance { function: "sine", relative: 2e-7, absolute: 1e-37 },
    Tolerance { function: "arctan2", relative: 3e-7, absolute: 1e-37 },
    Tolerance { function: "orthonormal_frame", relative: 3e-7, absolute: 0.0 },
    Tolerance { function: "square_to_sphere", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "square_to_cosine_hemisphere", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "square_to_cone", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "warp densities", relative: 3e-6, absolute: 0.0 },
    Tolerance { function: "intersect_triangle t", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "intersect_triangle barycentric", relative: 0.0, absolute: 5e-6 },
    Tolerance { function: "intersect_sphere", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "nearest hit", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "channel_weights", relative: 4e-7, absolute: 0.0 },
    Tolerance { function: "free_flight", relative: 2e-7, absolute: 0.0 },
    Tolerance { function: "survival_probability", relative: 6e-7, absolute: 2e-38 },
    Tolerance { function: "survival_weight", relative: 1e-6, absolute: 0.0 },
    Tolerance { function: "scatter_weight", relative: 1.5e-6, absolute: 0.0 },
    Tolerance { function: "emitting_length", relative: 5e-7, absolute: 0.0 },
    Tolerance { function: "emitting_length_rgb", relative: 3e-6, absolute: 0.0 },
    Tolerance { function: "1 - cos", relative: 6e-7, absolute: 0.0 },
    Tolerance { function: "cos", relative: 0.0, absolute: 4e-7 },
    Tolerance { function: "sin", relative: 6e-7, absolute: 0.0 },
    Tolerance { function: "henyey_greenstein_from", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "scattered direction", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "eval_henyey_greenstein", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "mixture's 1 - cos", relative: 6e-7, absolute: 1e-7 },
    Tolerance { function: "mixture's cos", relative: 0.0, absolute: 4e-7 },
    Tolerance { function: "mixture's sin", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "mixture's direction", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "eval_mixture", relative: 3e-6, absolute: 2e-6 },
    Tolerance { function: "fresnel_dielectric", relative: 4e-6, absolute: 2e-7 },
    Tolerance { function: "cosine of refraction", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "fresnel_conductor", relative: 4e-6, absolute: 0.0 },
    Tolerance { function: "sample_facet", relative: 4e-6, absolute: 0.0 },
    Tolerance { function: "facet_density", relative: 6e-6, absolute: 2e-38 },
    Tolerance { function: "facet_masking", relative: 4e-6, absolute: 2e-38 },
    Tolerance { function: "facet_pdf", relative: 1e-5, absolute: 2e-38 },
    Tolerance { function: "eval_texture", relative: 0.0, absolute: 4e-5 },
    Tolerance { function: "eval_bsdf value", relative: 2e-5, absolute: 1e-15 },
    Tolerance { function: "eval_bsdf pdf", relative: 2e-5, absolute: 1e-15 },
    Tolerance { function: "sample_bsdf direction", relative: 4e-6, absolute: 0.0 },
    Tolerance { function: "sample_bsdf pdf", relative: 2e-5, absolute: 1e-15 },
    Tolerance { function: "sample_bsdf weight", relative: 2e-5, absolute: 1e-15 },
    // Sines of flat angles, up to sqrt(1 - 2e-3), lose a factor of 500.
    Tolerance { function: "rectangle light direction", relative: 3e-4, absolute: 0.0 },
    Tolerance { function: "rectangle light weight", relative: 1e-4, absolute: 0.0 },
    Tolerance { function: "rectangle light pdf", relative: 1e-4, absolute: 0.0 },
    Tolerance { function: "light direction", relative: 3e-6, absolute: 0.0 },
    Tolerance { function: "light distance", relative: 3e-6, absolute: 0.0 },
    Tolerance { function: "sphere light distance", relative: 4e-4, absolute: 0.0 },
    Tolerance { function: "light weight", relative: 4e-6, absolute: 0.0 },
    Tolerance { function: "light pdf", relative: 4e-6, absolute: 0.0 },
    Tolerance { function: "spot weight", relative: 0.0, absolute: 2e-5 },
    Tolerance { function: "sky direction", relative: 2e-6, absolute: 0.0 },
    Tolerance { function: "sky coordinates", relative: 0.0, absolute: 3e-7 },
    Tolerance { function: "sky radiance", relative: 2e-5, absolute: 0.0 },
    Tolerance { function: "sky pdf", relative: 1e-7, absolute: 0.0 },
    Tolerance { function: "alias rescaled", relative: 0.0, absolute: 1e-5 },
    Tolerance { function: "camera_direction", relative: 3e-7, absolute: 0.0 },
];

/// A comparison with the tolerance of a function of the table.
pub fn comparison(function: &str) -> Comparison {
    Comparison::new(TOLERANCES, function)
}
