//! A name for what is being rendered, so that images of the same scene can be told from others.

use std::fmt::{Debug, Write};

use crate::scene::{Film, Scene};

/// A hash of everything that decides what a pixel of the film converges to: 16 hexadecimal digits.
///
/// The number of samples and the crop window do not, so the parts of one picture have the same hash. Names of shapes and
/// media count. The hash is FNV-1a (64 bit; Fowler, Noll and Vo, IETF draft-eastlake-fnv) of the description's debug
/// form, which has every field of every part, with numbers exact to the last bit; of an image it has the size and a hash of the
/// pixels.
pub fn scene_hash(scene: &Scene) -> String {
    // Taken apart without `..`, so that a new field cannot be forgotten here.
    let Scene { camera, film, integrator, shapes, media, lights, aovs: _, moments: _, sample_count: _ } = scene;
    let Film { width, height, crop: _, filter, sample_area, pixel_format: _ } = film;
    let mut hash = Fnv1a(0xcbf2_9ce4_8422_2325);
    let parts: [&dyn Debug; 9] = [camera, width, height, integrator, shapes, media, lights, filter, sample_area];
    for part in parts {
        write!(hash, "{part:?};").expect("hashing does not fail");
    }
    format!("{:016x}", hash.0)
}

struct Fnv1a(u64);

impl Write for Fnv1a {
    fn write_str(&mut self, text: &str) -> std::fmt::Result {
        for byte in text.bytes() {
            self.0 = (self.0 ^ u64::from(byte)).wrapping_mul(0x100_0000_01b3);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Bitmap, Camera, Crop, Light};
    use glam::{DMat3, DVec3};

    fn scene() -> Scene {
        let mut scene = Scene::new(Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, 40.0), Film::new(8, 4));
        scene.lights.push(Light::Constant { radiance: DVec3::ONE });
        scene
    }

    #[test]
    fn fnv_1a_of_known_strings() {
        // Values from the FNV test vectors of the draft.
        for (text, expected) in
            [("", 0xcbf2_9ce4_8422_2325), ("a", 0xaf63_dc4c_8601_ec8c), ("foobar", 0x8594_4171_f739_67e8)]
        {
            let mut hash = Fnv1a(0xcbf2_9ce4_8422_2325);
            hash.write_str(text).unwrap();
            assert_eq!(hash.0, expected, "of {text:?}");
        }
    }

    #[test]
    fn the_hash_sees_the_scene_and_nothing_else() {
        let hash = scene_hash(&scene());
        assert_eq!(hash.len(), 16);
        let mut same = scene();
        same.sample_count = 4096;
        same.film.crop = Crop { x: 1, y: 1, width: 2, height: 2 };
        assert_eq!(scene_hash(&same), hash);

        let mut lamp = scene();
        lamp.lights[0] = Light::Constant { radiance: DVec3::new(1.0, 1.0, 1.0 + f64::EPSILON) };
        let mut camera = scene();
        camera.camera.fov_x = 41.0;
        let mut film = scene();
        film.film = Film::new(4, 8);
        let mut sky = scene();
        let envmap = |pixel: f32| {
            let bitmap = Bitmap::new(2, 3, [vec![[1.0; 3]; 5], vec![[1.0, 1.0, pixel]]].concat()).unwrap();
            Light::Envmap { bitmap: bitmap.into(), scale: 1.0, to_world: DMat3::IDENTITY }
        };
        sky.lights[0] = envmap(1.0);
        let mut other_sky = scene();
        other_sky.lights[0] = envmap(1.0 + f32::EPSILON);
        assert_ne!(scene_hash(&sky), scene_hash(&other_sky), "one bit of one pixel");
        for other in [lamp, camera, film, sky] {
            assert_ne!(scene_hash(&other), hash);
        }
    }
}
