//! Slabs (tables A, A2, B): how much light comes back and how much gets through, by reciprocity seen by a camera.
//!
//! Light from one half of the sky: an environment of radiance 1, and a black sheet between the slab and the other half.

use crate::CASES;
use crate::common::scenes::{self, v};
use crate::common::trial::{Case, judge, must_reject};
use crate::common::truth::{Row, cosines_of_check, rows, tolerance, whole};
use glam::{DMat4, DVec3};
use tyndall::scene::{Bsdf, Light, Scene, Shape};

/// A slab of extinction 1, unless scaled.
#[derive(Clone, Copy)]
pub struct Slab {
    pub tau: f64,
    pub albedo: f64,
    pub g: f64,
    /// Refractive index; 1 is no surface at all.
    pub n: f64,
    /// Size of a mean free path.
    pub scale: f64,
    /// Half the side of the box, in mean free paths.
    pub half_width: f64,
}

impl Slab {
    /// The slab of a row.
    pub fn of(row: &Row) -> Slab {
        let [tau, albedo, g, n] = ["tau", "albedo", "g", "n"].map(|name| row.number(name));
        Slab::new(tau, albedo, g, n)
    }

    /// A slab so wide that its sides do not matter: lateral modes decay at least as exp(−π W / (τ + 5 / (1 − g))).
    pub fn new(tau: f64, albedo: f64, g: f64, n: f64) -> Slab {
        Slab { tau, albedo, g, n, scale: 1.0, half_width: 12.0 * tau + 40.0 / (1.0 - g) + 20.0 }
    }

    pub fn half(&self) -> f64 {
        self.half_width * self.scale
    }

    /// Height of its upper face; it lies around the origin, where single precision is best.
    pub fn top(&self) -> f64 {
        self.tau / 2.0 * self.scale
    }

    /// Distance of camera and sheets from the faces; of a millionth of all directions the slab's sides are seen.
    fn clearance(&self) -> f64 {
        1e-3 * self.half()
    }

    /// Where the camera looks: not on the diagonal of the face.
    fn target(&self) -> DVec3 {
        v(0.0123, 0.0071, 0.0) * self.half() + DVec3::Z * self.top()
    }

    /// The slab before a camera.
    fn seen(&self, origin: DVec3, target: DVec3) -> Scene {
        let mut scene = scenes::one_ray(origin, target, 16);
        scene.camera.near_clip = 1e-4 * self.clearance();
        scene.camera.far_clip = 100.0 * self.half();
        let medium = scene.add_medium(scenes::gray(1.0 / self.scale, self.albedo, self.g));
        let size = v(self.half(), self.half(), self.top());
        let mut slab = Shape::boundary("slab", scenes::cuboid(DMat4::from_scale(size)), medium);
        if self.n != 1.0 {
            slab.bsdf = Bsdf::Dielectric {
                int_ior: self.n,
                ext_ior: 1.0,
                specular_reflectance: DVec3::ONE.into(),
                specular_transmittance: DVec3::ONE.into(),
            };
        }
        scene.shapes.push(slab);
        scene
    }

    /// The slab seen at a cosine to its normal.
    pub fn at_cosine(&self, mu: f64) -> Scene {
        let sin = (1.0 - mu * mu).max(0.0).sqrt();
        self.seen_along(v(sin * 0.8, sin * 0.6, mu))
    }

    /// The slab seen from above by light that leaves it along a unit vector.
    pub fn seen_along(&self, back: DVec3) -> Scene {
        self.seen(self.target() + back * self.clearance(), self.target())
    }

    /// The mean over all directions, weighted with their cosine: a tiny white sheet above the slab, seen from below.
    pub fn mean_of_directions(&self) -> Scene {
        let height = self.clearance();
        let side = 4e-6 * self.half();
        let corner = self.target() + v(-0.4 * side, -0.6 * side, height);
        let middle = self.target() + DVec3::Z * (0.5 * height);
        let mut scene = self.seen(middle, middle + DVec3::Z * height);
        let white = scenes::quad(corner, DVec3::Y * side, DVec3::X * side);
        let bsdf = Bsdf::Diffuse { reflectance: DVec3::ONE.into(), two_sided: false };
        scene.shapes.push(Shape { bsdf, ..Shape::diffuse("white", white, DVec3::ONE) });
        scene
    }

