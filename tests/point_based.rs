//! Point-based occlusion and bleeding against rays and ground truth.

use glam::Vec3;
use nearfar::accel::Backend;
use nearfar::cloud::{
    Cloud, Density, Hierarchy, HitSides, Overlap, PointBasedSettings, RadiositySource, bake, dice,
};
use nearfar::compare::{Truth, errors};
use nearfar::config::RenderConfig;
use nearfar::film::read_exr;
use nearfar::load::load;
use nearfar::method::path;
use nearfar::method::point_based::{gather_picture, render, traced_occlusion};
use nearfar::radiometry::Rgb;
use nearfar::run::Run;
use nearfar::sampling::{Rng, Stream};
use nearfar::scene::{Camera, Light, Mesh, Scene, Sides};
use nearfar::shading::World;

use crate::support::{cuboid, grey, quad, small_room, world};

/// A field with boxes on it, under a sky; `clutter`: slabs in the air above as well.
fn field(clutter: usize) -> Scene {
    let mut ground = Mesh { sides: Sides::Two, ..Mesh::default() };
    quad(
        &mut ground,
        [
            Vec3::new(-5.0, 0.0, -5.0),
            Vec3::new(-5.0, 0.0, 5.0),
            Vec3::new(5.0, 0.0, 5.0),
            Vec3::new(5.0, 0.0, -5.0),
        ],
        0,
    );
    let mut meshes = vec![ground];
    let mut rng = Rng::new(11, Stream::Test, 0, 0);
    for i in 0..25 + clutter {
        let mut block = Mesh { sides: Sides::Auto, ..Mesh::default() };
        let size = 0.2 + 0.6 * rng.next_f32();
        let at = Vec3::new(
            rng.next_f32() * 8.0 - 4.0,
            if i < 25 { 0.0 } else { 0.2 + 2.0 * rng.next_f32() },
            rng.next_f32() * 8.0 - 4.0,
        );
        let high = if i < 25 { size * (0.5 + 2.0 * rng.next_f32()) } else { 0.1 * size };
        cuboid(&mut block, at, at + Vec3::new(size, high, 0.7 * size), 0, false);
        meshes.push(block);
    }
    Scene {
        meshes,
        materials: vec![grey(0.7)],
        lights: vec![Light::Sky { radiance: Rgb::ONE }],
        camera: Camera {
            eye: Vec3::new(6.0, 4.0, 6.0),
            target: Vec3::new(0.0, 0.2, 0.0),
            up: Vec3::Y,
            vfov_deg: 40.0,
            width: 48,
            height: 32,
        },
        ..Scene::default()
    }
}

fn areas(world: &World, count: u64) -> Cloud {
    Cloud::from_pieces(&world.geometry, &dice(&world.geometry, Density::Elements(count)).unwrap()).0
}

/// Mean absolute error and bias of gathered occlusion against `rays` rays, at the points a camera
/// sees.
fn occlusion_errors(
    scene: &Scene,
    settings: &PointBasedSettings,
    elements: u64,
    rays: u32,
) -> (f64, f64) {
    let (world, run, config) =
        (world(scene, Backend::Bvh), Run::new(2).unwrap(), RenderConfig::default());
    let cloud = areas(&world, elements);
    let tree = Hierarchy::new(&cloud, settings.hitsides).unwrap();
    let record = nearfar::record::RecordSettings { spp: 4, ..config.record.clone() };
    let inputs =
        nearfar::method::stage::Inputs { record: &record, ..config.inputs(world.around.extent) };
    let layers = gather_picture(&world, &cloud, &tree, settings, inputs, &run).unwrap();
    let traced = traced_occlusion(&world, &layers.samples.points, settings, rays, 3, &run).unwrap();
    let count = traced.len() as f64;
    assert!(count > 200.0);
    let difference = |f: &dyn Fn(f64) -> f64| {
        layers
            .gathered
            .iter()
            .zip(&traced)
            .map(|(g, &t)| f(f64::from(g.occlusion - t)))
            .sum::<f64>()
            / count
    };
    (difference(&f64::abs), difference(&|d| d))
}

