//! The path tracer against closed forms, and its promises: thread count, resuming, halves.

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::film::{Film, Precision, read_exr, write_exr};
use nearfar::method::MethodStatistics;
use nearfar::method::path::{PathSettings, PathStatistics, Progress, reference, render};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::scene::{Camera, Light, Material, Mesh, Scene};
use nearfar::shading::World;

use crate::support::{Folder, backends, cuboid, grey, quad, small_room, world};

fn trace(scene: &Scene, settings: &PathSettings) -> Film {
    render(&world(scene, Backend::Bvh), settings, 5, &Run::new(2).unwrap()).unwrap().film
}

/// Mean of the beauty and its standard error, from the halves' noise.
fn mean(film: &Film, layer: &str) -> f64 {
    let pixels = film.rgb(layer).unwrap();
    pixels.iter().map(|c| f64::from(c.x)).sum::<f64>() / pixels.len() as f64
}

fn furnace(albedo: f32) -> Scene {
    let mut room = Mesh::default();
    cuboid(&mut room, Vec3::ZERO, Vec3::ONE, 0, true);
    let material = Material { emission: Rgb::ONE, ..grey(albedo) };
    let camera = Camera {
        eye: Vec3::new(0.4, 0.5, 0.3),
        target: Vec3::new(0.5, 0.4, 1.0),
        vfov_deg: 90.0,
        width: 16,
        height: 16,
        ..Camera::default()
    };
    Scene { camera, meshes: vec![room], materials: vec![material], ..Scene::default() }
}

#[test]
fn white_furnace() {
    for (albedo, spp, tolerance) in
        [(0.2f32, 64, 0.002), (0.5, 64, 0.004), (0.8, 128, 0.01), (0.9, 256, 0.015)]
    {
        let film = trace(&furnace(albedo), &PathSettings { spp, ..PathSettings::default() });
        let expected = 1.0 / (1.0 - f64::from(albedo));
        let found = mean(&film, "");
        assert!(
            (found / expected - 1.0).abs() < tolerance,
            "albedo {albedo}: {found} for {expected}"
        );
    }
}

#[test]
fn capped_furnace_is_a_partial_sum() {
    let rho = 0.6f64;
    for depth in [1, 2, 4] {
        let film = trace(
            &furnace(0.6),
            &PathSettings { spp: 256, max_depth: depth, ..PathSettings::default() },
        );
        let expected: f64 = (0..=depth as i32).map(|k| rho.powi(k)).sum();
        assert!(
            (mean(&film, "") / expected - 1.0).abs() < 0.004,
            "depth {depth}: {} for {expected}",
            mean(&film, "")
        );
        assert!(
            (mean(&film, "direct") / rho - 1.0).abs() < 0.004
                && (mean(&film, "emission") - 1.0).abs() < 1e-6
        );
    }
}

/// A wide-open floor of one albedo, looked at from above at the origin through a narrow view.
fn floor(albedo: f32) -> Scene {
    let mut mesh = Mesh::default();
    let s = 0.01;
    quad(
        &mut mesh,
        [
            Vec3::new(-s, 0.0, -s),
            Vec3::new(-s, 0.0, s),
            Vec3::new(s, 0.0, s),
            Vec3::new(s, 0.0, -s),
        ],
        0,
    );
    let camera = Camera {
        eye: Vec3::new(0.0, 0.05, 0.0),
        target: Vec3::ZERO,
        up: Vec3::Z,
        vfov_deg: 0.5,
        width: 8,
        height: 8,
    };
    Scene {
        camera,
        meshes: vec![mesh],
        materials: vec![grey(albedo), grey(0.0)],
        ..Scene::default()
    }
}

#[test]
fn black_occluder_under_a_white_sky() {
    // L / albedo = 1 − F of the black square, by Lambert's corner formula (method I.1): four
    // corners above the point.
    let (a, h) = (0.7f64, 0.5f64);
    let s = (a * a + h * h).sqrt();
    let f = 4.0 / (2.0 * std::f64::consts::PI) * 2.0 * (a / s) * (a / s).atan();
    let mut scene = floor(0.5);
    let (a, h) = (a as f32, h as f32);
    quad(
        &mut scene.meshes[0],
        [Vec3::new(-a, h, -a), Vec3::new(a, h, -a), Vec3::new(a, h, a), Vec3::new(-a, h, a)],
        1,
    );
    scene.lights.push(Light::Sky { radiance: Rgb::ONE });
    let film = trace(&scene, &PathSettings { spp: 1024, ..PathSettings::default() });
    let found = mean(&film, "") / 0.5;
    assert!((found - (1.0 - f)).abs() < 0.004, "{found} for {}", 1.0 - f);
    assert!(mean(&film, "direct") == 0.0, "the sky is no direct light");
}

