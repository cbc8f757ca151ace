//! `<volume>`: coefficients of a medium that depend on the place.

use std::sync::Arc;

use glam::{DMat4, DVec3};

use super::build::Context;
use super::props::{Child, Given, Props, VolumeOrColor, unknown_plugin};
use super::source;
use super::texture::choice;
use crate::scene::{
    Filter, Geometry, Grid, GridFile, GridVolume, HeightVolume, Medium, SceneError, Shape, Volume, Wrap,
};

pub(super) const TYPES: [&str; 3] = ["constvolume", "gridvolume", "heightvolume"];

/// A coefficient: a constant, times a field in space if there is one.
pub(super) struct Coefficient {
    pub factor: DVec3,
    pub field: Option<Volume>,
}

/// What stands for a coefficient.
pub(super) fn coefficient<'a>(
    context: &mut Context<'a>,
    given: Option<VolumeOrColor<'a>>,
    name: &str,
    default: DVec3,
) -> Result<Coefficient, SceneError> {
    let constant = |given: Given<DVec3>| {
        if given.value.min_element() < 0.0 {
            return Err(given.at.error(format!("{name} is {}; it must not be negative", given.value)));
        }
        Ok(Coefficient { factor: given.value, field: None })
    };
    match given {
        None => Ok(Coefficient { factor: default, field: None }),
        Some(VolumeOrColor::Constant(given)) => constant(given),
        Some(VolumeOrColor::Volume(child)) => match child.object.plugin.as_str() {
            "constvolume" => {
                let props = context.props(child);
                let value = if name == "emission" { props.emission("value")? } else { props.color("value")? };
                let placed = placed(&props)?;
                props.finish()?;
                let coefficient = value.map_or(Ok(Coefficient { factor: DVec3::ONE, field: None }), constant)?;
                // Mitsuba's heterogeneous media end where the box of their sigma_t ends, be it that of a constant. Of the other
                // coefficients only the value counts.
                if name != "sigma_t" {
                    return Ok(coefficient);
                }
                if placed.is_none() {
                    context.warnings.push(child.object.at.warning(
                        "the medium fills the unit cube [0, 1]³ alone, as in Mitsuba, since its sigma_t has no to_world to make \
                         it larger",
                    ));
                }
                let voxel = Grid::new([1; 3], 1, vec![1.0]).expect("one finite voxel is a grid");
                let to_world = placed.unwrap_or(DMat4::IDENTITY);
                let (filter, wrap) = (Filter::Nearest, Wrap::Clamp);
                let field = GridVolume { grid: Arc::new(voxel), to_world, filter, wrap };
                Ok(Coefficient { field: Some(Volume::Grid(field)), ..coefficient })
            }
            "gridvolume" => Ok(Coefficient { factor: DVec3::ONE, field: Some(Volume::Grid(grid(context, child)?)) }),
            "heightvolume" => height(context, child, name),
            _ => Err(unknown_plugin(child.object, &TYPES)),
        },
    }
}

/// Makes a medium homogeneous if its `sigma_t` is one voxel, in whose box lies all that the medium fills.
pub(super) fn simplify(medium: &mut Medium, shapes: &[&Shape]) {
    // Rounding must not leave a face outside that was meant to be on the box.
    const SLACK: f64 = 1e-6;
    let Some(Volume::Grid(GridVolume { grid, to_world, .. })) = &medium.volumes.sigma_t else { return };
    if shapes.is_empty() || grid.resolution() != [1; 3] {
        return;
    }
    let to_box = to_world.inverse();
    let inside = |point: DVec3, reach: DVec3| {
        let place = to_box.transform_point3(point);
        (place - reach).min_element() >= -SLACK && (place + reach).max_element() <= 1.0 + SLACK
    };
    let filled = shapes.iter().all(|shape| match &shape.geometry {
        Geometry::Mesh(mesh) => {
            mesh.triangles.iter().flatten().all(|corner| inside(mesh.positions[*corner as usize], DVec3::ZERO))
        }
        Geometry::Sphere { center, radius, .. } => {
            let reach = [0, 1, 2].map(|row| to_box.row(row).truncate().length() * radius);
            inside(*center, DVec3::from(reach))
        }
    });
    if filled {
        medium.sigma_t *= DVec3::from(grid.voxel(0, 0, 0).map(f64::from));
        medium.volumes.sigma_t = None;
    }
}

