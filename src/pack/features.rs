//! What a scene needs of the kernel. The kernel is compiled for just that.

use super::Packed;
use super::layout::*;
use crate::scene::{Integrator, Lens, Scene, Volume};

/// Constants of the kernel, decided once for a scene. Each becomes a `const` of `features.glsl`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Features {
    /// Any medium that a ray can be in.
    pub media: bool,
    /// A medium whose extinction differs between the channels.
    pub chromatic: bool,
    /// A phase function with g ≠ 0.
    pub henyey_greenstein: bool,
    /// A medium in which distances are also sampled by the angle under which a light sees them.
    pub equiangular: bool,
    /// A medium with a mixture of phase functions.
    pub phases: bool,
    /// A medium that emits.
    pub emission: bool,
    /// A medium that emits and is sampled as a light.
    pub volume_lights: bool,
    /// A medium whose coefficients depend on the place; shadow rays then go from boundary to boundary in order.
    pub grids: bool,
    /// A medium of voxels through which light is tracked.
    pub voxels: bool,
    /// A medium with a density whose optical depths are known.
    pub densities: bool,
    /// One that falls with height.
    pub heights: bool,
    /// One of voxels.
    pub fields: bool,
    /// A surface that rays cross without an event.
    pub boundaries: bool,
    /// Spheres among the primitives.
    pub spheres: bool,
    /// A triangle, parallelogram or sphere that emits.
    pub area_lights: bool,
    /// A triangle or parallelogram that emits.
    pub plane_lights: bool,
    /// A rectangle that emits.
    pub rectangle_lights: bool,
    /// A sphere that emits.
    pub sphere_lights: bool,
    /// A point that emits.
    pub point_lights: bool,
    /// The same radiance from infinitely far, in all directions.
    pub constant_light: bool,
    /// A point that shines into a cone.
    pub spot_lights: bool,
    /// Parallel light.
    pub directional_lights: bool,
    /// Radiance from infinitely far, from an image.
    pub envmaps: bool,
    /// More than one light to choose from.
    pub many_lights: bool,
    /// A surface whose back is black.
    pub one_sided: bool,
    /// Glass, smooth or rough, or another surface that refracts.
    pub dielectric: bool,
    /// Metal, smooth or rough.
    pub conductor: bool,
    /// A diffuse body under a varnish.
    pub plastic: bool,
    /// A diffuse body under a rough varnish.
    pub rough_plastic: bool,
    /// Microfacets of Beckmann's distribution.
    pub beckmann: bool,
    /// The principled BSDF.
    pub principled: bool,
    /// Colours or an opacity that depend on the place.
    pub textures: bool,
    /// Roughness that depends on the direction.
    pub anisotropic: bool,
    /// Normals that are interpolated between the corners of triangles.
    pub shading_normals: bool,
    /// Surfaces with holes.
    pub masks: bool,
    /// Thin panes, which light passes as it passes holes.
    pub panes: bool,
    /// Thin panes of a colour; they count among chromatic media.
    pub tints: bool,
    /// Media in which flights end less often than light is lost, or never.
    pub absorbing: bool,
    /// Colours that depend on the triangle and the place on it.
    pub attributes: bool,
    /// Surfaces that only the far clip plane hides.
    pub far_clip: bool,
    /// Surfaces with more than one BSDF.
    pub blends: bool,
    /// Lights with a texture in front of them.
    pub slides: bool,
    /// Maps of normals or heights.
    pub reliefs: bool,
    /// A camera with a thin lens.
    pub lens: bool,
    /// A camera whose rays are parallel.
    pub orthographic: bool,
    /// A reconstruction filter other than a box of one pixel.
    pub filter: bool,
    /// Emitters are not seen by the camera directly.
    pub hide_emitters: bool,
    /// Light is sampled at the vertices of paths.
    pub light_sampling: bool,
    /// Light that scattering finds by chance and light that is sampled are combined by multiple importance sampling. Without,
    /// light sampling finds all that it can find: for comparisons.
    pub mis: bool,
    /// Longest path; `u32::MAX` is no limit.
    pub max_depth: u32,
    /// Depth from which Russian roulette may end a path.
    pub rr_depth: u32,
    /// Roulette by what a pilot run expects.
    pub pilot: bool,
    /// A medium that no shadow ray leaves.
    pub sealed: bool,
    /// Probes bring light into it.
    pub guides: bool,
    /// Pixels that share their paths: 4 or 8, or 0 where each pixel has only its own.
    pub sharers: u32,
    /// The light of lamps that the camera sees is found apart, for some pixels ([`crate::seen`]).
    pub seen: bool,
    /// Entries on the stack of walks through the tree.
    pub walk_stack: u32,
    /// Primitives in the tree; without, all stand in the kernel.
    pub tree: bool,
}

