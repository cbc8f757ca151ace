//! The renderer against tables of known answers: slabs, balls, single scattering, point sources, extreme numbers. What the
//! tables are and how they are used stands in `docs/TRUTH.md`.
//!
//! Every check tests the core rows; `TYNDALL_FULL=1` tests all of them, with more samples. Each table's line of the table of
//! results goes to `target/truth`.

mod common;

#[path = "truth/absorption.rs"]
mod absorption;
#[path = "truth/beams.rs"]
mod beams;
#[path = "truth/emission.rs"]
mod emission;
#[path = "truth/heterogeneous.rs"]
mod heterogeneous;
#[path = "truth/numerics.rs"]
mod numerics;
#[path = "truth/point_source.rs"]
mod point_source;
#[path = "truth/single_scattering.rs"]
mod single_scattering;
#[path = "truth/slabs.rs"]
mod slabs;
#[path = "truth/spheres.rs"]
mod spheres;

/// More cases than a run has, for the bound on the worst of them.
const CASES: usize = 1000;

#[test]
fn all_cases_together_show_a_bias_that_none_shows_alone() {
    common::trial::check_that_pooling_sees_a_small_bias();
}
