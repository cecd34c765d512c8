//! The decomposition's exact limits and invariances.

use glam::Vec3;
use nearfar::length::Length;
use nearfar::method::decompose::far::cluster::{Bounds, cluster};
use nearfar::method::decompose::far::{Bundle, FarField, SampledClusters, sample};
use nearfar::method::decompose::near::cells::{CellSum, NearTree};
use nearfar::method::decompose::pass3::{Far, Pass3};
use nearfar::method::decompose::{Context, DecomposeSettings, NearHits, Receiver, render};
use nearfar::method::stage::Inputs;
use nearfar::proxy::{Landing, Proxy};
use nearfar::radiometry::Rgb;
use nearfar::record::{RecordSettings, camera_samples};
use nearfar::run::Run;
use nearfar::sampling::{Rng, Sobol, Stream, sample_uniform_hemisphere};
use nearfar::sh::{basis, form_integral};
use nearfar::shading::World;
use nearfar::tessellate::Side;

use crate::support::{backends, small_room, world};

/// A proxy of random radiosity.
fn random(w: &World, near_cell: f32) -> Proxy {
    let mut rng = Rng::new(3, Stream::Test, 0, 0);
    let glow = |_, _| Rgb::new(rng.next_f32(), rng.next_f32(), 0.5);
    Proxy::given(&w.geometry, near_cell, glow).unwrap()
}

/// Least squares with the squared-Laplacian ridge by Gaussian elimination: written apart from the
/// library's Cholesky.
fn fit_apart(samples: &[(Vec3, f32)], ridge: f64) -> [f64; 9] {
    let mut a = [[0.0f64; 10]; 9];
    for (w, value) in samples {
        let y = basis(*w);
        for i in 0..9 {
            for j in 0..9 {
                a[i][j] += f64::from(y[i]) * f64::from(y[j]);
            }
            a[i][9] += f64::from(y[i]) * f64::from(*value);
        }
    }
    for (i, row) in a.iter_mut().enumerate() {
        let l: f64 = [0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0, 2.0, 2.0][i];
        row[i] +=
            ridge * samples.len() as f64 * (l * (l + 1.0)).powi(2) / (4.0 * std::f64::consts::PI);
    }
    for i in 0..9 {
        let pivot = (i..9).max_by(|&p, &q| a[p][i].abs().total_cmp(&a[q][i].abs())).unwrap();
        a.swap(i, pivot);
        let pivot_row = a[i];
        for (r, row) in a.iter_mut().enumerate() {
            if r != i {
                let f = row[i] / pivot_row[i];
                for k in 0..10 {
                    row[k] -= f * pivot_row[k];
                }
            }
        }
    }
    std::array::from_fn(|i| a[i][9] / a[i][i])
}

/// alpha = 0: nothing is near, so the method is an SH gather, here written a second time from the
/// hits up.
#[test]
fn alpha_zero_is_a_plain_gather() {
    let scene = small_room();
    let w = world(&scene, backends()[0]);
    let run = Run::new(2).unwrap();
    let proxy = &random(&w, 0.1);
    let settings = DecomposeSettings {
        alpha: Length::Units(0.0),
        cluster_radius: Some(Length::Units(0.2)),
        rays: 100,
        pool_radius: Some(Length::Units(0.0)),
        ..DecomposeSettings::default()
    };
    let samples = camera_samples(
        &w,
        &RecordSettings { spp: 1, ..RecordSettings::default() },
        &Default::default(),
        0,
        &run,
    )
    .unwrap();
    let points = &samples.points;
    let bounds = Bounds { radius: 0.2, normal_cos: 0.7 };
    let clusters = cluster(points, (0..points.len() as u32).collect(), bounds, 0);
    let context = Context::new(&w, proxy, &settings, 7, &run);
    let (sh, _) = sample(&context, points, &clusters).unwrap();
    let sampled = SampledClusters { clusters, sh };
    let found = Pass3::new(context, &sampled)
        .with_far(Far::Blended(FarField::new(&sampled, 0.3, 4.0)))
        .irradiance(points)
        .unwrap();
    let clusters = &sampled.clusters;

    let apart: Vec<[f64; 9]> = (0..clusters.len())
        .map(|c| {
            let (sobol, members) = (Sobol::new(7, Stream::Far, c as u64), clusters.members_of(c));
            let hits: Vec<(Vec3, f32)> = (0..100)
                .filter_map(|r| {
                    let m =
                        members[(sobol.sample_1d(r, 0) * members.len() as f32) as usize] as usize;
                    let wi = nearfar::math::Frame::from_normal(points.ns[m])
                        .world_from_local(sample_uniform_hemisphere(sobol.sample_2d(r, 1)));
                    if wi.dot(points.ng[m]) <= 0.0 {
                        return None;
                    }
                    let s = w.closest(&nearfar::math::Ray::new(points.p[m], wi))?;
                    Some((
                        wi,
                        proxy.read(&w, &Landing::from(&s)).radiosity.x / std::f32::consts::PI,
                    ))
                })
                .collect();
            fit_apart(&hits, settings.ridge)
        })
        .collect();
    let band = [std::f64::consts::PI, 2.0 * std::f64::consts::PI / 3.0, std::f64::consts::PI / 4.0];
    for i in (0..points.len()).step_by(7) {
        let (p, n) = (points.p[i], points.ns[i]);
        let (mut e, mut sum) = (0.0f64, 0.0f64);
        for (c, coefficients) in apart.iter().enumerate() {
            let d = clusters.center[c].distance(p) / 0.3;
            let weight = if d < 1.0 {
                f64::from((1.0 - d * d).powi(2) * clusters.normal[c].dot(n).max(0.0).powi(4))
            } else {
                0.0
            };
            e += weight
                * (0..9)
                    .map(|k| {
                        band[[0, 1, 1, 1, 2, 2, 2, 2, 2][k]]
                            * coefficients[k]
                            * f64::from(basis(n)[k])
                    })
                    .sum::<f64>();
            sum += weight;
        }
        assert!(sum > 0.0);
        let expected = (e / sum).max(0.0);
        assert!(
            (f64::from(found[i].total.x) - expected).abs() < 1e-3 * expected.max(0.1),
            "{i}: {} {expected}",
            found[i].total.x
        );
        assert_eq!(found[i].near_cells, 0);
    }
}