    /// Light from above alone.
    pub fn lit_from_above(&self, scene: Scene) -> Scene {
        self.half_lit(scene, -self.top() - self.clearance())
    }

    /// Light from below alone.
    pub fn lit_from_below(&self, scene: Scene) -> Scene {
        self.half_lit(scene, self.top() + 2.0 * self.clearance())
    }

    fn half_lit(&self, mut scene: Scene, height: f64) -> Scene {
        let half = self.half();
        let sheet = scenes::quad(v(-half, -half, height), DVec3::X * 2.0 * half, DVec3::Y * 2.0 * half);
        scene.shapes.push(Shape::diffuse("sheet", sheet, DVec3::ZERO));
        scene.lights.push(Light::Constant { radiance: DVec3::ONE });
        scene
    }
}

/// Both outputs of a row for a way to look at the slab.
fn both(row: &Row, slab: Slab, names: [&str; 2], view: impl Fn() -> Scene) -> [Case; 2] {
    [slab.lit_from_above(view()), slab.lit_from_below(view())]
        .into_iter()
        .zip(names)
        .map(|(scene, name)| {
            let (expected, error) = row.value(name);
            Case::new(format!("{} {name}", row.id), scene, (expected, error), tolerance(expected))
        })
        .collect::<Vec<_>>()
        .try_into()
        .unwrap_or_else(|_| unreachable!("there are two"))
}

/// All outputs of the rows. In a run that leaves something out only of every `step`-th row, without slabs in which paths are long; diffuse
/// light, in which estimates are noisy, is then left to every third row of the thinner ones.
fn totals(table: &str, step: usize) -> Vec<Case> {
    let mut cases = Vec::new();
    let thick = |row: &Row| row.number("tau") >= 5.0;
    let long = |row: &Row| thick(row) && row.number("albedo") > 0.95;
    let tested = rows(table).into_iter().step_by(if whole() { 1 } else { step }).filter(|row| whole() || !long(row));
    for (index, row) in tested.enumerate() {
        let slab = Slab::of(&row);
        cases.extend(both(&row, slab, ["R_coll", "T_coll"], || slab.at_cosine(1.0)));
        if whole() || (index % 3 == 0 && !thick(&row)) {
            cases.extend(both(&row, slab, ["R_diff", "T_diff"], || slab.mean_of_directions()));
        }
    }
    cases
}

#[test]
fn slabs_without_surfaces() {
    judge("A", &totals("A", 2), CASES);
}

#[test]
fn slabs_of_glass() {
    judge("B", &totals("B", 1), CASES);
}

/// In a run that leaves something out, what comes back is looked at from the side and what gets through from above.
#[test]
fn slabs_seen_at_an_angle() {
    let mut cases = Vec::new();
    for row in rows("A2") {
        let slab = Slab::of(&row);
        for (index, mu) in cosines_of_check() {
            let seen = slab.at_cosine(mu);
            let both = [("R_mu", slab.lit_from_above(seen.clone())), ("T_mu", slab.lit_from_below(seen))];
            for (name, scene) in both.into_iter().filter(|(name, _)| whole() || (mu < 0.5) == (*name == "R_mu")) {
                let (values, error) = row.output(name);
                let tolerance = tolerance(values[index]);
                cases.push(Case::new(format!("{} {name} {mu}", row.id), scene, (values[index], error), tolerance));
            }
        }
    }
    judge("A2", &cases, CASES);
}

#[test]
fn wrong_slabs_are_rejected() {
    let mut cases = Vec::new();
    for (table, id) in [("A", "A:2:0.9:0.5"), ("B", "B:0.1:0.9:0.75:1.33")] {
        let row = rows(table).into_iter().find(|row| row.id == id).expect("a core row");
        let slab = Slab::of(&row);
        let wrong =
            [Slab { g: -slab.g, ..slab }, Slab { albedo: slab.albedo * 0.9, ..slab }, Slab { n: slab.n + 0.1, ..slab }];
        for (index, slab) in wrong.into_iter().enumerate() {
            let [mut first, _] = both(&row, slab, ["R_coll", "T_coll"], || slab.at_cosine(1.0));
            first.name += &format!(" wrong {index}");
            cases.push(first);
        }
    }
    must_reject(&cases);
}
