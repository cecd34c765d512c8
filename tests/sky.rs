//! Skies from pictures: closed forms, the same light in every method, what is refused, the shipped
//! map.

use std::f32::consts::PI;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use glam::{Vec2, Vec3};
use nearfar::accel::Backend;
use nearfar::load::load;
use nearfar::math::Ray;
use nearfar::radiometry::{Rgb, luminance};
use nearfar::run::Run;
use nearfar::sampling::{Rng, Stream};
use nearfar::scene::{Environment, Light, Material, Mesh, Scene};
use nearfar::shading::{World, direct_irradiance};

use crate::support::Folder;

const WIDTH: usize = 128;
const HEIGHT: usize = 64;
const SUN: (f32, f32) = (38.0, -50.0);

fn environment(width: usize, texel: impl Fn(usize, usize) -> Rgb, degrees: f32) -> Environment {
    let height = width / 2;
    let texels = (0..width * height).map(|i| texel(i % width, i / width)).collect();
    Environment {
        name: "test".into(),
        width: width as u32,
        height: height as u32,
        texels,
        world_from_map: Environment::rotation(Vec3::Y, degrees),
    }
}

fn world(map: Environment) -> World {
    // Edge-on to its own sky: what is asked stands high above it.
    let mesh = Mesh {
        positions: vec![
            Vec3::new(-1.0, -90.0, -1.0),
            Vec3::new(1.0, -90.0, -1.0),
            Vec3::new(0.0, -90.0, 1.0),
        ],
        triangles: vec![[0, 1, 2]],
        materials: vec![0],
        ..Mesh::default()
    };
    let scene = Scene {
        meshes: vec![mesh],
        materials: vec![Material::default()],
        lights: vec![Light::Environment { map: Arc::new(map) }],
        ..Scene::default()
    };
    World::new(&scene, Backend::Brute, &Run::new(1).unwrap()).unwrap()
}

fn direct(world: &World, n: Vec3) -> Rgb {
    let mut rng = Rng::new(1, Stream::Test, 0, 0);
    direct_irradiance(world, [Vec3::ZERO, n, n], None, 20_000, &mut |_| {
        (rng.next_f32(), rng.next_2d())
    })
    .0
}

fn lone(x: usize, y: usize) -> impl Fn(usize, usize) -> Rgb {
    move |a, b| if (a, b) == (x, y) { Rgb::new(300.0, 200.0, 100.0) } else { Rgb::ZERO }
}

#[test]
fn a_constant_map_is_a_constant_sky() {
    let w = world(environment(64, |_, _| Rgb::new(1.0, 2.0, 3.0), 20.0));
    assert!(w.lights.is_empty() && w.lights.sky.has_map(), "nothing of it is bright");
    let mut rng = Rng::new(2, Stream::Test, 0, 0);
    for _ in 0..1000 {
        let d = nearfar::sampling::sample_uniform_sphere(rng.next_2d());
        assert!((w.lights.background(d) - Rgb::new(1.0, 2.0, 3.0)).abs().max_element() < 1e-5);
    }
    assert!(
        (w.lights.sky.integral() / (4.0 * PI) - Rgb::new(1.0, 2.0, 3.0)).abs().max_element() < 1e-4
    );
}

#[test]
fn a_bright_texel_is_a_sun_of_its_solid_angle() {
    for degrees in [0.0, 75.0] {
        let map = environment(64, lone(40, 10), degrees);
        let (to_light, omega) =
            (map.direction(40, 10, Vec2::splat(0.5)), map.solid_angle(10) as f32);
        let unturned = environment(64, lone(40, 10), 0.0).direction(40, 10, Vec2::splat(0.5));
        assert!(
            glam::Quat::from_rotation_y(degrees.to_radians()).mul_vec3(unturned).distance(to_light)
                < 1e-5,
            "the sun turns with the map"
        );
        let w = world(map);
        assert!(
            w.lights.sky.radiance(to_light) == Rgb::ZERO && !w.lights.is_empty(),
            "all of it is direct"
        );
        for n in [to_light, Vec3::Y, (to_light + Vec3::Z).normalize()] {
            let expected = Rgb::new(300.0, 200.0, 100.0) * (omega * n.dot(to_light));
            // The mean cosine over a texel of 5.6° is 0.1 % below that of its middle.
            assert!(
                (direct(&w, n) / expected - 1.0).abs().max_element() < 5e-3,
                "{n} {}",
                direct(&w, n) / expected
            );
        }
        assert_eq!(direct(&w, -to_light), Rgb::ZERO);
    }
}

