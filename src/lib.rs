//! A headless, progressive, unbiased path tracer for participating media on Vulkan compute.
//!
//! The line from a scene to a picture, each step in its own module:
//! [`scene`] (a plain description) → [`pack`] (flat tables) → [`gpu`] (Vulkan) or [`mod@reference`] (the same, in f64 on the
//! CPU) → [`render`] (blocks of samples into a film) → [`image`] (files and error measures).

pub mod gpu;
pub mod guide;
pub mod image;
pub mod pack;
pub mod pilot;
pub mod reference;
pub mod render;
pub mod scene;
pub mod seen;
