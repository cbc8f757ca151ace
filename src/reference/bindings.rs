//! Mirror of `shaders/lib/bindings.glsl`: the tables of the scene, their numbers widened to double precision.

use super::grid::Grid;
use crate::pack::bvh::Node;
use crate::pack::features::Features;
use crate::pack::{Packed, layout, sobol};
use glam::{DVec2, DVec3};

/// What the kernel reads.
#[derive(Clone, Debug)]
pub struct Tables {
    /// Of the hierarchy.
    pub nodes: Vec<Node>,
    /// In the order of the hierarchy's leaves.
    pub primitives: Vec<Primitive>,
    /// How many of them stand before those of the tree.
    pub immediate_count: u32,
    /// One for each shape.
    pub surfaces: Vec<Surface>,
    /// Entry 0 is vacuum.
    pub media: Vec<Medium>,
    /// Lights that can be sampled.
    pub lights: Vec<Light>,
    /// Components of mixtures of phase functions. Their numbers are few and used as they are.
    pub phases: Vec<layout::Phase>,
    /// One for each primitive, or none at all.
    pub corners: Vec<layout::Corners>,
    /// Images and patterns.
    pub textures: Vec<Texture>,
    /// Fields in space.
    pub grids: Vec<Grid>,
    /// Pixels, tabulated functions, distributions, voxels.
    pub values: Vec<f32>,
    /// Low-discrepancy points.
    pub points: Vec<[u32; 2]>,
    /// What holds for the whole render.
    pub params: Params,
    /// Of these, the ones that decide what is rendered; the others only leave out what a scene does not need.
    pub features: Features,
}

/// See [`layout::Primitive`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Primitive {
    pub a: DVec3,
    pub surface: u32,
    pub b: DVec3,
    pub light: u32,
    pub c: DVec3,
}

/// See [`layout::Surface`].
#[derive(Clone, Copy, Debug, Default)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Surface {
    pub reflectance: DVec3,
    pub flags: u32,
    pub sigma_t_step: DVec3,
    pub media: u32,
    pub specular: DVec3,
    pub eta: f64,
    pub transmittance: DVec3,
    pub alpha: f64,
    pub extinction: DVec3,
    pub internal_reflectance: f64,
    pub specular_weight: f64,
    pub alpha_v: f64,
    pub textures_1: u32,
    pub textures_2: u32,
    pub opacity: f64,
    pub first_value: u32,
    pub value_count: u32,
    pub other: u32,
    pub share: f64,
    pub share_texture: u32,
    pub relief_texture: u32,
    pub relief_scale: f64,
}

/// See [`layout::Medium`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Medium {
    pub sigma_t: DVec3,
    pub g: f64,
    pub albedo: DVec3,
    pub phase: u32,
    pub emission: DVec3,
    pub light: u32,
    pub least_sigma_t: f64,
    pub equiangular: f64,
    pub collision_share: f64,
    pub flight_share: f64,
    pub grids: u32,
}

/// See [`layout::Texture`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Texture {
    pub row_u: DVec3,
    pub kind: u32,
    pub row_v: DVec3,
    pub flags: u32,
    pub color_0: DVec3,
    pub width: u32,
    pub color_1: DVec3,
    pub height: u32,
    pub first_value: u32,
    pub first_weight: u32,
}

/// See [`layout::Light`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Light {
    pub origin: DVec3,
    pub kind: u32,
    pub edge_1: DVec3,
    pub probability: f64,
    pub edge_2: DVec3,
    pub area: f64,
    pub radiance: DVec3,
    pub alias_threshold: f64,
    pub normal: DVec3,
    pub alias: u32,
    pub slide_y: DVec3,
    pub texture: u32,
}

/// See [`layout::Params`].
#[derive(Clone, Copy, Debug)]
#[allow(missing_docs, reason = "the members are documented in `layout`")]
pub struct Params {
    pub camera_origin: DVec3,
    pub camera_medium: u32,
    pub camera_corner: DVec3,
    pub near_clip: f64,
    pub camera_right: DVec3,
    pub far_clip: f64,
    pub camera_down: DVec3,
    pub seed: u32,
    pub grid_origin: DVec3,
    pub grid_step: DVec3,
    pub tree_size: DVec3,
    pub inverse_width: f64,
    pub inverse_height: f64,
    pub crop_x: u32,
    pub crop_y: u32,
    pub crop_width: u32,
    pub crop_height: u32,
    pub world_sigma_t: DVec3,
    pub film_width: u32,
    pub first_sky: u32,
    pub pilot_origin: DVec3,
    pub first_cell: u32,
    pub pilot_scale: DVec3,
    pub guide_origin: DVec3,
    pub first_guide: u32,
    pub guide_scale: DVec3,
    pub first_block: u32,
    /// See [`layout::Params`].
    pub first_seen: u32,
    pub block_side: u32,
    pub block_columns: u32,
    pub sample_area_begin: DVec2,
    pub sample_area_end: DVec2,
    pub first_filter_value: u32,
    pub filter_cells: u32,
    pub filter_radius: f64,
    pub inverse_focus: f64,
    pub lens_u: DVec3,
    pub lens_v: DVec3,
}

impl Tables {
    /// Widens the tables.
    pub fn new(packed: &Packed) -> Tables {
        Tables {
            nodes: packed.bvh.nodes.clone(),
            primitives: packed.primitives.iter().map(Primitive::from).collect(),
            immediate_count: packed.immediate_count as u32,
            surfaces: packed.surfaces.iter().map(Surface::from).collect(),
            media: packed.media.iter().map(Medium::from).collect(),
            lights: packed.lights.iter().map(Light::from).collect(),
            phases: packed.phases.clone(),
            corners: packed.corners.clone(),
            textures: packed.textures.iter().map(Texture::from).collect(),
            grids: packed.grids.iter().map(Grid::from).collect(),
            values: packed.values.clone(),
            points: sobol::points(),
            params: Params::from(&packed.params),
            features: packed.features,
        }
    }

