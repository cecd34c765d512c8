//! Scenes a furnace is blind to: black occluders, hidden plates, a sheet lit on one side, a thin
//! wall.

use glam::Vec3;
use nearfar::length::Length;
use nearfar::method::decompose::far::cluster::{Bounds, cluster};
use nearfar::method::decompose::far::sight::separate;
use nearfar::method::decompose::far::{Bundle, FarField, SampledClusters, Sight, sample};
use nearfar::method::decompose::near::cells::{CellSum, NearTree};
use nearfar::method::decompose::pass3::{Far, Pass3};
use nearfar::method::decompose::{
    Context, DecomposeSettings, Lengths, NearVisibility, Receiver, prepare, render,
};
use nearfar::method::final_gather::{Rays, gather};
use nearfar::method::stage::Inputs;
use nearfar::proxy::{Estimate, Proxy, ProxySettings};
use nearfar::radiometry::Rgb;
use nearfar::record::{RecordSettings, ShadingPoints, camera_samples};
use nearfar::run::Run;
use nearfar::sampling::{Rng, Stream};
use nearfar::scene::{Camera, Light, Mesh, Scene};
use nearfar::sh::form_integral;

use crate::support::{backends, cuboid, grey, quad, world};

fn plate(mesh: &mut Mesh, half: f32, height: f32) -> [Vec3; 4] {
    let c = [
        Vec3::new(-half, height, -half),
        Vec3::new(-half, height, half),
        Vec3::new(half, height, half),
        Vec3::new(half, height, -half),
    ];
    quad(mesh, c, 0);
    c
}

/// Irradiance over π at the origin of a black floor under a white sky with black plates above;
/// alpha holds all the plates.
fn irradiance_under_plates(heights: &[f32], traced: bool) -> (f32, Vec<f32>) {
    let mut mesh = Mesh::default();
    let factors = heights
        .iter()
        .map(|&h| {
            let corners = plate(&mut mesh, 0.4, h);
            (form_integral(&corners, Vec3::Y).abs() / std::f64::consts::PI) as f32
        })
        .collect();
    let scene = Scene {
        meshes: vec![mesh],
        materials: vec![grey(0.0)],
        lights: vec![Light::Sky { radiance: Rgb::ONE }],
        ..Scene::default()
    };
    let w = world(&scene, backends()[0]);
    let proxy = &Proxy::given(&w.geometry, 0.1, |_, _| Rgb::ZERO).unwrap();
    // The far field is sampled from beside the plates, where the sky is all there is: constant, and
    // exactly so through the ridge.
    let mut points = ShadingPoints::default();
    for p in [Vec3::new(50.0, 0.0, 0.0), Vec3::new(0.0, 0.0, -50.0)] {
        points.p.push(p);
        points.ng.push(Vec3::Y);
        points.ns.push(Vec3::Y);
    }
    let (settings, run, alpha) = (DecomposeSettings::default(), Run::new(1).unwrap(), 10.0);
    let context = Context::new(&w, proxy, &settings, 0, &run);
    let bundle =
        Bundle { members: &[0, 1], rays: settings.rays, alpha, stream: Stream::Far, element: 0 };
    let sh = bundle.fit(&context, &points);
    let at = Receiver { p: Vec3::ZERO, ng: Vec3::Y, ns: Vec3::Y, footprint: 0.0 };
    let cells_near = CellSum { tree: &NearTree::new(proxy), traced, alpha };
    let mut rng = Rng::new(0, Stream::Near, 0, 0);
    let total = sh.irradiance(Vec3::Y) + cells_near.near(&context, &sh, &at, &mut rng).0;
    (total.x / std::f32::consts::PI, factors)
}

#[test]
fn a_black_plate_under_a_white_sky() {
    let (e, f) = irradiance_under_plates(&[0.5], false);
    // Rays from 50 units away still meet the plate once in a few thousand: 1e-3.
    assert!((e - (1.0 - f[0])).abs() < 2e-3, "{e} {}", 1.0 - f[0]);
}

#[test]
fn a_hidden_plate_is_subtracted_twice_unless_visibility_is_traced() {
    let (assumed, f) = irradiance_under_plates(&[0.5, 0.7], false);
    assert!(
        (assumed - (1.0 - f[0] - f[1])).abs() < 3e-3,
        "the course's assumption: {assumed} {}",
        1.0 - f[0] - f[1]
    );
    let (traced, _) = irradiance_under_plates(&[0.5, 0.7], true);
    assert!((traced - (1.0 - f[0])).abs() < 3e-3, "traced: {traced} {}", 1.0 - f[0]);
}

