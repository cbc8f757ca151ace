//! Materials as the kernel's surfaces hold them.

use super::layout::*;
use super::texture::TextureTable;
use crate::scene::{Bsdf, Distribution, ReliefMap, Roughness, Texture};
use glam::{DVec2, DVec3, Vec3};
use std::f64::consts::PI;

/// What a BSDF of one part puts into a surface; the rest of it is left at its default. Colours that depend on the place are their mean there, by
/// which lobes are chosen, and an entry of `textures`. Tables go to the `values`.
fn pack_part(bsdf: &Bsdf, textures: &mut TextureTable, values: &mut Vec<f32>) -> Surface {
    let mut color = |texture: &Texture| textures.add(texture, values);
    match bsdf {
        Bsdf::Diffuse { reflectance, two_sided } => {
            let (reflectance, texture) = color(reflectance);
            Surface { reflectance, textures_1: texture, flags: side(*two_sided), ..Surface::default() }
        }
        Bsdf::Dielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let colors = [color(specular_reflectance), color(specular_transmittance)];
            glass(int_ior / ext_ior, colors, SURFACE_ORIENTED)
        }
        Bsdf::ThinDielectric { int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let colors = [color(specular_reflectance), color(specular_transmittance)];
            glass(int_ior / ext_ior, colors, SURFACE_ORIENTED | SURFACE_THIN)
        }
        Bsdf::RoughDielectric { roughness, int_ior, ext_ior, specular_reflectance, specular_transmittance } => {
            let colors = [color(specular_reflectance), color(specular_transmittance)];
            rough(glass(int_ior / ext_ior, colors, SURFACE_ORIENTED), roughness)
        }
        Bsdf::Conductor { eta, k, specular_reflectance, two_sided } => {
            metal(*eta, *k, color(specular_reflectance), *two_sided)
        }
        Bsdf::RoughConductor { roughness, eta, k, specular_reflectance, two_sided } => {
            rough(metal(*eta, *k, color(specular_reflectance), *two_sided), roughness)
        }
        Bsdf::Plastic { diffuse_reflectance, specular_reflectance, int_ior, ext_ior, nonlinear, two_sided } => {
            let colors = [color(diffuse_reflectance), color(specular_reflectance)];
            plastic(int_ior / ext_ior, colors, *nonlinear, *two_sided)
        }
        Bsdf::RoughPlastic {
            roughness,
            diffuse_reflectance,
            specular_reflectance,
            int_ior,
            ext_ior,
            nonlinear,
            two_sided,
        } => {
            let colors = [color(diffuse_reflectance), color(specular_reflectance)];
            let eta = int_ior / ext_ior;
            let smooth = plastic(eta, colors, *nonlinear, *two_sided);
            let coat = Coat::new(roughness, eta);
            let first_value = values.len() as u32;
            values.extend(&coat.transmittance);
            Surface {
                internal_reflectance: coat.internal_reflectance,
                first_value,
                value_count: COAT_ENTRIES as u32,
                ..rough(smooth, roughness)
            }
        }
        Bsdf::Principled { parameters, two_sided } => super::principled::pack(parameters, *two_sided, color),
        // What is left is nothing at all, or has parts that `pack_chain` puts together.
        Bsdf::Null | Bsdf::Mask { .. } | Bsdf::Blend { .. } | Bsdf::Sides { .. } | Bsdf::Relief { .. } => hole(),
    }
}