#[test]
fn form_factors_of_lamps() {
    // Parallel square overhead and perpendicular strip: direct = albedo · Le · F (method I.1, I.2).
    let mut scene = floor(0.5);
    let (a, b, h) = (1.3, 0.7, 0.9);
    scene.lights = vec![Light::Quad {
        corner: Vec3::new(0.0, h, 0.0),
        edge1: Vec3::X * a,
        edge2: Vec3::Z * b,
        radiance: Rgb::splat(2.0),
    }];
    let film = trace(&scene, &PathSettings { spp: 256, ..PathSettings::default() });
    assert!((mean(&film, "direct") - 0.137_671_753).abs() < 0.001, "{}", mean(&film, "direct"));

    let (d, b, h) = (0.8, 1.7, 1.1);
    // The strip starts at the foot of the perpendicular and rises from the floor's plane; it faces
    // the point.
    scene.lights = vec![Light::Quad {
        corner: Vec3::new(d, 0.0, 0.0),
        edge1: Vec3::Z * b,
        edge2: Vec3::Y * h,
        radiance: Rgb::splat(2.0),
    }];
    let film = trace(&scene, &PathSettings { spp: 256, ..PathSettings::default() });
    assert!((mean(&film, "direct") - 0.096_121_683).abs() < 0.001, "{}", mean(&film, "direct"));
}

#[test]
fn two_facing_planes() {
    // Method I.11: B1 = M / (1 − r1 r2); planes so wide that their ends do not count.
    let (r1, r2) = (0.5f64, 0.8f64);
    let s = 2000.0;
    let mut mesh = Mesh::default();
    quad(
        &mut mesh,
        [
            Vec3::new(-s, 0.0, -s),
            Vec3::new(-s, 0.0, s),
            Vec3::new(s, 0.0, s),
            Vec3::new(s, 0.0, -s),
        ],
        0,
    );
    quad(
        &mut mesh,
        [
            Vec3::new(-s, 1.0, -s),
            Vec3::new(s, 1.0, -s),
            Vec3::new(s, 1.0, s),
            Vec3::new(-s, 1.0, s),
        ],
        1,
    );
    let camera = Camera {
        eye: Vec3::new(0.0, 0.5, 0.0),
        target: Vec3::ZERO,
        up: Vec3::Z,
        vfov_deg: 20.0,
        width: 12,
        height: 12,
    };
    let lit = Material { emission: Rgb::ONE, ..grey(r1 as f32) };
    let mut scene = Scene {
        camera,
        meshes: vec![mesh],
        materials: vec![lit, grey(r2 as f32)],
        ..Scene::default()
    };
    let settings = PathSettings { spp: 256, ..PathSettings::default() };
    let b1 = mean(&trace(&scene, &settings), "");
    assert!((b1 * (1.0 - r1 * r2) - 1.0).abs() < 0.01, "{b1}");
    scene.camera.target = Vec3::Y;
    let b2 = mean(&trace(&scene, &settings), "");
    assert!((b2 * (1.0 - r1 * r2) / r2 - 1.0).abs() < 0.01, "{b2}");
}

fn bits(film: &Film) -> Vec<(String, Vec<u32>)> {
    film.channels
        .iter()
        .map(|(name, v)| (name.clone(), v.iter().map(|x| x.to_bits()).collect()))
        .collect()
}

#[test]
fn thread_count_changes_no_bit() {
    let scene = small_room();
    let settings = PathSettings { spp: 6, ..PathSettings::default() };
    for backend in crate::support::backends() {
        let of = |threads| {
            let run = Run::new(threads).unwrap();
            bits(
                &render(&World::new(&scene, backend, &run).unwrap(), &settings, 3, &run)
                    .unwrap()
                    .film,
            )
        };
        let one = of(1);
        assert!(one == of(2) && one == of(8), "{backend:?}");
    }
}