/// The sum over near cells needs cells.
fn with_cells() -> ProxySettings {
    ProxySettings { estimate: Some(Estimate::Gather), ..ProxySettings::default() }
}

fn picture(scene: &Scene, decompose: &DecomposeSettings) -> nearfar::film::Film {
    let w = world(scene, *backends().last().unwrap());
    let (photon, record, direct) =
        (with_cells(), RecordSettings { spp: 4, ..RecordSettings::default() }, Default::default());
    let near_cell = decompose.lengths(w.diagonal).near_cell;
    render(
        &w,
        decompose,
        Inputs { near_cell, photon: &photon, record: &record, direct: &direct, seed: 0 },
        &Run::new(2).unwrap(),
    )
    .unwrap()
    .film
}

fn mean(film: &nearfar::film::Film, layer: &str, keep: impl Fn(usize) -> bool) -> f32 {
    let values: Vec<f32> = film
        .rgb(layer)
        .unwrap()
        .iter()
        .enumerate()
        .filter(|(i, _)| keep(*i))
        .map(|(_, c)| c.x)
        .collect();
    values.iter().sum::<f32>() / values.len() as f32
}

/// A sheet close above the floor, lit from above: the floor under it must not see the lit side.
#[test]
fn a_sheet_lit_on_one_side_does_not_shine_through() {
    let scene = |two_sheets: bool| {
        let mut mesh = Mesh::default();
        plate(&mut mesh, 2.0, 0.0);
        plate(&mut mesh, 1.0, 0.08);
        if two_sheets {
            plate(&mut mesh, 1.0, 0.081);
        }
        // Black sides close the gap under the sheet, so that no light gets in at all.
        for (a, b) in [
            ((-1.0, -1.0), (1.0, -1.0)),
            ((1.0, -1.0), (1.0, 1.0)),
            ((1.0, 1.0), (-1.0, 1.0)),
            ((-1.0, 1.0), (-1.0, -1.0)),
        ] {
            let at = |(x, z): (f32, f32), y: f32| Vec3::new(x, y, z);
            quad(&mut mesh, [at(a, -0.01), at(b, -0.01), at(b, 0.08), at(a, 0.08)], 1);
        }
        Scene {
            camera: Camera {
                eye: Vec3::new(0.0, 0.04, 0.0),
                target: Vec3::new(0.3, 0.0, 0.0),
                up: Vec3::Y,
                vfov_deg: 40.0,
                width: 16,
                height: 16,
            },
            meshes: vec![mesh],
            materials: vec![grey(0.8), grey(0.0)],
            lights: vec![Light::Sun {
                direction_to_sun: Vec3::Y,
                irradiance: Rgb::splat(100.0),
                angular_radius_deg: 0.0,
            }],
            ..Scene::default()
        }
    };
    let film = picture(
        &scene(false),
        &DecomposeSettings { alpha: Length::Units(0.3), ..DecomposeSettings::default() },
    );
    // The sheet's lit side has radiosity 80. Floor cells that straddle the black sides hold one
    // radiosity for their lit and their dark part: a thousandth is allowed for them, and nothing
    // for the sheet.
    assert!(mean(&film, "", |_| true) < 0.08, "{}", mean(&film, "", |_| true));
    let film = picture(
        &scene(true),
        &DecomposeSettings { alpha: Length::Units(0.3), ..DecomposeSettings::default() },
    );
    assert!(
        mean(&film, "", |_| true) < 25.0,
        "the assumed-visible sum does see a lit sheet behind a sheet; it must stay bounded"
    );
}