/// The surfaces of a BSDF that may have several parts: each may be in the place of the one before it. That their order can be
/// such, `support` sees to.
pub fn pack_chain(bsdf: &Bsdf, textures: &mut TextureTable, values: &mut Vec<f32>) -> Vec<Surface> {
    match bsdf {
        Bsdf::Blend { weight, first, second } => {
            let (first, second) = (pack_chain(first, textures, values), pack_chain(second, textures, values));
            let (share, share_texture) = textures.add(weight, values);
            let inverted = first.len() > 1;
            let (mut chain, behind) = if inverted { (second, first) } else { (first, second) };
            chain[0].share = if inverted { 1.0 - share.x } else { share.x };
            chain[0].share_texture = share_texture;
            chain[0].flags |= if inverted { SURFACE_INVERTED } else { 0 };
            chain.extend(behind);
            chain
        }
        Bsdf::Sides { front, back } => {
            let (front, back) = (pack_chain(front, textures, values), pack_chain(back, textures, values));
            let inverted = front.len() > 1;
            let (mut chain, behind) = if inverted { (back, front) } else { (front, back) };
            chain[0].flags |= SURFACE_SIDES | if inverted { SURFACE_INVERTED } else { 0 };
            chain.extend(behind);
            chain
        }
        Bsdf::Relief { relief, nested } => {
            let (map, scale, heights) = match &relief.map {
                ReliefMap::Normals(map) => (map, 0.0, 0),
                ReliefMap::Heights(map, scale) => (map, *scale, SURFACE_HEIGHTS),
            };
            let texture = textures.add_entry(map, values);
            let flags = heights
                | if relief.flips { SURFACE_RELIEF_FLIPS } else { 0 }
                | if relief.fades { SURFACE_RELIEF_FADES } else { 0 }
                | if relief.around_two_sides { SURFACE_RELIEF_TURNS } else { 0 };
            let mut chain = pack_chain(nested, textures, values);
            for surface in &mut chain {
                surface.flags |= flags;
                surface.relief_texture = texture;
                surface.relief_scale = scale as f32;
            }
            chain
        }
        Bsdf::Mask { opacity, nested } if !is_null(nested) => {
            let mut chain = pack_chain(nested, textures, values);
            let (opacity, texture) = textures.add(opacity, values);
            let first = &mut chain[0];
            first.flags |= if texture != 0 || opacity.x < 1.0 { SURFACE_MASK } else { 0 };
            first.opacity = opacity.x;
            first.textures_2 |= texture << 16;
            chain
        }
        _ => vec![pack_part(bsdf, textures, values)],
    }
}

/// The surfaces of a shape's BSDF, see [`pack_chain`]. Light that passes a pane goes on as if nothing had been there, as it does
/// through masks: that is no event, and shadow rays pass as well.
pub fn pack_bsdf(bsdf: &Bsdf, textures: &mut TextureTable, values: &mut Vec<f32>) -> Vec<Surface> {
    let mut chain = pack_chain(bsdf, textures, values);
    if matches!(bsdf, Bsdf::ThinDielectric { .. }) {
        chain[0].flags |= SURFACE_PANE | SURFACE_MASK;
        chain[0].opacity = chain[0].transmittance.max_element();
    }
    chain
}

/// Whether some light passes a surface without scattering.
pub fn lets_shadow_rays_through(bsdf: &Bsdf) -> bool {
    let opaque = matches!(
        bsdf,
        Bsdf::Diffuse { .. }
            | Bsdf::Dielectric { .. }
            | Bsdf::RoughDielectric { .. }
            | Bsdf::Conductor { .. }
            | Bsdf::RoughConductor { .. }
            | Bsdf::Plastic { .. }
            | Bsdf::RoughPlastic { .. }
            | Bsdf::Principled { .. }
    );
    !opaque
}

/// Whether light goes straight on, whatever the opacity.
pub fn is_null(bsdf: &Bsdf) -> bool {
    match bsdf {
        Bsdf::Null => true,
        Bsdf::Mask { nested, .. } => is_null(nested),
        _ => false,
    }
}

/// Nothing.
fn hole() -> Surface {
    Surface { flags: SURFACE_TWO_SIDED | SURFACE_MASK, opacity: 0.0, ..Surface::default() }
}

pub(super) fn side(two_sided: bool) -> u32 {
    if two_sided { SURFACE_TWO_SIDED } else { 0 }
}

/// A colour, and its texture.
pub(super) type Color = (Vec3, u32);

fn glass(eta: f64, [reflectance, transmittance]: [Color; 2], flags: u32) -> Surface {
    Surface {
        specular: reflectance.0,
        textures_1: reflectance.1 << 16,
        transmittance: transmittance.0,
        textures_2: transmittance.1,
        flags: flags | BSDF_DIELECTRIC << SURFACE_KIND_SHIFT,
        eta: eta as f32,
        ..Surface::default()
    }
}

fn metal(eta: DVec3, k: DVec3, reflectance: Color, two_sided: bool) -> Surface {
    Surface {
        specular: reflectance.0,
        textures_1: reflectance.1 << 16,
        transmittance: eta.as_vec3(),
        extinction: k.as_vec3(),
        flags: side(two_sided) | BSDF_CONDUCTOR << SURFACE_KIND_SHIFT,
        eta: 1.0,
        ..Surface::default()
    }
}