/// Our own sky: blue falls to white at the horizon, a glow around the sun, a disc of one texel;
/// brown ground.
fn plaza_sky() -> Environment {
    let (height, turn) = (SUN.0.to_radians(), SUN.1.to_radians());
    let to_sun = Vec3::new(height.cos() * turn.sin(), height.sin(), height.cos() * turn.cos());
    let blank = environment(WIDTH, |_, _| Rgb::ONE, 0.0);
    let sun = blank.texel(to_sun);
    environment(
        WIDTH,
        |x, y| {
            let d = blank.direction(x, y, Vec2::splat(0.5));
            if d.y < 0.0 {
                return Rgb::new(0.11, 0.09, 0.07);
            }
            let haze = (-6.0 * d.y).exp();
            let blue = Rgb::new(0.16, 0.3, 0.62) * (1.0 - haze) + Rgb::new(0.75, 0.78, 0.8) * haze;
            let glow = Rgb::new(1.0, 0.86, 0.62) * (2.5 * (-9.0 * d.angle_between(to_sun)).exp());
            // Irradiance of 4, 3.7, 3.1 on a surface that faces it.
            let disc = if (x, y) == sun {
                Rgb::new(4.0, 3.7, 3.1) / blank.solid_angle(y) as f32
            } else {
                Rgb::ZERO
            };
            blue + glow + disc
        },
        0.0,
    )
}

#[test]
fn samples_follow_their_density_and_both_parts_add_up() {
    let map = plaza_sky();
    let whole = map.integral();
    let w = world(map.clone());
    let (_, bright) = map.split();
    let mut rng = Rng::new(4, Stream::Test, 0, 0);
    let n = Vec3::Y;
    let (count, mut sum, mut hits) = (50_000, 0.0f64, std::collections::BTreeMap::new());
    for _ in 0..count {
        let s = w.lights.sample(Vec3::ZERO, n, rng.next_f32(), rng.next_2d()).unwrap();
        assert!(
            (w.lights.pdf_sun_disc(Vec3::ZERO, n, s.wi) / s.pdf_solid_angle - 1.0).abs() < 1e-4
        );
        *hits.entry(map.texel(s.wi)).or_insert(0u32) += 1;
        sum += f64::from(luminance(s.weight)) / f64::from(count);
    }
    let expected: f64 = bright
        .iter()
        .enumerate()
        .map(|(i, c)| f64::from(luminance(*c)) * map.solid_angle(i / WIDTH))
        .sum();
    assert!((sum / expected - 1.0).abs() < 1e-3, "{sum} {expected}");
    let (mut chi, mut cells) = (0.0, 0);
    for (i, c) in bright.iter().enumerate() {
        let wanted =
            f64::from(luminance(*c)) * map.solid_angle(i / WIDTH) / expected * f64::from(count);
        let found = f64::from(hits.get(&(i % WIDTH, i / WIDTH)).copied().unwrap_or(0));
        if wanted > 5.0 {
            chi += (found - wanted).powi(2) / wanted;
            cells += 1;
        }
        assert!(wanted > 0.0 || found == 0.0);
    }
    assert!(chi < f64::from(cells) + 5.0 * (2.0 * f64::from(cells)).sqrt(), "{chi} {cells}");
    // By uniform directions and the sampled bright part: the whole map.
    let mut smooth = Vec3::ZERO;
    for _ in 0..200_000 {
        smooth += w.lights.sky.radiance(nearfar::sampling::sample_uniform_sphere(rng.next_2d()))
            * (4.0 * PI / 200_000.0);
    }
    assert!(
        ((f64::from(luminance(smooth)) + sum) / f64::from(luminance(whole)) - 1.0).abs() < 5e-3,
        "{smooth} {sum} {whole}"
    );
    let mut photons = Vec3::ZERO;
    for _ in 0..100_000 {
        photons += w.lights.emit_photon(rng.next_f32(), rng.next_2d(), rng.next_2d()).unwrap().flux
            / 100_000.0;
    }
    assert!(
        (photons / w.lights.power() - 1.0).abs().max_element() < 0.01,
        "{photons} {}",
        w.lights.power()
    );
    assert!(w.rays.closest(&Ray::new(Vec3::ZERO, Vec3::Y)).is_none());
}

fn shipped(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/sky-plaza").join(name)
}

/// Writes the map that stands beside the scene.
#[test]
#[ignore = "writes scenes/sky-plaza/sky.hdr: run after changing the formula"]
fn write_the_plaza_sky() {
    let map = plaza_sky();
    let pixels: Vec<image::Rgb<f32>> =
        map.texels.iter().map(|c| image::Rgb(c.to_array())).collect();
    let file = std::io::BufWriter::new(std::fs::File::create(shipped("sky.hdr")).unwrap());
    image::codecs::hdr::HdrEncoder::new(file).encode(&pixels, WIDTH, HEIGHT).unwrap();
}