/// Points of a picture that `dark` names and that receive light, with and without the test of
/// sight; nothing there sees a surface that `bright` lets glow.
fn leaks(scene: &Scene, bright: impl Fn(Vec3) -> bool, dark: impl Fn(Vec3) -> bool) -> [usize; 3] {
    let w = world(scene, *backends().last().unwrap());
    let run = Run::new(2).unwrap();
    let glow = |p: Vec3, _: Vec3| if bright(p) { Rgb::ONE } else { Rgb::ZERO };
    let proxy = &Proxy::given(&w.geometry, 0.05, glow).unwrap();
    let record = RecordSettings { spp: 1, ..RecordSettings::default() };
    let points = camera_samples(&w, &record, &Default::default(), 0, &run).unwrap().points;
    let cluster_radius = Some(Length::Units(0.1));
    let settings = DecomposeSettings {
        alpha: Length::Units(0.2),
        cluster_radius,
        rays: 256,
        ..DecomposeSettings::default()
    };
    let context = Context::new(&w, proxy, &settings, 0, &run);
    let Lengths { cluster_radius: radius, blend_radius, .. } = context.lengths;
    let bounds = Bounds { radius, normal_cos: settings.cluster_normal_cos };
    let plain = cluster(&points, (0..points.len() as u32).collect(), bounds, 0);
    let count = |sight: bool| {
        let clusters = if sight { separate(&w, &points, &plain) } else { plain.clone() };
        let (sh, _) = sample(&context, &points, &clusters).unwrap();
        let sampled = SampledClusters { clusters, sh };
        let field = FarField::new(&sampled, blend_radius, settings.blend_normal_power);
        let field = if sight { field.with_sight(Sight::new(&w, &sampled.clusters)) } else { field };
        let mut pass3 = Pass3::new(context, &sampled).with_far(Far::Blended(field));
        let found = pass3.irradiance(&points).unwrap();
        found.iter().zip(&points.p).filter(|(f, p)| dark(**p) && f.total.x > 1e-3).count()
    };
    [count(false), count(true), points.p.iter().filter(|p| dark(**p)).count()]
}

#[test]
fn samples_do_not_leak_through_a_wall_or_a_board() {
    // Every room has walls of its own, so that no cell belongs to two of them.
    let without = |mut mesh: Mesh, axis: usize, at: f32| {
        let positions = mesh.positions.clone();
        mesh.triangles.retain(|t| !t.iter().all(|&i| positions[i as usize][axis] == at));
        mesh.materials.truncate(mesh.triangles.len());
        mesh
    };
    // Two rooms without a ceiling, seen from above; between them a wall of 1 cm, whose inside is
    // neither bright nor dark.
    let mut rooms = Mesh::default();
    cuboid(&mut rooms, Vec3::ZERO, Vec3::ONE, 0, true);
    cuboid(&mut rooms, Vec3::new(1.01, 0.0, 0.0), Vec3::new(2.01, 1.0, 1.0), 0, true);
    let rooms = without(rooms, 1, 1.0);
    let scene = |mesh: Mesh, eye: Vec3, target: Vec3, vfov_deg: f32| Scene {
        camera: Camera {
            eye,
            target,
            up: Vec3::new(0.0, 0.1, 1.0),
            vfov_deg,
            width: 40,
            height: 40,
        },
        meshes: vec![Mesh { sides: nearfar::scene::Sides::Two, ..mesh }],
        materials: vec![grey(0.7)],
        ..Scene::default()
    };
    let found = leaks(
        &scene(rooms, Vec3::new(1.005, 3.0, 0.5), Vec3::new(1.005, 0.0, 0.5), 36.0),
        |p| p.x < 1.005,
        |p| p.x > 1.01,
    );
    eprintln!("wall: {found:?}");
    // The plain blend does leak: the test can fail.
    // The filter asks clusters for sight, not points: two points of 609 at the foot of the wall
    // still share across it.
    assert!(found[0] > 20 && found[1] <= 3 && found[2] > 500, "wall: {found:?}");

    // A shelf, open in front: a board of 1 cm, 4 cm above a dark floor.
    let mut shelf = Mesh::default();
    cuboid(&mut shelf, Vec3::ZERO, Vec3::new(1.0, 0.04, 0.5), 0, true);
    cuboid(&mut shelf, Vec3::new(0.0, 0.05, 0.0), Vec3::new(1.0, 0.4, 0.5), 0, true);
    let shelf = without(shelf, 2, 0.5);
    let found = leaks(
        &scene(shelf, Vec3::new(0.5, 0.09, 1.2), Vec3::new(0.5, 0.04, 0.25), 24.0),
        |p| p.y > 0.045,
        |p| p.y < 0.04,
    );
    eprintln!("board: {found:?}");
    assert!(found[0] > 20 && found[1] == 0 && found[2] > 100, "board: {found:?}");
}