#[test]
fn occlusion_in_the_open_is_that_of_rays() {
    let (error, bias) = occlusion_errors(&field(0), &PointBasedSettings::default(), 100_000, 1024);
    // The bars of the method. Measured: 0.015 and +0.006; 0.008 and +0.007 with a gather at every
    // point.
    assert!(error <= 0.03 && bias.abs() <= 0.01, "error {error:.4}, bias {bias:+.4}");
}

#[test]
fn overlap_is_dealt_with() {
    let scene = field(120);
    let errors = |overlap| {
        occlusion_errors(
            &scene,
            &PointBasedSettings { overlap, ..PointBasedSettings::default() },
            40_000,
            256,
        )
    };
    let (raster, bunnell, none) =
        (errors(Overlap::Raster), errors(Overlap::Bunnell), errors(Overlap::None));
    assert!(raster.0 < 0.03 && raster.1.abs() < 0.025, "raster {raster:?}");
    // The plain sum is much too dark; the correction takes a part of that away; the raster is
    // better still.
    assert!(
        none.1 > 0.05 && bunnell.1.abs() < 0.8 * none.1 && raster.0 < 0.6 * bunnell.0,
        "raster {raster:?}, bunnell {bunnell:?}, none {none:?}"
    );
}

#[test]
fn interpolated_gathers_are_those_of_every_point() {
    let scene = Scene { camera: Camera { width: 96, height: 64, ..field(0).camera }, ..field(0) };
    let (world, run, config) =
        (world(&scene, Backend::Bvh), Run::new(2).unwrap(), RenderConfig::default());
    let cloud = areas(&world, 40_000);
    let tree = Hierarchy::new(&cloud, HitSides::Both).unwrap();
    let record = nearfar::record::RecordSettings { spp: 1, ..config.record.clone() };
    let inputs =
        nearfar::method::stage::Inputs { record: &record, ..config.inputs(world.around.extent) };
    let layers = |maxvariation: f32| {
        gather_picture(
            &world,
            &cloud,
            &tree,
            &PointBasedSettings { maxvariation, ..PointBasedSettings::default() },
            inputs,
            &run,
        )
        .unwrap()
    };
    let (all, some) = (layers(0.0), layers(0.02));
    assert!(
        all.gathers == all.gathered.len() && some.gathers < all.gathers / 2,
        "{} of {}",
        some.gathers,
        all.gathers
    );
    let sum: f32 = all
        .gathered
        .iter()
        .zip(&some.gathered)
        .map(|(a, b)| (a.occlusion - b.occlusion).abs())
        .sum();
    assert!(sum < 0.01 * all.gathered.len() as f32, "{}", sum / all.gathered.len() as f32);
}

#[test]
fn distances_and_fall_off_are_those_of_rays() {
    for settings in [
        PointBasedSettings { maxdist: 1.0, ..PointBasedSettings::default() },
        PointBasedSettings { falloff: 1.5, ..PointBasedSettings::default() },
    ] {
        let (error, bias) = occlusion_errors(&field(0), &settings, 60_000, 512);
        assert!(error < 0.03 && bias.abs() < 0.015, "{settings:?}: {error:.4} {bias:+.4}");
    }
}

#[test]
fn smaller_groups_bring_it_closer_to_all_elements_one_by_one() {
    let scene = small_room();
    let (world, run, config) =
        (world(&scene, Backend::Bvh), Run::new(2).unwrap(), RenderConfig::default());
    let settings = PointBasedSettings {
        elements: 20_000,
        direct_samples: 2,
        bounces: 1,
        ..PointBasedSettings::default()
    };
    let inputs = config.inputs(world.around.extent);
    let proxy = inputs.proxy();
    let cloud = bake(&world, &settings, proxy, 1, &run).unwrap();
    let tree = Hierarchy::new(&cloud, HitSides::Both).unwrap();
    let light = |solid_angle: f32| -> Vec<Rgb> {
        let settings = PointBasedSettings {
            maxsolidangle: solid_angle,
            overlap: Overlap::None,
            clamp: false,
            ..settings.clone()
        };
        gather_picture(&world, &cloud, &tree, &settings, inputs, &run)
            .unwrap()
            .gathered
            .iter()
            .map(|g| g.irradiance)
            .collect()
    };
    let exact = light(0.0);
    let mean: f32 = exact.iter().map(|c| c.x).sum::<f32>() / exact.len() as f32;
    let error = |a: f32| {
        light(a).iter().zip(&exact).map(|(a, b)| (a.x - b.x).abs()).sum::<f32>()
            / exact.len() as f32
            / mean
    };
    let errors = [0.2, 0.05, 0.01, 0.002].map(error);
    assert!(
        errors.windows(2).all(|e| e[1] < e[0]) && errors[1] < 0.03 && errors[3] < 0.005,
        "{errors:?}"
    );
}