impl Features {
    /// What the scene and its tables need.
    pub fn of(scene: &Scene, packed: &Packed) -> Features {
        let Integrator { max_depth, rr_depth, hide_emitters } = scene.integrator;
        let emission = packed.media.iter().any(|medium| medium.emission != glam::Vec3::ZERO);
        let tints = packed.surfaces.iter().any(|surface| {
            let colored = surface.transmittance != glam::Vec3::splat(surface.transmittance.x);
            surface.flags & SURFACE_PANE != 0 && (colored || surface.textures_2 & 0xffff != 0)
        });
        let media = tints || emission || packed.media.iter().any(|medium| medium.sigma_t.max_element() > 0.0);
        let lowest = (1 << LIGHT_TEXTURE_SHIFT) - 1;
        let kind = |kind: u32| packed.lights.iter().any(|light| light.kind & lowest == kind);
        let bsdf = |kind: u32| packed.surfaces.iter().any(|surface| surface.flags >> SURFACE_KIND_SHIFT == kind);
        let density = |is: &dyn Fn(&Grid) -> bool| {
            let dense = packed.media.iter().filter(|medium| medium.grids & MEDIUM_DENSITY != 0);
            media && dense.map(|medium| &packed.grids[(medium.grids & 0xff_ffff) as usize - 1]).any(is)
        };
        let flag = |bit: u32| packed.surfaces.iter().any(|surface| surface.flags & bit != 0);
        let area_lights = kind(LIGHT_TRIANGLE) || kind(LIGHT_QUAD) || kind(LIGHT_RECTANGLE) || kind(LIGHT_SPHERE);
        let max_depth = max_depth.unwrap_or(u32::MAX);
        Features {
            media,
            chromatic: tints
                || packed.media.iter().any(|medium| medium.sigma_t != glam::Vec3::splat(medium.sigma_t.x))
                || scene.media.iter().any(|medium| match &medium.volumes.sigma_t {
                    Some(Volume::Grid(field)) => field.grid.channels() == 3,
                    _ => false,
                }),
            henyey_greenstein: packed.media.iter().any(|medium| medium.g != 0.0),
            equiangular: packed.media.iter().any(|medium| medium.equiangular > 0.0),
            phases: packed.media.iter().any(|medium| medium.phase != 0),
            emission,
            volume_lights: kind(LIGHT_VOLUME),
            grids: media && packed.media.iter().any(|medium| medium.grids & !MEDIUM_SEALED != 0),
            voxels: media && packed.media.iter().any(|medium| medium.grids & MEDIUM_VOXELS != 0),
            densities: density(&|_| true),
            heights: density(&|grid| grid.size_x == 0),
            fields: density(&|grid| grid.size_x > 0),
            boundaries: packed.primitives.iter().any(|primitive| primitive.surface & PRIMITIVE_BOUNDARY != 0),
            spheres: packed.primitives.iter().any(|primitive| primitive.surface & PRIMITIVE_SPHERE != 0),
            area_lights,
            plane_lights: kind(LIGHT_TRIANGLE) || kind(LIGHT_QUAD),
            rectangle_lights: kind(LIGHT_RECTANGLE),
            sphere_lights: kind(LIGHT_SPHERE),
            point_lights: kind(LIGHT_POINT),
            constant_light: kind(LIGHT_CONSTANT),
            spot_lights: kind(LIGHT_SPOT),
            directional_lights: kind(LIGHT_DIRECTIONAL),
            envmaps: kind(LIGHT_ENVMAP),
            many_lights: packed.lights.len() > 1,
            one_sided: packed.surfaces.iter().any(|surface| surface.flags & SURFACE_TWO_SIDED == 0),
            dielectric: bsdf(BSDF_DIELECTRIC) || flag(SURFACE_ORIENTED),
            conductor: bsdf(BSDF_CONDUCTOR),
            plastic: bsdf(BSDF_PLASTIC),
            rough_plastic: packed.surfaces.iter().any(|surface| surface.value_count != 0),
            beckmann: packed.surfaces.iter().any(|surface| {
                let facets = [BSDF_CONDUCTOR, BSDF_DIELECTRIC, BSDF_PLASTIC];
                facets.contains(&(surface.flags >> SURFACE_KIND_SHIFT))
                    && surface.alpha > 0.0
                    && surface.flags & SURFACE_GGX == 0
            }),
            principled: bsdf(BSDF_PRINCIPLED),
            textures: packed.surfaces.iter().any(|surface| {
                surface.textures_1 | surface.textures_2 | surface.share_texture | surface.relief_texture != 0
            }),
            anisotropic: packed.surfaces.iter().any(|surface| surface.alpha != surface.alpha_v),
            shading_normals: flag(SURFACE_SMOOTH),
            // Boundaries of media let everything pass; they are no masks.
            masks: packed.primitives.iter().any(|primitive| {
                let index = primitive.surface & !(PRIMITIVE_BOUNDARY | PRIMITIVE_SPHERE);
                primitive.surface & PRIMITIVE_BOUNDARY == 0 && packed.surfaces[index as usize].flags & SURFACE_MASK != 0
            }),
            panes: flag(SURFACE_PANE),
            tints,
            absorbing: packed.media.iter().any(|medium| medium.flight_share < 1.0),
            attributes: packed
                .textures
                .iter()
                .any(|texture| texture.flags & TEXTURE_ATTRIBUTE != 0 && texture.kind == TEXTURE_BITMAP),
            slides: packed.lights.iter().any(|light| light.texture != 0),
            far_clip: {
                let eye = packed.params.camera_origin;
                packed.params.far_clip < (eye.length() + packed.frame.radius as f32) * 1.01
            },
            blends: packed.surfaces.iter().any(|surface| surface.other != 0),
            reliefs: packed.surfaces.iter().any(|surface| surface.relief_texture != 0),
            lens: matches!(scene.camera.lens, Lens::Thin { .. }),
            orthographic: matches!(scene.camera.lens, Lens::Orthographic { .. }),
            filter: packed.params.filter_cells != 0,
            hide_emitters,
            // Where the only light is a constant sky and nothing absorbs on the way, scattered rays find it just as well.
            light_sampling: max_depth > 1
                && (packed.lights.iter().any(|light| light.kind != LIGHT_CONSTANT) || (kind(LIGHT_CONSTANT) && media)),
            mis: true,
            max_depth,
            rr_depth,
            pilot: false,
            sharers: 0,
            seen: false,
            guides: false,
            sealed: packed.media.iter().any(|medium| medium.grids & MEDIUM_SEALED != 0),
            walk_stack: packed.bvh.stack,
            tree: packed.immediate_count < packed.primitives.len(),
        }
    }

