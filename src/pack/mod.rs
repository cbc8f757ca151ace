//! From the description of a scene to flat tables, the form that the GPU and the CPU reference both read.

use crate::scene::{self, AovKind, Geometry, Lens, MediumId, Scene, Shape};
use glam::{DMat3, DVec3, Vec3};

pub mod bvh;
pub mod emission;
pub mod features;
pub mod filter;
mod flight;
pub mod frame;
pub mod grid;
pub mod groups;
pub mod immediate;
pub mod layout;
pub mod lights;
pub mod material;
pub mod nesting;
pub mod phase;
mod principled;
pub mod sealed;
pub mod sky;
pub mod slide;
pub mod sobol;
mod support;
pub mod texture;

use bvh::Bvh;
use features::Features;
use frame::Frame;
use grid::GridTable;
use layout::*;
use lights::LightTable;
use nesting::Nesting;
use texture::TextureTable;

/// A scene as tables.
#[derive(Clone, Debug)]
pub struct Packed {
    /// From world space to the coordinates of all tables.
    pub frame: Frame,
    /// The hierarchy over `primitives`.
    pub bvh: Bvh,
    /// Triangles and spheres: first those that are part of the kernel, then those of the hierarchy, in the order of its leaves.
    pub primitives: Vec<Primitive>,
    /// How many primitives are part of the kernel.
    pub immediate_count: usize,
    /// One for each shape, and behind them those that may be in the place of one of these.
    pub surfaces: Vec<Surface>,
    /// Media; entry 0 is vacuum, entry `k` is `MediumId(k − 1)`.
    pub media: Vec<Medium>,
    /// Lights that can be sampled.
    pub lights: Vec<Light>,
    /// Components of mixtures of phase functions.
    pub phases: Vec<layout::Phase>,
    /// One for each primitive, or none at all where no shape needs them.
    pub corners: Vec<Corners>,
    /// Images and patterns.
    pub textures: Vec<Texture>,
    /// Fields in space: three for each medium that has any.
    pub grids: Vec<Grid>,
    /// Numbers of any length that the other tables refer to: pixels, tabulated functions, distributions.
    pub values: Vec<f32>,
    /// The rest.
    pub params: Params,
    /// What the kernel must be able to do.
    pub features: Features,
    /// What is doubtful about the scene, for people.
    pub warnings: Vec<String>,
}

/// A scene that has no tables.
#[derive(Debug, thiserror::Error, PartialEq)]
pub enum PackError {
    /// More primitives than a node's link can count.
    #[error("{0} triangles and spheres are more than the {max} that a scene can hold", max = bvh::MAX_PRIMITIVES)]
    TooManyPrimitives(usize),
    /// More media than a surface can name.
    #[error("{0} media are more than the {max} that a scene can hold", max = MAX_MEDIA)]
    TooManyMedia(usize),
    /// More components than one mixture of phase functions can name.
    #[error(
        "the phase function of \"{name}\" blends {count} different ones, more than the {max} that a medium can have",
        max = phase::MAX_COMPONENTS
    )]
    TooManyPhases {
        /// Of which medium.
        name: String,
        /// Different components.
        count: usize,
    },
    /// A medium without bounds that emits more than it takes away.
    #[error("\"{0}\" fills all space and emits light that it does not absorb: its radiance is infinite")]
    EndlessEmission(String),
    /// A value that single precision cannot hold in the canonical frame.
    #[error("{what} of \"{name}\" is {value:e} per canonical unit, which single precision cannot hold")]
    OutOfRange {
        /// Which quantity.
        what: &'static str,
        /// Whose.
        name: String,
        /// Its value.
        value: f64,
    },
    /// More textures than a surface can name.
    #[error("{0} textures are more than the {max} that a scene can hold", max = texture::MAX_TEXTURES)]
    TooManyTextures(usize),
    /// A surface that depends on the place, but does not say where its places are.
    #[error("\"{name}\" has {why}, but no texture coordinates")]
    MissingUvs {
        /// What needs them.
        why: &'static str,
        /// Of which shape.
        name: String,
    },
    /// More pixels and other numbers than 32 bits can count.
    #[error("pixels and tables of {0} numbers are more than the {max} that a scene can hold", max = u32::MAX)]
    TooManyValues(usize),
    /// An environment map that single precision cannot hold.
    #[error("the largest radiance of \"{name}\" is {value:e}, more than single precision can hold")]
    TooBright {
        /// Which emitter.
        name: String,
        /// The largest value, times the scale.
        value: f64,
    },
    /// A camera whose rays do not all begin in the same medium.
    #[error(
        "the boundary \"{0}\" cuts through where the rays of the camera begin, so that they would begin in different media; \
         move the camera, or its near_clip, to one side of it"
    )]
    StraddlingCamera(String),
    /// Part of a scene that kernels cannot render yet.
    #[error("{what} of \"{name}\" cannot be rendered yet")]
    Unsupported {
        /// What it is.
        what: &'static str,
        /// Of which shape, medium or emitter.
        name: String,
    },
}