fn plastic(eta: f64, [diffuse, specular]: [Color; 2], nonlinear: bool, two_sided: bool) -> Surface {
    let nonlinear = if nonlinear { SURFACE_NONLINEAR } else { 0 };
    let total = specular.0.element_sum() + diffuse.0.element_sum();
    Surface {
        reflectance: diffuse.0,
        specular: specular.0,
        textures_1: diffuse.1 | specular.1 << 16,
        flags: side(two_sided) | nonlinear | BSDF_PLASTIC << SURFACE_KIND_SHIFT,
        eta: eta as f32,
        internal_reflectance: diffuse_fresnel(1.0 / eta) as f32,
        specular_weight: if total > 0.0 { specular.0.element_sum() / total } else { 0.0 },
        ..Surface::default()
    }
}

fn rough(smooth: Surface, roughness: &Roughness) -> Surface {
    // Facets between equal indices neither bend nor reflect, however they lie.
    if smooth.flags >> SURFACE_KIND_SHIFT == BSDF_DIELECTRIC && smooth.eta == 1.0 {
        return smooth;
    }
    let ggx = if roughness.distribution == Distribution::Ggx { SURFACE_GGX } else { 0 };
    let (alpha, alpha_v) = (roughness.alpha_u as f32, roughness.alpha_v as f32);
    Surface { flags: smooth.flags | ggx, alpha, alpha_v, ..smooth }
}

/// What the rough varnish of plastic lets through, as Mitsuba's `roughplastic` has it: light that facets reflect or refract to the
/// wrong side, or that another facet shadows, is lost.
#[derive(Clone, Debug, PartialEq)]
pub struct Coat {
    /// Fraction of light from outside that gets through, at [`COAT_ENTRIES`] cosines at equal steps from 0 to 1, between which it
    /// is interpolated.
    pub transmittance: Vec<f32>,
    /// Fraction of diffuse light from inside that is reflected back.
    pub internal_reflectance: f32,
}

/// Entries of a [`Coat`]'s table: as many as Mitsuba 3.9.1 has, so that both interpolate alike.
pub const COAT_ENTRIES: usize = 64;

impl Coat {
    /// For a relative index, the one inside over that outside. The roughness has no direction.
    pub fn new(roughness: &Roughness, eta: f64) -> Coat {
        let (mut transmittance, mut internal) = (Vec::new(), 0.0);
        for entry in 0..COAT_ENTRIES {
            // Light that grazes exactly is taken as light that nearly does.
            let cosine = (entry as f64 / (COAT_ENTRIES - 1) as f64).max(1e-6);
            let facets = VisibleFacets::new(roughness, cosine);
            transmittance.push(facets.mean(|facets, m| facets.transmitted(m, eta)) as f32);
            internal += 2.0 * cosine * facets.mean(|facets, m| facets.reflected(m, 1.0 / eta));
        }
        // 2 ∫ R(cos) cos dcos as the plain mean over the entries, with both ends, as Mitsuba 3.9.1 has it: 1.5 % below the integral, so
        // that a white body seems a little darker. The integral itself would not give the same pictures.
        Coat { transmittance, internal_reflectance: (internal / COAT_ENTRIES as f64) as f32 }
    }
}

/// The facets that a direction sees.
struct VisibleFacets {
    /// The direction, in the plane of x and z.
    w: DVec3,
    alpha: f64,
    ggx: bool,
}

impl VisibleFacets {
    fn new(roughness: &Roughness, cosine: f64) -> VisibleFacets {
        let w = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
        VisibleFacets { w, alpha: roughness.alpha_u, ggx: roughness.distribution == Distribution::Ggx }
    }

    /// Mean over the facets, each weighted by the area that w sees of it.
    fn mean(&self, value: impl Fn(&VisibleFacets, DVec3) -> f64) -> f64 {
        const STEPS: u32 = 48;
        let unit = |step: u32| (f64::from(step) + 0.5) / f64::from(STEPS);
        let (mut sum, mut weights) = (0.0, 0.0);
        for i in 0..STEPS {
            for j in 0..STEPS {
                let (m, weight) = if self.ggx { self.cap(unit(i), unit(j)) } else { self.slope(unit(i), unit(j)) };
                sum += weight * value(self, m);
                weights += weight;
            }
        }
        sum / weights
    }