    /// A primitive by its index.
    pub fn primitive(&self, index: u32) -> &Primitive {
        &self.primitives[index as usize]
    }

    /// The surface of a primitive.
    pub fn surface_of(&self, primitive: &Primitive) -> &Surface {
        let flags = layout::PRIMITIVE_BOUNDARY | layout::PRIMITIVE_SPHERE;
        &self.surfaces[(primitive.surface & !flags) as usize]
    }
}

impl From<&layout::Primitive> for Primitive {
    fn from(from: &layout::Primitive) -> Primitive {
        Primitive {
            a: from.a.as_dvec3(),
            surface: from.surface,
            b: from.b.as_dvec3(),
            light: from.light,
            c: from.c.as_dvec3(),
        }
    }
}

impl From<&layout::Surface> for Surface {
    fn from(from: &layout::Surface) -> Surface {
        Surface {
            reflectance: from.reflectance.as_dvec3(),
            flags: from.flags,
            sigma_t_step: from.sigma_t_step.as_dvec3(),
            media: from.media,
            specular: from.specular.as_dvec3(),
            eta: f64::from(from.eta),
            transmittance: from.transmittance.as_dvec3(),
            alpha: f64::from(from.alpha),
            extinction: from.extinction.as_dvec3(),
            internal_reflectance: f64::from(from.internal_reflectance),
            specular_weight: f64::from(from.specular_weight),
            alpha_v: f64::from(from.alpha_v),
            textures_1: from.textures_1,
            textures_2: from.textures_2,
            opacity: f64::from(from.opacity),
            first_value: from.first_value,
            value_count: from.value_count,
            other: from.other,
            share: f64::from(from.share),
            share_texture: from.share_texture,
            relief_texture: from.relief_texture,
            relief_scale: f64::from(from.relief_scale),
        }
    }
}

impl From<&layout::Medium> for Medium {
    fn from(from: &layout::Medium) -> Medium {
        Medium {
            sigma_t: from.sigma_t.as_dvec3(),
            g: f64::from(from.g),
            albedo: from.albedo.as_dvec3(),
            phase: from.phase,
            emission: from.emission.as_dvec3(),
            light: from.light,
            least_sigma_t: f64::from(from.least_sigma_t),
            flight_share: f64::from(from.flight_share),
            equiangular: f64::from(from.equiangular),
            collision_share: f64::from(from.collision_share),
            grids: from.grids,
        }
    }
}

impl From<&layout::Texture> for Texture {
    fn from(from: &layout::Texture) -> Texture {
        Texture {
            row_u: from.row_u.as_dvec3(),
            kind: from.kind,
            row_v: from.row_v.as_dvec3(),
            flags: from.flags,
            color_0: from.color_0.as_dvec3(),
            width: from.width,
            color_1: from.color_1.as_dvec3(),
            height: from.height,
            first_value: from.first_value,
            first_weight: from.first_weight,
        }
    }
}

impl From<&layout::Light> for Light {
    fn from(from: &layout::Light) -> Light {
        Light {
            origin: from.origin.as_dvec3(),
            kind: from.kind,
            edge_1: from.edge_1.as_dvec3(),
            probability: f64::from(from.probability),
            edge_2: from.edge_2.as_dvec3(),
            area: f64::from(from.area),
            radiance: from.radiance.as_dvec3(),
            alias_threshold: f64::from(from.alias_threshold),
            normal: from.normal.as_dvec3(),
            alias: from.alias,
            slide_y: from.slide_y.as_dvec3(),
            texture: from.texture,
        }
    }
}

impl From<&layout::Params> for Params {
    fn from(from: &layout::Params) -> Params {
        Params {
            camera_origin: from.camera_origin.as_dvec3(),
            camera_medium: from.camera_medium,
            camera_corner: from.camera_corner.as_dvec3(),
            near_clip: f64::from(from.near_clip),
            camera_right: from.camera_right.as_dvec3(),
            far_clip: f64::from(from.far_clip),
            camera_down: from.camera_down.as_dvec3(),
            seed: from.seed,
            grid_origin: from.grid_origin.as_dvec3(),
            grid_step: from.grid_step.as_dvec3(),
            tree_size: from.tree_size.as_dvec3(),
            inverse_width: f64::from(from.inverse_width),
            inverse_height: f64::from(from.inverse_height),
            crop_x: from.crop_x,
            crop_y: from.crop_y,
            crop_width: from.crop_width,
            crop_height: from.crop_height,
            world_sigma_t: from.world_sigma_t.as_dvec3(),
            film_width: from.film_width,
            first_sky: from.first_sky,
            pilot_origin: from.pilot_origin.as_dvec3(),
            first_cell: from.first_cell,
            pilot_scale: from.pilot_scale.as_dvec3(),
            guide_origin: from.guide_origin.as_dvec3(),
            first_guide: from.first_guide,
            guide_scale: from.guide_scale.as_dvec3(),
            first_block: from.first_block,
            first_seen: from.first_seen,
            block_side: from.block_side,
            block_columns: from.block_columns,
            sample_area_begin: from.sample_area_begin.as_dvec2(),
            sample_area_end: from.sample_area_end.as_dvec2(),
            first_filter_value: from.first_filter_value,
            filter_cells: from.filter_cells,
            filter_radius: f64::from(from.filter_radius),
            inverse_focus: f64::from(from.inverse_focus),
            lens_u: from.lens_u.as_dvec3(),
            lens_v: from.lens_v.as_dvec3(),
        }
    }
}
