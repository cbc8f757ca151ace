//! Surfaces with every kind of BSDF, as the tables have them, and what their unit kernel finds.

use super::units::{run, vec4, widen};
use glam::{DVec3, Vec3};
use std::sync::OnceLock;
use tyndall::pack::layout::*;
use tyndall::pack::material::{COAT_ENTRIES, Coat};
use tyndall::scene::{Distribution, Roughness};

/// Glass of relative index 1.5 that takes nothing away.
pub fn glass(alpha: f32, ggx: bool) -> Surface {
    Surface {
        flags: BSDF_DIELECTRIC << SURFACE_KIND_SHIFT | SURFACE_ORIENTED | if ggx { SURFACE_GGX } else { 0 },
        specular: Vec3::ONE,
        transmittance: Vec3::ONE,
        eta: 1.5,
        alpha,
        alpha_v: alpha,
        ..Surface::default()
    }
}

/// Something like copper.
pub fn metal(alpha: f32, ggx: bool) -> Surface {
    Surface {
        flags: BSDF_CONDUCTOR << SURFACE_KIND_SHIFT | SURFACE_TWO_SIDED | if ggx { SURFACE_GGX } else { 0 },
        specular: Vec3::ONE,
        transmittance: Vec3::new(0.2, 0.92, 1.1),
        extinction: Vec3::new(3.9, 2.45, 2.14),
        eta: 1.0,
        alpha,
        alpha_v: alpha,
        ..Surface::default()
    }
}

/// A coloured body under a varnish of index 1.5, whose diffuse internal reflectance is 0.5963.
pub fn plastic(alpha: f32, ggx: bool) -> Surface {
    Surface {
        flags: BSDF_PLASTIC << SURFACE_KIND_SHIFT | SURFACE_TWO_SIDED | if ggx { SURFACE_GGX } else { 0 },
        reflectance: Vec3::new(0.8, 0.5, 0.2),
        specular: Vec3::ONE,
        eta: 1.5,
        alpha,
        alpha_v: alpha,
        internal_reflectance: 0.5963,
        specular_weight: 0.65,
        ..Surface::default()
    }
}

/// A principled surface: a coloured body with sheen, a clear coat, tinted reflection, some metal and clear material.
pub fn principled(roughness: f32, metallic: f32, spec_trans: f32) -> Surface {
    Surface {
        flags: BSDF_PRINCIPLED << SURFACE_KIND_SHIFT
            | if spec_trans > 0.0 { SURFACE_ORIENTED } else { SURFACE_TWO_SIDED },
        reflectance: Vec3::new(0.6, 0.4, 0.2),
        specular: Vec3::splat(roughness),
        transmittance: Vec3::new(metallic, spec_trans, 0.3),
        extinction: Vec3::new(0.2, 0.5, 0.4),
        internal_reflectance: 0.8,
        specular_weight: 0.05,
        eta: 1.5,
        alpha: 1.0,
        alpha_v: 1.0,
        ..Surface::default()
    }
}

/// The same surface with another roughness across the tangent.
pub fn brushed(surface: Surface, alpha_v: f32) -> Surface {
    Surface { alpha_v, ..surface }
}

/// Plastic whose rough varnish lets light through as Mitsuba's does; its table is among the [`values`].
pub fn rough_plastic(alpha: f32, ggx: bool) -> Surface {
    let entry = ROUGH.iter().position(|known| *known == (alpha, ggx)).expect("the values have a table for it");
    let coat = &coats()[entry];
    Surface {
        internal_reflectance: coat.internal_reflectance,
        first_value: (entry * COAT_ENTRIES) as u32,
        value_count: COAT_ENTRIES as u32,
        ..plastic(alpha, ggx)
    }
}

/// Roughness and kind of the varnishes whose tables are among the [`values`].
const ROUGH: &[(f32, bool)] = &[(0.1, false), (0.1, true), (0.2, true), (0.5, false), (0.5, true)];

fn coats() -> &'static [Coat] {
    static COATS: OnceLock<Vec<Coat>> = OnceLock::new();
    COATS.get_or_init(|| {
        let coat = |&(alpha, ggx): &(f32, bool)| {
            let distribution = if ggx { Distribution::Ggx } else { Distribution::Beckmann };
            let alpha = f64::from(alpha);
            Coat::new(&Roughness { distribution, alpha_u: alpha, alpha_v: alpha }, 1.5)
        };
        ROUGH.iter().map(coat).collect()
    })
}