    /// GGX: a visible normal by spherical caps (Dupuy and Benyoub 2023), all of the same weight.
    fn cap(&self, u: f64, v: f64) -> (DVec3, f64) {
        let w = DVec3::new(self.alpha * self.w.x, 0.0, self.w.z).normalize();
        // Substituted so that both ends of the cap, where shadowing changes fastest, are sampled densely.
        let (u, density) = (u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u));
        let d = u * (1.0 + w.z);
        let sine = (d * (2.0 - d)).max(0.0).sqrt();
        // One half suffices: the other one is its mirror image.
        let (sin_phi, cos_phi) = (PI * v).sin_cos();
        let h = DVec3::new(sine * cos_phi + w.x, sine * sin_phi, (1.0 + w.z) * (1.0 - u));
        (DVec3::new(self.alpha * h.x, self.alpha * h.y, h.z).normalize(), density)
    }

    /// Beckmann: a normal by its slopes, whose distribution is Gaussian, weighted by the area that is seen.
    fn slope(&self, u: f64, v: f64) -> (DVec3, f64) {
        const REACH: f64 = 6.0;
        // Facets with a larger slope along w are seen from behind.
        let seen = (self.w.z / (self.alpha * self.w.x).max(1e-300)).min(REACH);
        let slope = DVec2::new(seen - u * (seen + REACH), v * REACH);
        let area = self.w.z - self.alpha * self.w.x * slope.x;
        let m = DVec3::new(-self.alpha * slope.x, -self.alpha * slope.y, 1.0).normalize();
        (m, (-slope.length_squared()).exp() * area.max(0.0))
    }

    fn masking(&self, v: DVec3, m: DVec3) -> f64 {
        if v.dot(m) * v.z <= 0.0 {
            return 0.0;
        }
        let tan2 = self.alpha * self.alpha * (v.x * v.x + v.y * v.y) / (v.z * v.z);
        if self.ggx {
            return 2.0 / (1.0 + (1.0 + tan2).sqrt());
        }
        let a = 1.0 / tan2.sqrt();
        2.0 / (1.0 + libm::erf(a) + (-a * a).exp() / (a * PI.sqrt()))
    }

    /// What a facet reflects back to the side of w and no other facet shadows.
    fn reflected(&self, m: DVec3, eta: f64) -> f64 {
        let cosine = self.w.dot(m);
        let wo = 2.0 * cosine * m - self.w;
        if wo.z <= 0.0 { 0.0 } else { fresnel(cosine, eta) * self.masking(wo, m) }
    }

    /// What a facet refracts to the other side and no other facet shadows.
    fn transmitted(&self, m: DVec3, eta: f64) -> f64 {
        let cosine = self.w.dot(m);
        let f = fresnel(cosine, eta);
        if f >= 1.0 {
            return 0.0;
        }
        let cos_t = (1.0 - (1.0 - cosine * cosine) / (eta * eta)).sqrt();
        let wo = m * (cosine / eta - cos_t) - self.w / eta;
        if wo.z >= 0.0 { 0.0 } else { (1.0 - f) * self.masking(wo, m) }
    }
}

/// Fresnel reflectance for diffuse light, 2 ∫ F(cos) cos dcos, with the index `eta` of what light would enter over that of
/// where it is. Midpoint rule in √cos, in which the integrand has no steep ends; error below 1e-7.
pub fn diffuse_fresnel(eta: f64) -> f64 {
    const STEPS: u32 = 20_000;
    let sum: f64 = (0..STEPS)
        .map(|step| {
            let x = (f64::from(step) + 0.5) / f64::from(STEPS);
            let cos = x * x;
            fresnel(cos, eta) * cos * 2.0 * x
        })
        .sum();
    2.0 * sum / f64::from(STEPS)
}

fn fresnel(cos: f64, eta: f64) -> f64 {
    let sin_squared = (1.0 - cos * cos) / (eta * eta);
    if sin_squared >= 1.0 {
        return 1.0;
    }
    let t = (1.0 - sin_squared).sqrt();
    let s = (cos - eta * t) / (cos + eta * t);
    let p = (eta * cos - t) / (eta * cos + t);
    0.5 * (s * s + p * p)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn diffuse_fresnel_is_the_closed_form() {
        // From outside, Walsh (1926) as quoted by Egan and Hilgeman (1979): .0918 for 1.5. From inside, energy that goes in comes
        // out: (1 − inside) = (1 − outside) / n².
        let outside = diffuse_fresnel(1.5);
        assert!((outside - 0.0918).abs() < 5e-5, "{outside}");
        let inside = diffuse_fresnel(1.0 / 1.5);
        assert!((1.0 - inside - (1.0 - outside) / 2.25).abs() < 1e-6, "{inside}");
        assert!(diffuse_fresnel(1.0).abs() < 1e-12);
    }
}