/// Media that 16 bits can name, vacuum apart.
const MAX_MEDIA: usize = 65535;

impl Packed {
    /// Makes the tables.
    pub fn new(scene: &Scene, seed: u32) -> Result<Packed, PackError> {
        support::check(scene)?;
        let frame = Frame::of(scene);
        let nesting = Nesting::of(scene);
        if let Some(shape) = nesting.straddled {
            return Err(PackError::StraddlingCamera(scene.shapes[shape].name.clone()));
        }
        if scene.media.len() > MAX_MEDIA {
            return Err(PackError::TooManyMedia(scene.media.len()));
        }
        let (mut phases, mut values) = (Vec::new(), Vec::new());
        let mut grids = GridTable::default();
        let mut media = pack_media(scene, &frame, nesting.world, &mut phases, &mut grids, &mut values)?;
        let grids = grids.grids;
        let mut surfaces = Vec::with_capacity(scene.shapes.len());
        let mut primitives = Vec::new();
        let mut lights = LightTable::default();
        let mut textures = TextureTable::default();
        let mut corners = Vec::new();
        let mut others = Vec::new();
        for (index, shape) in scene.shapes.iter().enumerate() {
            let mut chain = pack_surfaces(shape, nesting.exteriors[index], &media, &frame, &mut textures, &mut values);
            // What may be in the place of a shape's surface stands behind those of all shapes.
            let links = chain.len() - 1;
            for (link, surface) in chain.iter_mut().take(links).enumerate() {
                surface.other = (scene.shapes.len() + others.len() + link) as u32 + 1;
            }
            others.extend(chain.drain(1..));
            let surface = chain[0];
            let first = primitives.len();
            let mut pictures = Pictures { textures: &mut textures, values: &mut values };
            pack_shape(shape, index as u32, &surface, &frame, &mut primitives, &mut lights, &mut pictures);
            // Of a shape that is not packed at all there is nothing to see.
            let described = scene.aovs.iter().any(|aov| matches!(aov.kind, AovKind::Uv | AovKind::PrimitiveIndex))
                && primitives.len() > first;
            if surface.flags & (SURFACE_SMOOTH | SURFACE_UVS) != 0 || described {
                corners.resize(first, Corners::default());
                corners.extend(texture::corners(shape));
                assert_eq!(corners.len(), primitives.len(), "one entry for each primitive");
            }
            surfaces.push(surface);
        }
        surfaces.append(&mut others);
        for (index, medium) in media.iter_mut().enumerate().skip(1) {
            if let Some(volume) = emission::enclosing_volume(scene, &frame, MediumId(index as u32 - 1)) {
                medium.light = lights.add_volume(volume, index as u32, medium.emission) + 1;
            }
        }
        pack_places(scene, &frame, &mut lights, &mut Pictures { textures: &mut textures, values: &mut values });
        let mut textures = textures.textures;
        if textures.len() > texture::MAX_TEXTURES {
            return Err(PackError::TooManyTextures(textures.len()));
        }
        if u32::try_from(values.len()).is_err() {
            return Err(PackError::TooManyValues(values.len()));
        }
        if primitives.len() > bvh::MAX_PRIMITIVES {
            return Err(PackError::TooManyPrimitives(primitives.len()));
        }
        let first_sky = pack_lights(scene, &frame, &mut lights, &mut textures, &mut values)?;
        if !corners.is_empty() {
            corners.resize(primitives.len(), Corners::default());
        }
        let Arranged { bvh, primitives, corners, immediate_count } = arrange(primitives, corners, immediate::MOST);
        let lights = lights.finish();
        sealed::mark(scene, &mut media);
        flight::choose_equiangular(scene, &nesting, &frame, &lights, &mut media);
        flight::choose_flight_shares(&mut media);
        let mut params = pack_camera(scene, &frame, medium_index(nesting.camera));
        filter::pack(&scene.film, &mut params, &mut values);
        params = Params {
            seed,
            grid_origin: bvh.grid_origin,
            grid_step: bvh.grid_step,
            tree_size: bvh.size,
            light_count: lights.len() as u32,
            medium_count: media.len() as u32,
            first_sky,
            world_sigma_t: media[medium_index(nesting.world) as usize].sigma_t,
            film_width: scene.film.width,
            ..params
        };
        let warnings = nesting.warnings;
        let features = EMPTY_FEATURES;
        let mut packed = Packed {
            frame,
            bvh,
            primitives,
            immediate_count,
            surfaces,
            media,
            lights,
            phases,
            corners,
            textures,
            grids,
            values,
            params,
            features,
            warnings,
        };
        packed.features = Features::of(scene, &packed);
        Ok(packed)
    }

