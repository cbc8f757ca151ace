//! Mirror of `shaders/lib/texture.glsl`: colours that depend on the place on a surface.

use super::bindings::Texture;
use crate::pack::layout::{TEXTURE_BITMAP, TEXTURE_CHECKERBOARD, TEXTURE_CLAMP, TEXTURE_MIRROR, TEXTURE_NEAREST};
use glam::{DVec2, DVec3};

/// A coordinate moved to \[−1/2, 5/2\] without moving to another pixel.
pub fn wrapped_coordinate(x: f64, flags: u32) -> f64 {
    if flags & TEXTURE_CLAMP != 0 {
        return x.clamp(-0.5, 1.5);
    }
    if flags & TEXTURE_MIRROR != 0 { x - 2.0 * (0.5 * x).floor() } else { x - x.floor() }
}

/// The pixel of an index that may lie outside of the image by as much as [`wrapped_coordinate`] leaves.
pub fn wrapped_index(mut index: i32, size: u32, flags: u32) -> u32 {
    let count = size as i32;
    if flags & TEXTURE_CLAMP != 0 {
        return index.clamp(0, count - 1) as u32;
    }
    let period = if flags & TEXTURE_MIRROR != 0 { 2 * count } else { count };
    index = if index < 0 { index + period } else { index };
    index = if index >= period { index - period } else { index };
    (if index < count { index } else { period - 1 - index }) as u32
}

fn texture_pixel(texture: &Texture, values: &[f32], x: i32, y: i32) -> DVec3 {
    let column = wrapped_index(x, texture.width, texture.flags);
    let row = wrapped_index(y, texture.height, texture.flags);
    let first = (texture.first_value + 3 * (row * texture.width + column)) as usize;
    DVec3::new(f64::from(values[first]), f64::from(values[first + 1]), f64::from(values[first + 2]))
}

/// The colour at texture coordinates; `values` holds the pixels.
pub fn eval_texture(texture: &Texture, values: &[f32], uv: DVec2) -> DVec3 {
    let place = DVec2::new(texture.row_u.dot(uv.extend(1.0)), texture.row_v.dot(uv.extend(1.0)));
    if texture.kind == TEXTURE_CHECKERBOARD {
        let above = (place - place.floor()).cmpgt(DVec2::splat(0.5));
        return if above.x == above.y { texture.color_0 } else { texture.color_1 };
    }
    let place = DVec2::new(wrapped_coordinate(place.x, texture.flags), wrapped_coordinate(place.y, texture.flags));
    let place = place * DVec2::new(f64::from(texture.width), f64::from(texture.height));
    if texture.flags & TEXTURE_NEAREST != 0 {
        return texture_pixel(texture, values, place.x.floor() as i32, place.y.floor() as i32);
    }
    let low = (place - 0.5).floor();
    let share = place - 0.5 - low;
    let (x, y) = (low.x as i32, low.y as i32);
    let upper = texture_pixel(texture, values, x, y).lerp(texture_pixel(texture, values, x + 1, y), share.x);
    let lower = texture_pixel(texture, values, x, y + 1).lerp(texture_pixel(texture, values, x + 1, y + 1), share.x);
    upper.lerp(lower, share.y)
}

/// The numbers that a mesh has at a place on one of its triangles, which have blocks of 2 × 2 pixels in rows: those of the corners first.
pub fn eval_attribute(texture: &Texture, values: &[f32], triangle: u32, barycentric: DVec2) -> DVec3 {
    let columns = texture.width / 2;
    let (x, y) = ((2 * (triangle % columns)) as i32, (2 * (triangle / columns)) as i32);
    let [a, b, c] = [(x, y), (x + 1, y), (x, y + 1)].map(|(x, y)| texture_pixel(texture, values, x, y));
    a + (b - a) * barycentric.x + (c - a) * barycentric.y
}

/// The gradient of the first channel of an image with bilinear filter, with respect to (u, v); 0 for what is no image.
pub fn texture_gradient(texture: &Texture, values: &[f32], uv: DVec2) -> DVec2 {
    if texture.kind != TEXTURE_BITMAP {
        return DVec2::ZERO;
    }
    let place = DVec2::new(texture.row_u.dot(uv.extend(1.0)), texture.row_v.dot(uv.extend(1.0)));
    let place = DVec2::new(wrapped_coordinate(place.x, texture.flags), wrapped_coordinate(place.y, texture.flags));
    let size = DVec2::new(f64::from(texture.width), f64::from(texture.height));
    let place = place * size;
    let low = (place - 0.5).floor();
    let share = place - 0.5 - low;
    let pixel = |x: i32, y: i32| texture_pixel(texture, values, low.x as i32 + x, low.y as i32 + y).x;
    let [f00, f10, f01, f11] = [pixel(0, 0), pixel(1, 0), pixel(0, 1), pixel(1, 1)];
    let mix = |a: f64, b: f64, share: f64| a + (b - a) * share;
    let slope = DVec2::new(mix(f10 - f00, f11 - f01, share.y), mix(f01 - f00, f11 - f10, share.x)) * size;
    texture.row_u.truncate() * slope.x + texture.row_v.truncate() * slope.y
}