#[test]
fn the_shipped_map_is_that_of_the_formula() {
    let loaded = load(&shipped("sky-plaza.toml"), &[]).unwrap();
    let map = loaded
        .scene
        .lights
        .iter()
        .find_map(|l| if let Light::Environment { map } = l { Some(map.clone()) } else { None })
        .unwrap();
    let formula = plaza_sky();
    assert_eq!((map.width, map.height), (formula.width, formula.height));
    // Radiance files keep 8 bits of the largest channel.
    for (a, b) in map.texels.iter().zip(&formula.texels) {
        assert!((*a - *b).abs().max_element() <= b.max_element() / 120.0, "{a} {b}");
    }
}

#[test]
fn path_tracing_and_the_split_agree_for_any_method() {
    let folder = Folder::new("sky-methods");
    let scene = shipped("sky-plaza.toml");
    let render = |method: &str, more: &[&str]| {
        let out = folder.join(format!("{method}.exr"));
        let mut command = std::process::Command::new(env!("CARGO_BIN_EXE_nearfar"));
        command
            .args(["render", "-q", "--size", "48x27", "--method", method, "--backend", "bvh"])
            .arg(&scene)
            .arg("-o")
            .arg(&out)
            .args(more);
        assert!(command.status().unwrap().success(), "{method}");
        let film = nearfar::film::read_exr(&out).unwrap();
        let mean = |layer: &str| {
            film.rgb(layer).map(|v| v.iter().map(|c| luminance(*c)).sum::<f32>() / v.len() as f32)
        };
        (mean("").unwrap(), mean("direct"))
    };
    let (truth, truth_direct) = render("path", &["--spp", "256"]);
    // Not local-correction: its lights cast no shadows and its ambient field is set by hand.
    for method in ["decomposition", "irradiance-cache", "point-based"] {
        let (whole, direct) = render(method, &[]);
        // Points stand discs for surfaces: a few per cent are theirs by design.
        let bound = if method == "point-based" { 0.1 } else { 0.03 };
        assert!((whole / truth - 1.0).abs() < bound, "{method}: {whole} {truth}");
        if let (Some(a), Some(b)) = (direct, truth_direct) {
            assert!((a / b - 1.0).abs() < 0.03, "{method} direct: {a} {b}");
        }
    }
}

#[test]
fn wrong_maps_are_refused_with_line_and_fix() {
    let folder = Folder::new("sky-wrong");
    std::fs::write(folder.join("a.obj"), "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").unwrap();
    let exr = |name: &str, width: u32, height: u32, value: f32| {
        let mut film = nearfar::film::Film::new(width, height);
        film.set_rgb("", &vec![Rgb::splat(value); (width * height) as usize]);
        nearfar::film::write_exr(&film, &folder.join(name), nearfar::film::Precision::Full)
            .unwrap();
    };
    exr("good.exr", 4, 2, 1.5);
    exr("square.exr", 4, 4, 1.0);
    exr("nan.exr", 4, 2, f32::NAN);
    exr("negative.exr", 4, 2, -1.0);
    exr("black.exr", 4, 2, 0.0);
    std::fs::write(folder.join("text.hdr"), "hello").unwrap();
    std::fs::write(folder.join("sky.png"), "hello").unwrap();
    let read = |file: &str, more: &str| {
        let text = format!(
            "[[mesh]]\nfile = \"a.obj\"\n[[light]]\ntype = \"environment\"\nfile = \
             \"{file}\"\n{more}\n"
        );
        std::fs::write(folder.join("s.toml"), text).unwrap();
        load(&folder.join("s.toml"), &[])
    };
    let good = read("good.exr", "scale = 2\nrotation_deg = 30\nup = [0, 0, 1]").unwrap();
    let Light::Environment { map } = &good.scene.lights[0] else { panic!("no environment") };
    assert_eq!(map.texels[0], Rgb::splat(3.0));
    assert!(map.direction(0, 0, Vec2::ZERO).z > 0.999);
    for (file, more, expected) in [
        ("none.hdr", "", "does not exist"),
        ("square.exr", "", "4 by 4 texels; a latitude-longitude map is twice as wide as high"),
        ("nan.exr", "", "texel (0, 0)"),
        ("negative.exr", "", "must be finite and not negative"),
        ("black.exr", "", "all black"),
        ("text.hdr", "", "no readable Radiance picture"),
        ("sky.png", "", "give a Radiance .hdr or an OpenEXR"),
        ("good.exr", "scale = -1", "scale must be"),
        ("good.exr", "up = [0, 0, 0]", "up finite and not zero"),
        ("good.exr", "[[light]]\ntype = \"environment\"\nfile = \"good.exr\"", "one environment"),
    ] {
        let message = read(file, more).unwrap_err().to_string();
        assert!(message.contains("s.toml:") && message.contains(expected), "{file}: {message}");
    }
}
