//! Which plugins of Mitsuba 3 there are: those that are supported, and what to use instead of those that are not.

use super::tree::{Kind, Object};
use super::{bsdf, emitter, film, integrator, medium, sensor, shape, spectrum, texture, volume};

/// The supported plugins of each kind of element, in the order of the documentation.
pub(super) const SUPPORTED: [(Kind, &[&str]); 13] = [
    (Kind::Integrator, &integrator::TYPES),
    (Kind::Sensor, &sensor::TYPES),
    (Kind::Film, &film::FILM_TYPES),
    (Kind::Sampler, &film::SAMPLER_TYPES),
    (Kind::Rfilter, &film::FILTER_TYPES),
    (Kind::Medium, &medium::TYPES),
    (Kind::Phase, &medium::PHASE_TYPES),
    (Kind::Shape, &shape::TYPES),
    (Kind::Bsdf, &bsdf::TYPES),
    (Kind::Texture, &texture::TYPES),
    (Kind::Spectrum, &spectrum::TYPES),
    (Kind::Emitter, &emitter::TYPES),
    (Kind::Volume, &volume::TYPES),
];

/// Plugins of Mitsuba 3.9 that are not supported, and what to use instead. An entry of a plugin that is supported has no
/// effect.
pub(super) const REFUSED: [(Kind, &str, &str); 31] = [
    (Kind::Integrator, "depth", "use \"volpath\": only radiance is rendered"),
    (Kind::Integrator, "stokes", "use \"volpath\": light is not polarised here"),
    (Kind::Integrator, "prb", "use \"path\": nothing is differentiated here"),
    (Kind::Integrator, "prbvolpath", "use \"volpath\": nothing is differentiated here"),
    (Kind::Sensor, "radiancemeter", "use \"orthographic\" with a small scale"),
    (Kind::Sensor, "irradiancemeter", "use \"perspective\", which sees a diffuse surface there"),
    (Kind::Sensor, "distant", "use \"orthographic\""),
    (Kind::Sensor, "batch", "use one scene file for each camera"),
    (Kind::Film, "specfilm", "use \"hdrfilm\": light has three channels here"),
    (Kind::Phase, "sggx", "use \"hg\" or \"tabphase\""),
    (Kind::Shape, "bsplinecurve", "convert it to a mesh file (obj or ply)"),
    (Kind::Shape, "linearcurve", "convert it to a mesh file (obj or ply)"),
    (Kind::Shape, "ellipsoids", "use \"sphere\", or a mesh file"),
    (Kind::Shape, "ellipsoidsmesh", "use a mesh file (obj or ply)"),
    (Kind::Shape, "sdfgrid", "convert it to a mesh file (obj or ply)"),
    (Kind::Shape, "merge", "put its shapes directly into the scene"),
    (Kind::Bsdf, "principledthin", "use \"principled\", \"thindielectric\" or \"diffuse\""),
    (Kind::Bsdf, "pplastic", "use \"plastic\" or \"roughplastic\": light is not polarised here"),
    (Kind::Bsdf, "measured", "use \"roughconductor\" or \"roughplastic\""),
    (Kind::Bsdf, "measured_polarized", "use \"roughconductor\" or \"roughplastic\": light is not polarised here"),
    (Kind::Bsdf, "hair", "use \"roughplastic\" on a mesh"),
    (Kind::Bsdf, "polarizer", "leave it out: light is not polarised here"),
    (Kind::Bsdf, "retarder", "leave it out: light is not polarised here"),
    (Kind::Bsdf, "circular", "leave it out: light is not polarised here"),
    (Kind::Texture, "volume", "use \"bitmap\""),
    (Kind::Spectrum, "srgb", "use <rgb>"),
    (Kind::Spectrum, "rawconstant", "use <rgb>"),
    (Kind::Emitter, "projector", "use \"spot\""),
    (Kind::Emitter, "directionalarea", "use \"area\" far away, or \"directional\""),
    (Kind::Emitter, "sunsky", "render the sky to an image for \"envmap\""),
    (Kind::Emitter, "timed_sunsky", "render the sky to an image for \"envmap\""),
];

/// What to use instead of a plugin, as the middle of an error message.
pub(super) fn instead(object: &Object) -> String {
    let found = REFUSED.iter().find(|(kind, plugin, _)| *kind == object.kind && *plugin == object.plugin);
    found.map_or(String::new(), |(_, _, advice)| format!("; {advice}"))
}
