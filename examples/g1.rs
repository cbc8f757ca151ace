//! temp
use glam::DVec3;
use scene::*;
use tyndall::render::Backend;
use tyndall::*;
fn main() {
    let a: Vec<String> = std::env::args().collect();
    let spp: u32 = a[1].parse().unwrap();
    let sub: u32 = 6;
    let mut s = Scene::new(Camera::look_at(DVec3::new(0., 0., 7.4), DVec3::ZERO, DVec3::Y, 41.5), Film::new(128, 128));
    let m =
        s.add_medium(Medium::new("m", DVec3::new(2., 3.5, 6.), DVec3::new(0.9, 0.571428571, 0.25), Phase::Isotropic));
    let mesh = |f: &str| {
        let (m, _) = tobj::load_obj(f, &tobj::LoadOptions { triangulate: true, ..Default::default() }).unwrap();
        let m = &m[0].mesh;
        Geometry::Mesh(Mesh {
            positions: m.positions.chunks(3).map(|c| DVec3::new(c[0], c[1], c[2])).collect(),
            triangles: m.indices.chunks(3).map(|c| [c[0], c[1], c[2]]).collect(),
        })
    };
    let d = "/work/shared/scenes/meshes/";
    let w = DVec3::new(0.725, 0.71, 0.68);
    for (n, c) in [
        ("floor", w),
        ("ceil", w),
        ("back", w),
        ("left", DVec3::new(0.63, 0.065, 0.05)),
        ("right", DVec3::new(0.14, 0.45, 0.091)),
    ] {
        s.shapes.push(Shape::diffuse(n, mesh(&format!("{d}{n}.obj")), c));
    }
    s.shapes.push(Shape::lamp("light", mesh(&format!("{d}light_big.obj")), DVec3::splat(5.)));
    if a.len() > 2 {
        s.shapes.push(Shape::boundary("s", Geometry::Sphere { center: DVec3::ZERO, radius: 1.0, flipped: false }, m));
    } else {
        s.shapes.push(Shape::boundary("s", mesh(&format!("{d}sphere_r1.obj")), m));
    }
    let _ = sub;
    let t = std::time::Instant::now();
    let mut p = pack::Packed::new(&s, 1).unwrap();
    let k = p.surfaces.len() - 1;
    use pack::layout as lay;
    p.surfaces[k].flags = (lay::BSDF_DIELECTRIC << 8) | lay::SURFACE_ORIENTED;
    p.surfaces[k].eta = 1.5;
    p.surfaces[k].specular = glam::Vec3::ONE;
    p.surfaces[k].transmittance = glam::Vec3::ONE;
    if a.len() > 4 {
        p.surfaces[k].alpha = a[4].parse().unwrap();
        p.surfaces[k].flags |= lay::SURFACE_GGX;
    }
    for t in &mut p.primitives {
        t.surface &= !lay::PRIMITIVE_BOUNDARY;
    }
    p.features = pack::features::Features::of(&s, &p);
    eprintln!(
        "pack {:?} {:?} prims {} nodes {} {:?}",
        t.elapsed(),
        p.features,
        p.primitives.len(),
        p.bvh.node_count,
        p.warnings
    );
    let dev = gpu::Device::open(&gpu::DeviceChoice::Best).unwrap();
    eprintln!("{:?} sub {} bda {}", dev.info, dev.subgroup_size, dev.buffer_reference);
    eprintln!("opened {:?}", t.elapsed());
    let mut r = match gpu::Renderer::new(&dev, &p) {
        Ok(r) => r,
        Err(e) => {
            eprintln!("{e}");
            std::process::exit(1)
        }
    };
    eprintln!("compiled {:?}", t.elapsed());
    let t = std::time::Instant::now();
    r.render(0..1).unwrap();
    eprintln!("first {:?}", t.elapsed());
    for _ in 0..2 {
        let t = std::time::Instant::now();
        let b = r.render(0..spp).unwrap();
        let dt = t.elapsed().as_secs_f64();
        let mut mean = [0f64; 3];
        for b in &b {
            for s in &b.sums {
                for k in 0..3 {
                    mean[k] += s[k] as f64;
                }
            }
        }
        for k in 0..3 {
            mean[k] /= spp as f64 * 128. * 128.;
        }
        eprintln!(
            "{:.3}s  {:.3} Ms/s  mean {:?} invalid {:?}",
            dt,
            spp as f64 * 16384. / dt / 1e6,
            mean,
            b.iter().fold([0; 3], |a, b| [a[0] + b.invalid[0], a[1] + b.invalid[1], a[2] + b.invalid[2]])
        );
        if a.len() > 3 {
            let mut o = String::from("P3 128 128 255\n");
            let mut im = vec![[0f64; 3]; 16384];
            for b in &b {
                for (i, s) in b.sums.iter().enumerate() {
                    for k in 0..3 {
                        im[i][k] += s[k] as f64 / spp as f64;
                    }
                }
            }
            for p in im {
                for k in 0..3 {
                    o += &format!("{} ", (p[k].powf(1. / 2.2) * 255.).min(255.) as u32);
                }
            }
            std::fs::write(&a[3], o).unwrap();
        }
    }
}