    /// The same kernel with everything compiled in, but for principled surfaces: it must render the same image.
    pub fn everything(self) -> Features {
        Features {
            media: true,
            chromatic: true,
            henyey_greenstein: true,
            equiangular: true,
            phases: true,
            emission: true,
            volume_lights: true,
            grids: true,
            voxels: true,
            densities: true,
            heights: true,
            fields: true,
            boundaries: true,
            spheres: true,
            area_lights: true,
            plane_lights: true,
            rectangle_lights: true,
            sphere_lights: true,
            point_lights: true,
            constant_light: true,
            spot_lights: true,
            directional_lights: true,
            envmaps: true,
            many_lights: true,
            one_sided: true,
            dielectric: true,
            conductor: true,
            plastic: true,
            rough_plastic: true,
            beckmann: true,
            // So much code that drivers take many times as long for it.
            principled: self.principled,
            textures: true,
            anisotropic: true,
            shading_normals: true,
            masks: true,
            panes: true,
            tints: true,
            absorbing: true,
            attributes: true,
            slides: true,
            far_clip: true,
            tree: true,
            sealed: true,
            blends: true,
            reliefs: true,
            lens: true,
            filter: true,
            ..self
        }
    }

    /// Whether a surface sends more light to some sides than to others.
    pub fn lobes(&self) -> bool {
        self.dielectric || self.conductor || self.plastic || self.principled
    }