#[test]
fn the_cornell_box_is_the_ground_truth() {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/cornell-box/cornell-box.toml");
    let size = [
        ("camera.width".to_owned(), "32".to_owned()),
        ("camera.height".to_owned(), "32".to_owned()),
    ];
    let scene = load(file.as_ref(), &size).unwrap().scene;
    let (world, run, config) =
        (world(&scene, Backend::Bvh), Run::new(2).unwrap(), RenderConfig::default());
    let settings = PointBasedSettings::default();
    let film = render(&world, &settings, config.inputs(world.around.extent), &run).unwrap().film;
    let truth = read_exr(file.replace(".toml", ".exr").as_ref()).unwrap();
    assert_eq!((truth.width, truth.height), (256, 256));
    let (got, truth) = (film.rgb("").unwrap(), truth.rgb("").unwrap());
    // Box filters: a pixel of the small picture is the mean of 64.
    let mean = |x: usize, y: usize| {
        (0..64).map(|i| truth[(8 * y + i / 8) * 256 + 8 * x + i % 8]).sum::<Rgb>() / 64.0
    };
    let reference: Vec<Rgb> = (0..32 * 32).map(|i| mean(i % 32, i / 32)).collect();
    assert!(
        relative_error(&got, &reference) < 0.01,
        "picture {}",
        relative_error(&got, &reference)
    );

    // Indirect irradiance alone, where both see surface; the noise of the reference counts against
    // the method here. Every bounce on the elements loses about 2 % of the light, with the proxy's
    // radiosity only the last one does.
    let traced =
        path::render(&world, &path::PathSettings { spp: 1024, ..Default::default() }, 5, &run)
            .unwrap()
            .film;
    let photon = PointBasedSettings { radiosity: RadiositySource::Photon, ..settings };
    let by_proxy = render(&world, &photon, config.inputs(world.around.extent), &run).unwrap().film;
    let layer = |film: &nearfar::film::Film, name: &str| film.rgb(name).unwrap();
    let irradiance = |film: &nearfar::film::Film| -> Vec<Rgb> {
        let seen = layer(film, "albedo")
            .into_iter()
            .zip(layer(&traced, "albedo"))
            .zip(layer(&by_proxy, "albedo"));
        seen.zip(layer(film, "indirect"))
            .map(|(((a, b), c), l)| {
                if a.min(b).min(c).min_element() > 0.04 {
                    l / a * std::f32::consts::PI
                } else {
                    Rgb::ZERO
                }
            })
            .collect()
    };
    let truth = irradiance(&traced);
    let (bounces, proxy) = (
        relative_error(&irradiance(&film), &truth),
        relative_error(&irradiance(&by_proxy), &truth),
    );
    eprintln!(
        "Cornell box: picture {:.4}, indirect irradiance {bounces:.4}, by the proxy {proxy:.4}",
        relative_error(&got, &reference)
    );
    // From seed to seed the second figure lies between 0.0068 and 0.0072.
    assert!(bounces <= 0.01 && proxy <= 0.0075, "indirect irradiance {bounces}, {proxy}");
}

/// relMSE without the 0.1 % worst.
fn relative_error(got: &[Rgb], reference: &[Rgb]) -> f64 {
    errors(got, &Truth::exact(reference.len() as u32, 1, reference)).relmse_trimmed
}

#[test]
fn threads_do_not_matter() {
    let world = world(&small_room(), Backend::Bvh);
    let config = RenderConfig::default();
    let settings =
        PointBasedSettings { elements: 5000, bounces: 2, ..PointBasedSettings::default() };
    let picture = |threads: usize| {
        render(&world, &settings, config.inputs(world.around.extent), &Run::new(threads).unwrap())
            .unwrap()
            .film
            .channels
    };
    assert_eq!(picture(1), picture(3));
}