/// A lit room and a dark one behind a wall of 1 cm, much thinner than alpha.
#[test]
fn a_thin_wall_keeps_the_dark_room_dark_when_visibility_is_traced() {
    let mut mesh = Mesh::default();
    cuboid(&mut mesh, Vec3::ZERO, Vec3::new(1.0, 1.0, 1.0), 0, true);
    cuboid(&mut mesh, Vec3::new(1.01, 0.0, 0.0), Vec3::new(2.0, 1.0, 1.0), 0, true);
    let scene = Scene {
        camera: Camera {
            eye: Vec3::new(1.9, 0.5, 0.5),
            target: Vec3::new(1.0, 0.5, 0.5),
            up: Vec3::Y,
            vfov_deg: 70.0,
            width: 24,
            height: 24,
        },
        meshes: vec![mesh],
        materials: vec![grey(0.7)],
        lights: vec![Light::Quad {
            corner: Vec3::new(0.3, 0.99, 0.3),
            edge1: Vec3::X * 0.3,
            edge2: Vec3::Z * 0.3,
            radiance: Rgb::splat(20.0),
        }],
        ..Scene::default()
    };
    // The lit room shows a radiance of about 1.5; the photon regions of cells next to the wall
    // share flux across it: a hundredth.
    for near_visibility in [NearVisibility::Assumed, NearVisibility::Traced] {
        let film = picture(
            &scene,
            &DecomposeSettings {
                alpha: Length::Units(0.15),
                near_visibility,
                ..DecomposeSettings::default()
            },
        );
        let dark = mean(&film, "", |_| true);
        assert!(dark < 1.5e-2, "{near_visibility:?}: {dark}");
    }
}

/// Where the sum over cells that are assumed visible is off by more than 5 %, the default is right
/// on average. The truth is a gather through the same proxy, so that the near and far field alone
/// are judged. Hairball: within 2 %. Slats: within 3 %, for 48 × 48 pixels record too few points
/// between the slats for their far field (2.4 % too dark here, in every near mode alike; against
/// path tracing at 96 × 96 2.7 %, and 2.1 % with every pixel recorded, 5 bands and 2048 rays).
#[test]
fn surfaces_that_hide_each_other() {
    for (name, bound) in [("nested-slats", 0.03), ("hairball", 0.02)] {
        let file = std::path::Path::new(env!("CARGO_MANIFEST_DIR"))
            .join(format!("scenes/{name}/{name}.toml"));
        let set = [
            ("camera.width".to_owned(), "48".to_owned()),
            ("camera.height".to_owned(), "48".to_owned()),
        ];
        let w =
            world(&nearfar::load::load(&file, &set).unwrap().scene, *backends().last().unwrap());
        let run = Run::new(2).unwrap();
        let default = DecomposeSettings::default();
        let (photon, record, direct) = (
            with_cells(),
            RecordSettings { spp: 1, ..RecordSettings::default() },
            Default::default(),
        );
        let inputs = Inputs {
            near_cell: default.lengths(w.diagonal).near_cell,
            photon: &photon,
            record: &record,
            direct: &direct,
            seed: 0,
        };
        let stage = prepare(&w, &default, inputs, &run).unwrap().stage;
        let truth =
            gather(&w, &stage.proxy, &stage.samples.points, Rays::cosine(1024), 1, &run).unwrap();
        let truth = stage.samples.reflect(&truth);
        let indirect = |near_visibility| {
            render(&w, &DecomposeSettings { near_visibility, ..default.clone() }, inputs, &run)
                .unwrap()
                .film
                .rgb("indirect")
                .unwrap()
        };
        let (assumed, found) =
            (indirect(NearVisibility::Assumed), indirect(default.near_visibility));
        let off: Vec<usize> = (0..truth.len())
            .filter(|&i| {
                (assumed[i] - truth[i]).element_sum().abs() > 0.05 * truth[i].element_sum()
            })
            .collect();
        let bias = |image: &[Rgb]| {
            let sum = |v: &[Rgb]| off.iter().map(|&i| f64::from(v[i].element_sum())).sum::<f64>();
            sum(image) / sum(&truth) - 1.0
        };
        let (assumed, found) = (bias(&assumed), bias(&found));
        eprintln!(
            "{name}: {} of {} pixels off, bias {assumed:+.4} assumed, {found:+.4} default",
            off.len(),
            truth.len()
        );
        assert!(off.len() > 100 && found.abs() < bound, "{name}: {} pixels, {found}", off.len());
    }
}