#[test]
fn resumed_equals_uninterrupted() {
    let scene = small_room();
    let run = Run::new(2).unwrap();
    let world = World::new(&scene, Backend::Bvh, &run).unwrap();
    fn from(earlier: Option<&Film>) -> Progress<'_> {
        Progress { earlier, keep_state: true, pause: None }
    }
    let to = |spp, earlier: Option<&Film>| {
        let settings = PathSettings { spp, ..PathSettings::default() };
        reference(&world, &settings, 3, &run, from(earlier)).unwrap().film
    };
    let whole = to(23, None);
    let folder = Folder::new("path-resume");
    let path = folder.join("a.exr");
    write_exr(&to(5, None), &path, Precision::Full).unwrap();
    let first = read_exr(&path).unwrap();
    write_exr(&to(14, Some(&first)), &path, Precision::Full).unwrap();
    let second = read_exr(&path).unwrap();
    assert!(bits(&to(23, Some(&second))) == bits(&whole));

    for wrong in [f32::NAN, -5.0, 1e30, 2.5] {
        let mut film = first.clone();
        film.channels.get_mut("samples").unwrap()[7] = wrong;
        let refused = reference(&world, &PathSettings::default(), 3, &run, from(Some(&film)));
        assert!(refused.unwrap_err().to_string().contains("is damaged"), "{wrong}");
    }
    for (sum, wrong) in [("hits", 99.0), ("half0.R", f32::NAN), ("P.X", f32::INFINITY)] {
        let mut film = first.clone();
        film.channels.get_mut(&format!("state.{sum}.high")).unwrap()[7] = wrong;
        let refused = reference(&world, &PathSettings::default(), 3, &run, from(Some(&film)));
        assert!(refused.unwrap_err().to_string().contains("no samples make"), "{sum}");
    }
    let embree = backends().into_iter().find(|&b| b != Backend::Bvh);
    if let Some(backend) = embree {
        let other = World::new(&scene, backend, &run).unwrap();
        let refused = reference(&other, &PathSettings::default(), 3, &run, from(Some(&first)));
        assert!(refused.unwrap_err().to_string().contains("another ray backend"));
    }
    let other = reference(
        &world,
        &PathSettings { spp: 9, ..PathSettings::default() },
        4,
        &run,
        from(Some(&first)),
    );
    assert!(other.unwrap_err().to_string().contains("another seed"));
    let mut moved = small_room();
    moved.meshes[1].positions[0].x += 0.01;
    let moved = World::new(&moved, Backend::Bvh, &run).unwrap();
    assert!(reference(&moved, &PathSettings::default(), 3, &run, from(Some(&first))).is_err());
    let plain =
        render(&world, &PathSettings { spp: 2, ..PathSettings::default() }, 3, &run).unwrap().film;
    let error = reference(&world, &PathSettings::default(), 3, &run, from(Some(&plain)))
        .unwrap_err()
        .to_string();
    assert!(error.contains("without its running sums"), "{error}");
}

#[test]
fn layers_add_up_and_halves_are_independent() {
    let film = trace(&small_room(), &PathSettings { spp: 64, ..PathSettings::default() });
    let layer = |name: &str| film.rgb(name).unwrap();
    let (beauty, h0, h1) = (layer(""), layer("half0"), layer("half1"));
    let parts = layer("emission")
        .into_iter()
        .zip(layer("direct"))
        .zip(layer("indirect"))
        .map(|((a, b), c)| a + b + c);
    assert!(beauty.iter().zip(parts).all(|(b, p)| (*b - p).length() < 1e-4));
    assert!(
        beauty
            .iter()
            .zip(h0.iter().zip(&h1))
            .all(|(b, (x, y))| (*b - (*x + *y) * 0.5).length() < 1e-4)
    );
    // Errors of the halves against a much better image are uncorrelated.
    let truth = trace(&small_room(), &PathSettings { spp: 2048, ..PathSettings::default() })
        .rgb("")
        .unwrap();
    let (mut xy, mut xx, mut yy) = (0.0f64, 0.0f64, 0.0f64);
    for ((t, x), y) in truth.iter().zip(&h0).zip(&h1) {
        let (dx, dy) = (
            f64::from(x.x - t.x) / f64::from(t.x + 0.01),
            f64::from(y.x - t.x) / f64::from(t.x + 0.01),
        );
        xy += dx * dy;
        xx += dx * dx;
        yy += dy * dy;
    }
    let r = xy / (xx * yy).sqrt();
    assert!(
        r.abs() < 4.0 / (truth.len() as f64).sqrt() + 0.04,
        "correlation {r}; 2048 samples of truth leave about 1/32 of common error"
    );
}

#[test]
fn target_error_stops_and_is_met() {
    let run = Run::new(2).unwrap();
    let world = world(&small_room(), Backend::Bvh);
    let done = render(
        &world,
        &PathSettings { spp: 100_000, target_error: 0.01, ..PathSettings::default() },
        3,
        &run,
    )
    .unwrap();
    let MethodStatistics::Path(PathStatistics { spp, noise_relmse, .. }) = done.statistics else {
        panic!("{:?}", done.statistics)
    };
    assert!(noise_relmse < 0.01);
    assert!((4..20_000).contains(&spp), "{spp}");
}

#[test]
fn deadline_keeps_at_least_one_sample() {
    let mut run = Run::new(2).unwrap();
    run.deadline = Some(std::time::Instant::now());
    let done = render(
        &world(&small_room(), Backend::Bvh),
        &PathSettings { spp: 100_000, ..PathSettings::default() },
        3,
        &run,
    )
    .unwrap();
    assert!(done.film.channels["samples"].iter().all(|&n| n >= 1.0));
}