/// The tables that [`rough_plastic`] refers to.
pub fn values() -> Vec<f32> {
    coats().iter().flat_map(|coat| coat.transmittance.clone()).collect()
}

/// What is asked of the kernel.
#[derive(Clone, Copy, Debug)]
pub struct Query {
    /// Index of the surface.
    pub surface: usize,
    pub wi: DVec3,
    pub wo: DVec3,
    pub u: [f64; 2],
    pub lobe: f64,
}

/// What the kernel answers.
#[derive(Clone, Copy, Debug)]
pub struct Answer {
    pub direction: [f32; 3],
    pub pdf: f32,
    pub weight: [f32; 3],
    pub eta: f32,
    pub value: [f32; 3],
    pub value_pdf: f32,
    pub fresnel: f32,
    pub cos_t: f32,
    pub conductor: [f32; 3],
}

impl Answer {
    /// The sampled direction.
    pub fn wo(&self) -> DVec3 {
        widen(&self.direction)
    }

    /// Whether nothing was sampled.
    pub fn failed(&self) -> bool {
        self.weight == [0.0; 3]
    }
}

/// Rounded to what the kernel gets.
pub fn single(vector: DVec3) -> DVec3 {
    vector.as_vec3().as_dvec3()
}

/// Runs the unit kernel.
pub fn ask(surfaces: &[Surface], queries: &[Query]) -> Vec<Answer> {
    let inputs: Vec<[f32; 4]> = queries
        .iter()
        .flat_map(|query| {
            let Query { surface, wi, wo, u, lobe } = query;
            [vec4(&[wi.x, wi.y, wi.z, *surface as f64]), vec4(&[wo.x, wo.y, wo.z, *lobe]), vec4(u)]
        })
        .collect();
    let table = bytemuck::cast_slice(surfaces);
    let outputs: Vec<[f32; 4]> =
        run("bsdf", &inputs, &[table, bytemuck::cast_slice(&values())], queries.len(), 5 * queries.len());
    // Principled surfaces have a kernel of their own.
    let mut outputs = outputs;
    let kind = |query: &Query| surfaces[query.surface].flags >> SURFACE_KIND_SHIFT;
    if queries.iter().any(|query| kind(query) == BSDF_PRINCIPLED) {
        let found: Vec<[f32; 4]> =
            run("principled", &inputs, &[table, bytemuck::cast_slice(&values())], queries.len(), 3 * queries.len());
        for (k, _) in queries.iter().enumerate().filter(|(_, query)| kind(query) == BSDF_PRINCIPLED) {
            outputs[5 * k..5 * k + 3].copy_from_slice(&found[3 * k..3 * k + 3]);
        }
    }
    let three = |vector: [f32; 4]| [vector[0], vector[1], vector[2]];
    let answer = |output: &[[f32; 4]]| Answer {
        direction: three(output[0]),
        pdf: output[0][3],
        weight: three(output[1]),
        eta: output[1][3],
        value: three(output[2]),
        value_pdf: output[2][3],
        fresnel: output[3][0],
        cos_t: output[3][1],
        conductor: three(output[4]),
    };
    outputs.chunks(5).map(answer).collect()
}

/// A facet that a query's numbers sample.
#[derive(Clone, Copy, Debug)]
pub struct Facet {
    pub normal: [f32; 3],
    pub density: f32,
    /// Of wi and wo.
    pub masking: [f32; 2],
    /// Density with which it is sampled.
    pub pdf: f32,
}

/// Runs the unit kernel of facets.
pub fn ask_facets(surfaces: &[Surface], queries: &[Query]) -> Vec<Facet> {
    let input = |query: &Query| {
        let Query { surface, wi, wo, u, .. } = query;
        let Surface { flags, alpha, alpha_v, .. } = surfaces[*surface];
        let ggx = f64::from(flags & SURFACE_GGX);
        [vec4(&[wi.x, wi.y, wi.z, alpha.into()]), vec4(&[wo.x, wo.y, wo.z, alpha_v.into()]), vec4(&[u[0], u[1], ggx])]
    };
    let inputs: Vec<[f32; 4]> = queries.iter().flat_map(input).collect();
    let outputs: Vec<[f32; 4]> = run("microfacet", &inputs, &[], queries.len(), 2 * queries.len());
    let facet = |output: &[[f32; 4]]| Facet {
        normal: [output[0][0], output[0][1], output[0][2]],
        density: output[0][3],
        masking: [output[1][0], output[1][1]],
        pdf: output[1][2],
    };
    outputs.chunks(2).map(facet).collect()
}
