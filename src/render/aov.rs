//! What the camera sees first: channels that describe surfaces, and how opaque the scene is. A pass of its own on the CPU, with the first
//! of the very camera rays of the picture.

use super::BLOCK_SAMPLES;
use crate::pack::Packed;
use crate::pack::layout::{BSDF_DIFFUSE, BSDF_PLASTIC, BSDF_PRINCIPLED, SURFACE_KIND_SHIFT, SURFACE_SMOOTH};
use crate::reference::bindings::Tables;
use crate::reference::math::exp_minus_rgb;
use crate::reference::path::{Hit, NONE, Path, path_start};
use crate::reference::path_state::INFINITE_DISTANCE;
use crate::reference::path_surface::{Place, apply_textures, shading_normal, texture_coordinates};
use crate::reference::path_vertex::surface_point;
use crate::reference::traverse;
use crate::scene::{Aov, AovKind};
use glam::DVec3;
use rayon::prelude::*;

/// As many rays of a pixel as these channels are worth.
pub const AOV_SAMPLES: u32 = BLOCK_SAMPLES;

/// Renders channels for every pixel of the crop window: those of `aovs`, and `A` if `alpha` asks for it. Each is the mean, weighted by
/// the reconstruction filter, over the first `samples` rays of the pixel.
///
/// `A` is 1 where a ray meets a surface or the sky is seen, and else the mean over the three channels of what the media on it take away:
/// the probability with which a path meets anything at all, refraction apart.
pub fn render(packed: &Packed, aovs: &[Aov], alpha: bool, samples: u32) -> Vec<(String, Vec<f32>)> {
    let tables = Tables::new(packed);
    let mut names: Vec<String> = aovs
        .iter()
        .flat_map(|aov| aov.kind.channels().iter().map(|channel| format!("{}.{channel}", aov.name)))
        .collect();
    if alpha {
        names.push("A".to_owned());
    }
    let count = samples.max(1);
    let (width, height) = (tables.params.crop_width, tables.params.crop_height);
    let pixels: Vec<Vec<f32>> = (0..width * height)
        .into_par_iter()
        .map(|slot| {
            let (x, y) = (slot % width + tables.params.crop_x, slot / width + tables.params.crop_y);
            let mut sums = vec![0.0; names.len()];
            for sample in 0..count {
                let path = path_start(&tables, y * tables.params.film_width + x, sample);
                let mut values = first_hit(packed, &tables, path, aovs);
                if alpha {
                    values.push(opacity(&tables, path));
                }
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum += value * path.filter_weight / f64::from(count);
                }
            }
            sums.into_iter().map(|sum| sum as f32).collect()
        })
        .collect();
    names.into_iter().enumerate().map(|(k, name)| (name, pixels.iter().map(|pixel| pixel[k]).collect())).collect()
}

/// What a camera ray finds first.
fn first_hit(packed: &Packed, tables: &Tables, mut path: Path, aovs: &[Aov]) -> Vec<f64> {
    path.t_max = path.far_end;
    let hit = traverse(tables, &path);
    let Hit { primitive: index, barycentric, t, .. } = hit;
    let mut values = Vec::new();
    if index == NONE || t >= path.far_end {
        values.resize(aovs.iter().map(|aov| aov.kind.channels().len()).sum(), 0.0);
        return values;
    }
    let primitive = tables.primitive(index);
    let surface = tables.surface_of(primitive);
    let (point, normal, _) = surface_point(primitive, &path, &hit);
    let place = Place { index, point, barycentric };
    for aov in aovs {
        match aov.kind {
            AovKind::Depth => values.push((t - path.t_min) / packed.frame.scale),
            AovKind::Position => values.extend((point / packed.frame.scale + packed.frame.center).to_array()),
            AovKind::Uv => values.extend(texture_coordinates(tables, &place).to_array()),
            AovKind::GeometricNormal => values.extend(normal.to_array()),
            AovKind::ShadingNormal => {
                let smooth = surface.flags & SURFACE_SMOOTH != 0;
                values.extend(if smooth { shading_normal(tables, &place, normal) } else { normal }.to_array());
            }
            AovKind::ShapeIndex => {
                let flags = crate::pack::layout::PRIMITIVE_BOUNDARY | crate::pack::layout::PRIMITIVE_SPHERE;
                values.push(f64::from((primitive.surface & !flags) + 1));
            }
            AovKind::PrimitiveIndex => values.push(f64::from(tables.corners[index as usize].number)),
            AovKind::Albedo => {
                let mut surface = *surface;
                if surface.textures_1 != 0 {
                    apply_textures(tables, &mut surface, &place);
                }
                let kind = surface.flags >> SURFACE_KIND_SHIFT;
                let boundary = primitive.surface & crate::pack::layout::PRIMITIVE_BOUNDARY != 0;
                let diffuse = !boundary && matches!(kind, BSDF_DIFFUSE | BSDF_PLASTIC | BSDF_PRINCIPLED);
                values.extend(if diffuse { surface.reflectance } else { DVec3::ZERO }.to_array());
            }
        }
    }
    values
}

/// How much of the light from beyond the scene a camera ray loses: a shadow ray to infinitely far.
fn opacity(tables: &Tables, mut path: Path) -> f64 {
    let sky = (tables.params.first_sky as usize) < tables.lights.len();
    if sky && !tables.features.hide_emitters {
        return 1.0;
    }
    path.t_max = path.far_end.min(INFINITE_DISTANCE);
    path.shadow = true;
    // No primitive is this light.
    path.light = NONE - 1;
    path.light_medium = path.medium;
    let hit = traverse(tables, &path);
    if hit.blocked {
        return 1.0;
    }
    let transmittance = exp_minus_rgb(hit.tau_rgb.max(DVec3::ZERO)) * hit.passed;
    1.0 - transmittance.element_sum() / 3.0
}