    /// The same scene with at most `most` primitives in the kernel and all others in the hierarchy: for comparisons.
    pub fn with_immediates(self, most: usize) -> Packed {
        let Arranged { bvh, primitives, corners, immediate_count } = arrange(self.primitives, self.corners, most);
        let params =
            Params { grid_origin: bvh.grid_origin, grid_step: bvh.grid_step, tree_size: bvh.size, ..self.params };
        let tree = immediate_count < primitives.len();
        let features = Features { walk_stack: bvh.stack, tree, ..self.features };
        Packed { bvh, primitives, corners, immediate_count, params, features, ..self }
    }

    /// The primitives that are part of the kernel.
    pub fn immediates(&self) -> &[Primitive] {
        &self.primitives[..self.immediate_count]
    }

    /// Pixels of the crop window.
    pub fn pixel_count(&self) -> usize {
        self.params.crop_width as usize * self.params.crop_height as usize
    }
}

/// Primitives in their order, and what goes with them.
struct Arranged {
    bvh: Bvh,
    primitives: Vec<Primitive>,
    corners: Vec<Corners>,
    immediate_count: usize,
}

/// Puts at most `most` primitives first, for the kernel, and the others behind them in the order of a hierarchy's leaves.
fn arrange(primitives: Vec<Primitive>, corners: Vec<Corners>, most: usize) -> Arranged {
    let (mut order, immediate_count) = immediate::order(&primitives, most);
    let behind = order.split_off(immediate_count);
    let in_tree: Vec<Primitive> = behind.iter().map(|&index| primitives[index as usize]).collect();
    let (min, max) = bvh::bounds_of_all(&primitives);
    let (bvh, order_in_tree) = Bvh::with_order(&in_tree, immediate_count as u32, (max - min).max(Vec3::ZERO));
    order.extend(order_in_tree.iter().map(|&index| behind[index as usize]));
    let corners = if corners.is_empty() { corners } else { order.iter().map(|&k| corners[k as usize]).collect() };
    let primitives = order.iter().map(|&index| primitives[index as usize]).collect();
    Arranged { bvh, primitives, corners, immediate_count }
}