/// alpha = ∞ with "ignore" in a closed room: every ray passes through everything, so the sum over
/// all facing cells is all there is.
#[test]
fn alpha_infinity_is_the_sum_over_all_cells() {
    let w = world(&small_room(), backends()[0]);
    let proxy = &random(&w, 0.2);
    let settings = DecomposeSettings {
        alpha: Length::Units(f32::INFINITY),
        near_hits: NearHits::Ignore,
        rays: 16,
        ..DecomposeSettings::default()
    };
    let run = Run::new(2).unwrap();
    let samples = camera_samples(
        &w,
        &RecordSettings { spp: 1, ..RecordSettings::default() },
        &Default::default(),
        0,
        &run,
    )
    .unwrap();
    let tree = NearTree::new(proxy);
    let context = Context::new(&w, proxy, &settings, 0, &run);
    let mut rng = Rng::new(0, Stream::Near, 0, 0);
    for i in (0..samples.points.len()).step_by(53) {
        let (p, n) = (samples.points.p[i], samples.points.ns[i]);
        let alpha = f32::INFINITY;
        let bundle = Bundle {
            members: &[i as u32],
            rays: 16,
            alpha,
            stream: Stream::Far,
            element: i as u64,
        };
        let sh = bundle.fit(&context, &samples.points);
        let cells_near = CellSum { tree: &tree, traced: false, alpha };
        let at = Receiver::of(&samples.points, i);
        let total = sh.irradiance(n) + cells_near.near(&context, &sh, &at, &mut rng).0;
        let mut expected = Rgb::ZERO;
        for f in proxy.facets() {
            let v = f.corners.map(|q| q - p);
            let facing = f.normal().dot(-v[0]);
            if facing.abs() <= 1e-3 * proxy.piece_size() || (facing < 0.0 && f.one_sided) {
                continue;
            }
            let side = if facing > 0.0 { Side::Front } else { Side::Back };
            let form_factor = form_integral(&v, n).abs() / std::f64::consts::PI;
            expected += f.radiosity_of(side) * form_factor as f32;
        }
        assert!(
            (total - expected).abs().max_element() < 2e-3 * expected.max_element(),
            "{total} {expected}"
        );
    }
}

fn picture(w: &World, threads: usize) -> nearfar::film::Film {
    let run = Run::new(threads).unwrap();
    let decompose =
        DecomposeSettings { alpha: Length::Percent(8.0), rays: 64, ..DecomposeSettings::default() };
    let (photon, record, direct) = Default::default();
    let near_cell = decompose.lengths(w.diagonal).near_cell;
    render(
        w,
        &decompose,
        Inputs { near_cell, photon: &photon, record: &record, direct: &direct, seed: 5 },
        &run,
    )
    .unwrap()
    .film
}

#[test]
fn one_two_and_eight_threads_give_the_same_bits() {
    for backend in backends() {
        let w = world(&small_room(), backend);
        let one = picture(&w, 1);
        for threads in [2, 8] {
            let many = picture(&w, threads);
            for (name, values) in &one.channels {
                assert!(
                    values
                        .iter()
                        .zip(&many.channels[name])
                        .all(|(a, b)| a.to_bits() == b.to_bits()),
                    "{backend:?} {threads} threads: layer {name}"
                );
            }
        }
    }
}
