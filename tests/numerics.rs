//! What must not depend on the size of anything: coefficients, scales, places, angles, shapes of triangles, and the ends of
//! the random numbers. The table of what holds, and how well, is in `docs/THEORY.md`, section "Numerical behaviour".
//!
//! That no sample is lost is part of every image here: `images::mean` fails where one is not finite.

mod common;

#[path = "numerics/samplers.rs"]
mod samplers;