/// Stands in until the tables that decide are complete.
const EMPTY_FEATURES: Features = Features {
    media: false,
    chromatic: false,
    henyey_greenstein: false,
    equiangular: false,
    phases: false,
    emission: false,
    volume_lights: false,
    grids: false,
    voxels: false,
    densities: false,
    heights: false,
    fields: false,
    boundaries: false,
    spheres: false,
    area_lights: false,
    plane_lights: false,
    rectangle_lights: false,
    sphere_lights: false,
    point_lights: false,
    constant_light: false,
    spot_lights: false,
    directional_lights: false,
    envmaps: false,
    many_lights: false,
    one_sided: false,
    dielectric: false,
    conductor: false,
    plastic: false,
    rough_plastic: false,
    beckmann: false,
    principled: false,
    textures: false,
    anisotropic: false,
    shading_normals: false,
    masks: false,
    panes: false,
    tints: false,
    absorbing: false,
    attributes: false,
    slides: false,
    far_clip: false,
    blends: false,
    reliefs: false,
    lens: false,
    orthographic: false,
    filter: false,
    hide_emitters: false,
    light_sampling: false,
    mis: true,
    max_depth: 0,
    rr_depth: 0,
    pilot: false,
    sharers: 0,
    seen: false,
    sealed: false,
    guides: false,
    walk_stack: 0,
    tree: true,
};

/// Index in the packed table: 0 is vacuum.
fn medium_index(medium: Option<MediumId>) -> u32 {
    medium.map_or(0, |MediumId(index)| index + 1)
}

fn pack_media(
    scene: &Scene,
    frame: &Frame,
    world: Option<MediumId>,
    phases: &mut Vec<layout::Phase>,
    grids: &mut GridTable,
    values: &mut Vec<f32>,
) -> Result<Vec<Medium>, PackError> {
    let mut media = vec![Medium { flight_share: 1.0, ..Medium::default() }];
    for (index, medium) in scene.media.iter().enumerate() {
        let id = MediumId(index as u32);
        let sigma_t = frame.per_length(medium.sigma_t);
        if !sigma_t.is_finite() {
            let value = (medium.sigma_t / frame.scale).max_element();
            return Err(PackError::OutOfRange { what: "sigma_t", name: medium.name.clone(), value });
        }
        let (g, phase) = phase::pack(medium, phases, values)?;
        let albedo = medium.albedo.as_vec3();
        let (emission, collision_share) = emission::pack(scene, frame, id, world == Some(id))?;
        let least_sigma_t = sigma_t.min_element();
        let grids = grids.add(medium, sigma_t, frame, values)?;
        media.push(Medium {
            sigma_t,
            g,
            albedo,
            phase,
            emission,
            collision_share,
            least_sigma_t,
            grids,
            flight_share: 1.0,
            ..Medium::default()
        });
    }
    Ok(media)
}

/// A shape's surface, and those that may be in its place, of which each may be in the place of the one before it.
fn pack_surfaces(
    shape: &Shape,
    exterior: Option<MediumId>,
    media: &[Medium],
    frame: &Frame,
    textures: &mut TextureTable,
    values: &mut Vec<f32>,
) -> Vec<Surface> {
    let (inside, outside) = match shape.boundary {
        Some(boundary) => (medium_index(boundary.interior), medium_index(exterior)),
        None => (0, 0),
    };
    let mut chain = material::pack_bsdf(&shape.bsdf, textures, values);
    let smooth = matches!(&shape.geometry, Geometry::Mesh(mesh) if !mesh.normals.is_empty());
    let smooth = if smooth && !material::is_null(&shape.bsdf) { SURFACE_SMOOTH } else { 0 };
    let looked_up = shape.bsdf.textures().iter().any(|texture| texture.constant().is_none());
    let uvs = if looked_up || shape.bsdf.needs_uvs().is_some() { SURFACE_UVS } else { 0 };
    for surface in &mut chain {
        surface.flags |= smooth | uvs;
        surface.sigma_t_step = media[inside as usize].sigma_t - media[outside as usize].sigma_t;
        surface.media = inside | outside << 16;
        surface.relief_scale *= frame.scale as f32;
    }
    chain
}