/// Where the unit cube is.
fn placed(props: &Props) -> Result<Option<DMat4>, SceneError> {
    match props.transform("to_world")? {
        Some(Given { value, at }) if value.determinant().abs() < f64::MIN_POSITIVE => {
            Err(at.error(format!("to_world has no inverse: {value}")))
        }
        given => Ok(given.map(|given| given.value)),
    }
}

/// Voxels in a box.
fn grid<'a>(context: &mut Context<'a>, child: Child<'a>) -> Result<GridVolume, SceneError> {
    let props = context.props(child);
    let filename = props.string("filename")?.ok_or_else(|| {
        child.object.at.error("<volume type=\"gridvolume\"> needs <string name=\"filename\" value=\"…\"/>")
    })?;
    let filter = choice(&props, "filter_type", &[("trilinear", Filter::Bilinear), ("nearest", Filter::Nearest)])?;
    let wraps = [("clamp", Wrap::Clamp), ("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror)];
    let wrap = choice(&props, "wrap_mode", &wraps)?;
    let placed = placed(&props)?.unwrap_or(DMat4::IDENTITY);
    let own_box = props.boolean("use_grid_bbox")?.map(|given| given.value);
    let name = props.string("grid")?;
    // How Mitsuba's spectral variants upsample colours, and whether a GPU's texture units look voxels up.
    props.ignore_boolean("raw")?;
    props.ignore_boolean("accel")?;
    props.finish()?;

    let path = source::find(&filename.value, child.object.folders.iter());
    let key = (path, name.map(|given| given.value));
    let file = match context.grids.get(&key) {
        Some(known) => known.clone(),
        None => {
            let (path, name) = (&key.0, key.1.as_deref());
            let read = GridFile::read(path, name)
                .map_err(|cause| filename.at.error(format!("cannot read the volume {}: {cause}", path.display())))?;
            context.grids.insert(key, read.clone());
            read
        }
    };
    let cube = if own_box.unwrap_or(file.places_itself) { file.to_world } else { DMat4::IDENTITY };
    Ok(GridVolume { grid: file.grid, to_world: placed * cube, filter, wrap })
}

/// Fog that thins out with height.
fn height<'a>(context: &mut Context<'a>, child: Child<'a>, name: &str) -> Result<Coefficient, SceneError> {
    let props = context.props(child);
    let (value, base, up) = (props.color("value")?, props.vector("base")?, props.vector("up")?);
    let scale_height = props.float("scale_height")?.ok_or_else(|| {
        child.object.at.error(
            "<volume type=\"heightvolume\"> needs <float name=\"scale_height\" value=\"…\"/>, over which the density falls to 1/e",
        )
    })?;
    props.finish()?;
    if name != "sigma_t" {
        return Err(child.at.error(format!("{name} cannot be a heightvolume; only sigma_t can")));
    }
    if scale_height.value <= 0.0 {
        let text = format!("scale_height is {}; it must be greater than 0", scale_height.value);
        return Err(scale_height.at.error(text));
    }
    let factor = match value {
        Some(given) if given.value.min_element() < 0.0 => {
            return Err(given.at.error(format!("value is {}; it must not be negative", given.value)));
        }
        Some(given) => given.value,
        None => DVec3::ONE,
    };
    let up = match up {
        Some(given) => given.value.try_normalize().ok_or_else(|| given.at.error("up must not be zero"))?,
        None => DVec3::Y,
    };
    let field =
        HeightVolume { base: base.map_or(DVec3::ZERO, |given| given.value), up, scale_height: scale_height.value };
    Ok(Coefficient { factor, field: Some(Volume::Height(field)) })
}