/// A floor and a red wall under a small light, ambient all around.
fn corner() -> Scene {
    let mut mesh = Mesh { sides: Sides::Two, ..Mesh::default() };
    quad(
        &mut mesh,
        [
            Vec3::new(-4.0, 0.0, -4.0),
            Vec3::new(-4.0, 0.0, 4.0),
            Vec3::new(4.0, 0.0, 4.0),
            Vec3::new(4.0, 0.0, -4.0),
        ],
        0,
    );
    quad(
        &mut mesh,
        [
            Vec3::new(-1.0, 0.0, 0.0),
            Vec3::new(1.0, 0.0, 0.0),
            Vec3::new(1.0, 2.0, 0.0),
            Vec3::new(-1.0, 2.0, 0.0),
        ],
        1,
    );
    Scene {
        meshes: vec![mesh],
        materials: vec![
            grey(0.5),
            nearfar::scene::Material { albedo: Rgb::new(0.8, 0.05, 0.05), ..Default::default() },
        ],
        lights: vec![Light::Point {
            position: Vec3::new(0.0, 3.0, 3.0),
            intensity: Rgb::splat(10.0),
        }],
        camera: Camera {
            eye: Vec3::new(0.0, 6.0, 2.0),
            target: Vec3::new(0.0, 0.0, 1.0),
            up: Vec3::Y,
            vfov_deg: 50.0,
            width: 40,
            height: 40,
        },
        ..Scene::default()
    }
}

#[test]
fn near_surfaces_correct_a_flat_ambient_term() {
    use nearfar::method::local_correction::{LocalSettings, render};
    let (world, record) = (world(&corner(), Backend::Bvh), RenderConfig::default().record);
    let sh = vec![
        [1.0, 1.0, 1.0],
        [0.3, 0.3, 0.3],
        [0.0; 3],
        [0.1, 0.1, 0.1],
        [0.0; 3],
        [0.0; 3],
        [0.0; 3],
        [0.0; 3],
        [0.0; 3],
    ];
    for ambient in [vec![[0.3; 3]], sh] {
        let picture = |correction: bool| {
            let run = Run::new(2).unwrap();
            let settings = LocalSettings {
                correction,
                ambient: ambient.clone(),
                reach: nearfar::length::Length::Percent(20.0),
                elements: 30_000,
                ..LocalSettings::default()
            };
            let film = render(&world, &settings, &record, 1, &run).unwrap().film;
            for kind in [
                nearfar::run::RayKind::Shadow,
                nearfar::run::RayKind::Sample,
                nearfar::run::RayKind::Visibility,
            ] {
                assert_eq!(run.rays.get(kind), 0);
            }
            film
        };
        let (off, on) = (picture(false), picture(true));
        let (position, normal) = (&off.channels, &off.channels["N.Y"]);
        let (before, after) = (off.rgb("irradiance").unwrap(), on.rgb("irradiance").unwrap());
        let (mut near, mut far) = ((0, Rgb::ZERO, Rgb::ZERO), 0);
        for i in 0..before.len() {
            assert!(after[i].min_element() >= 0.0);
            let p = Vec3::new(position["P.X"][i], position["P.Y"][i], position["P.Z"][i]);
            if normal[i] < 0.99 {
                continue;
            }
            if p.x.abs() < 0.6 && (0.05..0.4).contains(&p.z) {
                near = (near.0 + 1, near.1 + before[i], near.2 + after[i]);
            } else if p.z > 2.6 {
                // Farther from the wall than the reach: as it was, up to the quadrature of the
                // raster.
                assert!(
                    (after[i] / before[i] - 1.0).abs().max_element() < 0.01,
                    "{p}: {} {}",
                    before[i],
                    after[i]
                );
                far += 1;
            }
        }
        let change = near.2 / near.1;
        assert!(near.0 > 5 && far > 50, "{} {far}", near.0);
        // The wall takes ambient light away, and gives red back.
        assert!(change.y < 0.8 && change.x > change.y + 0.1, "{change}");
    }
}