    /// The text of `features.glsl`.
    pub fn glsl(&self) -> String {
        let switches = [
            ("HAS_MEDIA", self.media),
            ("HAS_CHROMATIC", self.chromatic),
            ("HAS_HENYEY_GREENSTEIN", self.henyey_greenstein),
            ("HAS_EQUIANGULAR", self.equiangular),
            ("HAS_PHASES", self.phases),
            ("HAS_EMISSION", self.emission),
            ("HAS_VOLUME_LIGHTS", self.volume_lights),
            ("HAS_GRIDS", self.grids),
            ("HAS_VOXELS", self.voxels),
            ("HAS_DENSITIES", self.densities),
            ("HAS_HEIGHTS", self.heights),
            ("HAS_FIELDS", self.fields),
            ("HAS_BOUNDARIES", self.boundaries),
            ("HAS_SPHERES", self.spheres),
            ("HAS_AREA_LIGHTS", self.area_lights),
            ("HAS_PLANE_LIGHTS", self.plane_lights),
            ("HAS_RECTANGLE_LIGHTS", self.rectangle_lights),
            ("HAS_SPHERE_LIGHTS", self.sphere_lights),
            ("HAS_POINT_LIGHTS", self.point_lights),
            ("HAS_CONSTANT_LIGHT", self.constant_light),
            ("HAS_SPOT_LIGHTS", self.spot_lights),
            ("HAS_DIRECTIONAL_LIGHTS", self.directional_lights),
            ("HAS_ENVMAPS", self.envmaps),
            ("HAS_MANY_LIGHTS", self.many_lights),
            ("HAS_ONE_SIDED", self.one_sided),
            ("HAS_DIELECTRIC", self.dielectric),
            ("HAS_CONDUCTOR", self.conductor),
            ("HAS_PLASTIC", self.plastic),
            ("HAS_LOBES", self.lobes()),
            ("HAS_ROUGH_PLASTIC", self.rough_plastic),
            ("HAS_BECKMANN", self.beckmann),
            ("HAS_PRINCIPLED", self.principled),
            ("HAS_TEXTURES", self.textures),
            ("HAS_ANISOTROPIC", self.anisotropic),
            ("HAS_UVS", self.textures || self.anisotropic),
            ("HAS_SHADING_NORMALS", self.shading_normals),
            ("HAS_MASK", self.masks),
            ("HAS_PANES", self.panes),
            ("HAS_TINTS", self.tints),
            ("HAS_ABSORBING", self.absorbing),
            ("HAS_ATTRIBUTES", self.attributes),
            ("HAS_SLIDES", self.slides),
            ("HAS_FAR_CLIP", self.far_clip),
            ("HAS_BLENDS", self.blends),
            ("HAS_RELIEFS", self.reliefs),
            ("HAS_LENS", self.lens),
            ("HAS_ORTHOGRAPHIC", self.orthographic),
            ("HAS_FILTER", self.filter),
            ("HAS_HIDDEN_EMITTERS", self.hide_emitters),
            ("HAS_LIGHT_SAMPLING", self.light_sampling),
            ("HAS_MIS", self.mis),
            ("HAS_TREE", self.tree),
            ("HAS_PILOT", self.pilot),
            ("HAS_SEALED", self.sealed),
            ("HAS_GUIDES", self.guides),
            ("HAS_SHARING", self.sharers > 0),
            ("HAS_OPEN_FLIGHTS", self.equiangular && self.sharers > 0),
            ("HAS_SEEN", self.seen),
        ]
        .map(|(name, value)| format!("const bool {name} = {value};\n"))
        .concat();
        let numbers = [
            ("MAX_DEPTH", self.max_depth),
            ("RR_DEPTH", self.rr_depth),
            ("WALK_STACK", self.walk_stack.max(1)),
            ("SHARERS", self.sharers),
        ]
        .map(|(name, value)| format!("const uint {name} = {value}u;\n"))
        .concat();
        switches + &numbers
    }
}
