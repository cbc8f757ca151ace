//! What the written picture holds beside the radiance.

/// Channels that describe what the camera sees first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Aov {
    /// The channels are named `name.X`.
    pub name: String,
    /// What they hold.
    pub kind: AovKind,
}

/// What is known of the first surface on a camera ray, be it the boundary of a medium; all are 0 where there is none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum AovKind {
    /// Distance from the near clip plane along the ray, scene units.
    Depth,
    /// The point, world space.
    Position,
    /// Texture coordinates.
    Uv,
    /// Normal of the surface, world space.
    GeometricNormal,
    /// Interpolated normal, world space.
    ShadingNormal,
    /// Number of the shape in the scene, from 1.
    ShapeIndex,
    /// Diffusely reflected fraction.
    Albedo,
    /// Number of the triangle in its shape, from 0.
    PrimitiveIndex,
}

impl AovKind {
    /// Every kind by its name in scene files, with the names of its channels.
    pub const ALL: [(&'static str, AovKind, &'static [&'static str]); 8] = [
        ("depth", AovKind::Depth, &["T"]),
        ("position", AovKind::Position, &["X", "Y", "Z"]),
        ("uv", AovKind::Uv, &["U", "V"]),
        ("geo_normal", AovKind::GeometricNormal, &["X", "Y", "Z"]),
        ("sh_normal", AovKind::ShadingNormal, &["X", "Y", "Z"]),
        ("shape_index", AovKind::ShapeIndex, &["I"]),
        ("albedo", AovKind::Albedo, &["R", "G", "B"]),
        ("prim_index", AovKind::PrimitiveIndex, &["I"]),
    ];

    /// The names of its channels, behind the dot.
    pub fn channels(self) -> &'static [&'static str] {
        AovKind::ALL.iter().find(|(_, kind, _)| *kind == self).expect("all kinds are in the list").2
    }
}

/// In which colours a picture is written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Colors {
    /// `R G B`, linear sRGB.
    #[default]
    Rgb,
    /// `X Y Z` of the CIE's observer of 1931.
    Xyz,
    /// `Y` alone.
    Luminance,
}

/// How the pixels of a picture are written.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PixelFormat {
    /// The colours.
    pub colors: Colors,
    /// With a channel `A`: the share of the light that does not come from beyond the scene.
    pub alpha: bool,
    /// In half precision.
    pub half: bool,
}