/// Appends a shape's primitives, and its lights if it emits.
fn pack_shape(
    shape: &Shape,
    index: u32,
    surface: &Surface,
    frame: &Frame,
    primitives: &mut Vec<Primitive>,
    lights: &mut LightTable,
    pictures: &mut Pictures,
) {
    let crossed = material::is_null(&shape.bsdf);
    if crossed && shape.boundary.is_none() && shape.emission.is_none() {
        return; // Neither seen nor felt.
    }
    let flags = if crossed && shape.emission.is_none() { PRIMITIVE_BOUNDARY } else { 0 };
    let emission = shape.emission.filter(|radiance| *radiance != DVec3::ZERO);
    match &shape.geometry {
        Geometry::Mesh(mesh) => {
            let corners: Vec<[Vec3; 3]> = mesh
                .triangles
                .iter()
                .map(|triangle| triangle.map(|corner| frame.point(mesh.positions[corner as usize])))
                .collect();
            let picture = shape.emission_texture.as_ref().filter(|_| !mesh.uvs.is_empty());
            let alike = |k: usize| picture.is_none() || slide::continues(mesh, k);
            let light_of = emission.map(|radiance| lights.add_triangles(&corners, radiance, alike));
            if let (Some(picture), Some(light_of)) = (picture, &light_of) {
                for (k, &light) in light_of.iter().enumerate() {
                    if k == 0 || light_of[k - 1] != light {
                        let placed = slide::on_plane(picture, mesh, k, frame, lights.get(light));
                        let (mean, texture) = pictures.textures.add_painted(&placed, pictures.values);
                        lights.paint(light, texture, f64::from(mean.element_sum()) / 3.0);
                    }
                }
            }
            primitives.extend(corners.iter().enumerate().map(|(k, &[a, b, c])| Primitive {
                a,
                surface: index | flags,
                b,
                light: light_of.as_ref().map_or(0, |lights| lights[k] + 1),
                c,
                sigma_t_step: surface.sigma_t_step.x,
            }));
        }
        Geometry::Sphere { center, radius, flipped } => {
            let (a, radius) = (frame.point(*center), frame.length(*radius));
            let side = if *flipped { -1.0 } else { 1.0 };
            let light = emission.map_or(0, |radiance| lights.add_sphere(a, radius, side, radiance) + 1);
            primitives.push(Primitive {
                a,
                surface: index | flags | PRIMITIVE_SPHERE,
                b: Vec3::new(radius, side, 0.0),
                light,
                c: Vec3::ZERO,
                sigma_t_step: surface.sigma_t_step.x,
            });
        }
    }
}

/// Where textures and their pixels go.
struct Pictures<'a> {
    textures: &'a mut TextureTable,
    values: &'a mut Vec<f32>,
}

/// Adds the lights that shine from one place or direction.
fn pack_places(scene: &Scene, frame: &Frame, lights: &mut LightTable, pictures: &mut Pictures) {
    // A light that is black has nothing to be found, and would be chosen in vain.
    for light in scene.lights.iter().filter(|light| light.shines()) {
        let index = lights.add_place(light, frame);
        if let (Some(index), scene::Light::Spot { cutoff_angle, slide: Some(slide), .. }) = (index, light) {
            let placed = slide::before_spot(&slide.texture, cutoff_angle.to_radians());
            let (mean, texture) = pictures.textures.add_painted(&placed, pictures.values);
            lights.paint(index, texture, f64::from(mean.element_sum()) / 3.0);
        }
    }
}

/// Adds the lights of the whole sky. Returns the index of the first of them.
fn pack_lights(
    scene: &Scene,
    frame: &Frame,
    lights: &mut LightTable,
    textures: &mut Vec<Texture>,
    values: &mut Vec<f32>,
) -> Result<u32, PackError> {
    // A light that is black has nothing to be found, and would be chosen in vain.
    let shining = || scene.lights.iter().enumerate().filter(|(_, light)| light.shines());
    let first_sky = lights.len();
    let scattering = scene.media.iter().any(|medium| medium.sigma_t * medium.albedo != DVec3::ZERO);
    for (index, light) in shining() {
        match light {
            scene::Light::Constant { radiance } => lights.add_constant(*radiance, frame),
            scene::Light::Envmap { bitmap, scale, to_world } => {
                let value = sky::largest(bitmap, *scale);
                if value > f64::from(f32::MAX) {
                    return Err(PackError::TooBright { name: format!("emitter {}", index + 1), value });
                }
                let count = values.len() + sky::value_count(bitmap);
                if count > u32::MAX as usize {
                    return Err(PackError::TooManyValues(count));
                }
                let packed = sky::pack(bitmap, *scale, scattering, values);
                lights.add_envmap(packed.mean, textures.len() as u32, to_world, frame);
                textures.push(packed.texture);
            }
            _ => {}
        }
    }
    Ok(first_sky)
}

/// The camera's part of the parameters.
fn pack_camera(scene: &Scene, frame: &Frame, medium: u32) -> Params {
    let (camera, film) = (&scene.camera, &scene.film);
    let matrix = camera.to_world;
    let rotation = DMat3::from_cols(
        matrix.x_axis.truncate().normalize(),
        matrix.y_axis.truncate().normalize(),
        matrix.z_axis.truncate().normalize(),
    );
    let (half_width, half_height) = match camera.lens {
        Lens::Orthographic { half_width, half_height } => (half_width * frame.scale, half_height * frame.scale),
        _ => {
            let half_width = (camera.fov_x.to_radians() / 2.0).tan();
            (half_width, half_width * f64::from(film.height) / f64::from(film.width))
        }
    };
    let (lens_u, lens_v, inverse_focus) = match camera.lens {
        Lens::Pinhole => (DVec3::ZERO, DVec3::ZERO, 0.0),
        Lens::Thin { aperture_radius, focus_distance } => {
            let radius = aperture_radius * frame.scale;
            (rotation.x_axis * radius, rotation.y_axis * radius, 1.0 / (focus_distance * frame.scale))
        }
        Lens::Orthographic { .. } => (rotation.z_axis, DVec3::ZERO, 0.0),
    };
    let depth = if matches!(camera.lens, Lens::Orthographic { .. }) { 0.0 } else { 1.0 };
    let offset = camera.principal_point_offset;
    // Camera space has +x to the left, so the film's left edge is at +x.
    let corner = DVec3::new(half_width * (1.0 - 2.0 * offset.x), half_height * (1.0 - 2.0 * offset.y), depth);
    Params {
        camera_origin: frame.point(matrix.w_axis.truncate()),
        camera_medium: medium,
        camera_corner: (rotation * corner).as_vec3(),
        near_clip: frame.length(camera.near_clip),
        camera_right: (rotation * DVec3::new(-2.0 * half_width, 0.0, 0.0)).as_vec3(),
        far_clip: frame.length(camera.far_clip),
        camera_down: (rotation * DVec3::new(0.0, -2.0 * half_height, 0.0)).as_vec3(),
        inverse_width: (1.0 / f64::from(film.width)) as f32,
        inverse_height: (1.0 / f64::from(film.height)) as f32,
        crop_x: film.crop.x,
        crop_y: film.crop.y,
        crop_width: film.crop.width,
        crop_height: film.crop.height,
        lens_u: lens_u.as_vec3(),
        lens_v: lens_v.as_vec3(),
        inverse_focus: inverse_focus as f32,
        ..Params::default()
    }
}
