//! The timing comparison of ray backends: the same recorded rays through each, one and all threads,
//! answers compared.
//!
//! Method     per stream, every contender runs once a round, in turn, so that a busy machine hurts
//!            all alike; the median of the rounds counts. Contenders: Embree by packets of 1, 8 and
//!            16; the pure-Rust BVH; and, as a yardstick of the border, a C++ loop on Embree's own
//!            API at the same widths. All with the settings that renders use. Guarantees every
//!            contender gets the same rays in the same order, and writes a hit (t, u, v, triangle)
//!            or a flag for each. Answers are compared ray by ray with the first contender's: a hit
//!            against a miss, or t apart by more than 1e-4 of itself, counts as differing (of the
//!            C++ loop the number of hits is compared). A handful may differ: on a triangle much
//!            larger than its distance from the ray's origin, the BVH knows t to some 1e-5 of the
//!            triangle's size, Embree to the last digits.
//! Not        a measure of build quality settings, nor of memory.

use std::time::Instant;

use rayon::prelude::*;
use serde::Serialize;

use super::streams::{Stream, record};
use crate::accel::{Backend, RayQuery, build};
use crate::error::Result;
use crate::math::Hit;
use crate::run::Run;
use crate::shading::World;

/// Rays handed to a backend at once when several threads work.
const BLOCK: usize = 4096;

/// What is measured.
#[derive(Clone, Copy, Debug)]
pub struct BackendBenchSettings {
    /// Rays of each kind.
    pub rays: usize,
    /// Runs of which the median counts.
    pub rounds: usize,
    /// Seed of the recorded rays.
    pub seed: u64,
}

impl Default for BackendBenchSettings {
    fn default() -> Self {
        Self { rays: 400_000, rounds: 5, seed: 0 }
    }
}

/// One contender on one stream.
#[derive(Clone, Debug, Serialize)]
pub struct Rate {
    /// Kind of rays.
    pub stream: &'static str,
    /// Who answered.
    pub backend: String,
    /// Packet width.
    pub width: usize,
    /// Million rays per second on one thread, median.
    pub mrays_1: f64,
    /// Million rays per second on all threads, median.
    pub mrays_n: f64,
    /// Rays that hit.
    pub hits: usize,
    /// Rays whose answer differs from the first contender's.
    pub differing: usize,
}

/// Build time of one backend.
#[derive(Clone, Debug, Serialize)]
pub struct BuildTime {
    /// Whose.
    pub backend: String,
    /// Seconds on one thread; none for the C++ loop.
    pub seconds_1: Option<f64>,
    /// Seconds on all threads.
    pub seconds_n: f64,
}

/// All that was measured.
#[derive(Clone, Debug, Serialize)]
pub struct BackendReport {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Threads that count as "all".
    pub threads: usize,
    /// Rays of each kind.
    pub rays: usize,
    /// Rounds of which the median counts.
    pub rounds: usize,
    /// Build times.
    pub builds: Vec<BuildTime>,
    /// Rates, by stream.
    pub rates: Vec<Rate>,
    /// Why there is no C++ loop, if there is none.
    pub no_native_loop: Option<String>,
}

struct Contender {
    name: String,
    width: usize,
    scene: Option<usize>,
}

/// Measures every backend on the rays of `world`, with the threads of `run`.
///
/// # Errors
/// When a backend cannot be built, or the user asks to stop.
pub fn bench_backends(
    world: &World,
    settings: &BackendBenchSettings,
    run: &Run,
) -> Result<BackendReport> {
    let threads = run.threads();
    let streams = run.install(|| record(world, settings.rays, settings.seed));
    let mut builds = Vec::new();
    let mut scenes: Vec<Box<dyn RayQuery>> = Vec::new();
    let mut contenders = Vec::new();
    let backends: &[(Backend, &str, &[usize])] = if cfg!(feature = "embree") {
        &[(Backend::Embree, "embree", &[1, 8, 16]), (Backend::Bvh, "bvh", &[1])]
    } else {
        &[(Backend::Bvh, "bvh", &[1])]
    };
    for &(backend, name, widths) in backends {
        let timed = |threads| -> Result<(f64, Box<dyn RayQuery>)> {
            let start = Instant::now();
            let scene = build(backend, &world.geometry, threads)?;
            Ok((start.elapsed().as_secs_f64(), scene))
        };
        let (seconds_1, _) = timed(1)?;
        let (seconds_n, scene) = timed(threads)?;
        builds.push(BuildTime { backend: name.into(), seconds_1: Some(seconds_1), seconds_n });
        contenders.extend(widths.iter().map(|&width| Contender {
            name: name.into(),
            width,
            scene: Some(scenes.len()),
        }));
        scenes.push(scene);
    }
    let (mut native, no_native_loop) = start_native(world, &streams, threads);
    if let Some(native) = &native {
        builds.push(BuildTime {
            backend: "C++ loop".into(),
            seconds_1: None,
            seconds_n: native.build_seconds,
        });
        contenders.extend([1, 8, 16].map(|width| Contender {
            name: "C++ loop".into(),
            width,
            scene: None,
        }));
    }
    let phase = run.phase("bench", (streams.len() * settings.rounds) as u64);
    let mut rates = Vec::new();
    for (index, stream) in streams.iter().enumerate() {
        let mut seconds = vec![[Vec::new(), Vec::new()]; contenders.len()];
        let mut answers: Vec<Answers> = contenders.iter().map(|_| Answers::new(stream)).collect();
        for _ in 0..settings.rounds {
            run.check()?;
            for (slot, threads) in [1, threads].into_iter().enumerate() {
                for ((contender, seconds), answers) in
                    contenders.iter().zip(&mut seconds).zip(&mut answers)
                {
                    let took = match contender.scene {
                        Some(scene) => run.install(|| {
                            answers.time(&*scenes[scene], stream, contender.width, threads)
                        }),
                        None => {
                            answers.time_native(native.as_mut(), index, contender.width, threads)
                        }
                    };
                    seconds[slot].push(took);
                }
            }
            phase.advance(1);
        }
        let mrays = |seconds: &mut Vec<f64>| stream.rays.len() as f64 / median(seconds) * 1e-6;
        for ((contender, seconds), given) in contenders.iter().zip(&mut seconds).zip(&answers) {
            let [one, all] = seconds;
            rates.push(Rate {
                stream: stream.name,
                backend: contender.name.clone(),
                width: contender.width,
                mrays_1: mrays(one),
                mrays_n: mrays(all),
                hits: given.hits(),
                differing: given.differing(&answers[0]),
            });
        }
    }
    Ok(BackendReport {
        triangles: world.geometry.len(),
        threads,
        rays: settings.rays,
        rounds: settings.rounds,
        builds,
        rates,
        no_native_loop,
    })
}

#[cfg(feature = "embree")]
use super::native_loop::NativeLoop;

#[cfg(feature = "embree")]
fn start_native(
    world: &World,
    streams: &[Stream],
    threads: usize,
) -> (Option<NativeLoop>, Option<String>) {
    match NativeLoop::start(&world.geometry, streams, threads) {
        Ok(native) => (Some(native), None),
        Err(reason) => (None, Some(reason)),
    }
}

/// Without Embree there is no loop to compare with.
#[cfg(not(feature = "embree"))]
struct NativeLoop {
    build_seconds: f64,
}

#[cfg(not(feature = "embree"))]
impl NativeLoop {
    fn run(&mut self, _: usize, _: usize, _: usize) -> std::result::Result<(f64, usize), String> {
        Err(String::new())
    }
}

#[cfg(not(feature = "embree"))]
fn start_native(_: &World, _: &[Stream], _: usize) -> (Option<NativeLoop>, Option<String>) {
    (None, Some("built without the feature `embree`".into()))
}

/// What a contender answered, in room that is reused from run to run.
struct Answers {
    closest: Vec<Option<Hit>>,
    any: Vec<bool>,
    native_hits: Option<usize>,
}

impl Answers {
    fn new(stream: &Stream) -> Self {
        let n = stream.rays.len();
        Self {
            closest: vec![None; if stream.any { 0 } else { n }],
            any: vec![false; if stream.any { n } else { 0 }],
            native_hits: None,
        }
    }

    fn time(&mut self, scene: &dyn RayQuery, stream: &Stream, width: usize, threads: usize) -> f64 {
        let block = if threads == 1 { stream.rays.len() } else { BLOCK };
        let start = Instant::now();
        match (stream.any, threads) {
            (true, 1) => scene.occluded_batch(&stream.rays, &mut self.any, width),
            (false, 1) => scene.closest_batch(&stream.rays, &mut self.closest, width),
            (true, _) => {
                stream
                    .rays
                    .par_chunks(block)
                    .zip(self.any.par_chunks_mut(block))
                    .for_each(|(r, a)| scene.occluded_batch(r, a, width));
            }
            (false, _) => {
                stream
                    .rays
                    .par_chunks(block)
                    .zip(self.closest.par_chunks_mut(block))
                    .for_each(|(r, h)| scene.closest_batch(r, h, width));
            }
        }
        start.elapsed().as_secs_f64()
    }

    fn time_native(
        &mut self,
        native: Option<&mut NativeLoop>,
        stream: usize,
        width: usize,
        threads: usize,
    ) -> f64 {
        match native.map(|n| n.run(stream, width, threads)) {
            Some(Ok((seconds, hits))) => {
                self.native_hits = Some(hits);
                seconds
            }
            _ => f64::NAN,
        }
    }

    fn hits(&self) -> usize {
        self.native_hits.unwrap_or_else(|| {
            self.closest.iter().flatten().count() + self.any.iter().filter(|a| **a).count()
        })
    }

    fn differing(&self, other: &Self) -> usize {
        if self.native_hits.is_some() {
            return self.hits().abs_diff(other.hits());
        }
        let apart = |(a, b): &(&Option<Hit>, &Option<Hit>)| match (a, b) {
            (Some(a), Some(b)) => (a.t - b.t).abs() > 1e-4 * b.t.abs(),
            (None, None) => false,
            _ => true,
        };
        self.closest.iter().zip(&other.closest).filter(apart).count()
            + self.any.iter().zip(&other.any).filter(|(a, b)| a != b).count()
    }
}

fn median(values: &mut [f64]) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

impl std::fmt::Display for BackendReport {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let n = self.threads;
        writeln!(
            f,
            "{} triangles, {} rays of each kind, median of {} alternating rounds",
            self.triangles, self.rays, self.rounds
        )?;
        writeln!(f, "\n{:<12} {:>14} {:>14}", "build", "s, 1 thread", format!("s, {n} threads"))?;
        for b in &self.builds {
            let one = b.seconds_1.map_or_else(|| "-".into(), |s| format!("{s:.3}"));
            writeln!(f, "{:<12} {one:>14} {:>14.3}", b.backend, b.seconds_n)?;
        }
        let head = (
            "rays",
            "backend",
            "packet",
            "Mrays/s, 1 thread",
            format!("Mrays/s, {n} threads"),
            "hits",
            "differing",
            "of C++ loop",
        );
        writeln!(
            f,
            "\n{:<8} {:<9} {:>6} {:>18} {:>19} {:>9} {:>9} {:>12}",
            head.0, head.1, head.2, head.3, head.4, head.5, head.6, head.7
        )?;
        for r in &self.rates {
            let native = self.rates.iter().find(|o| {
                o.stream == r.stream
                    && o.backend == "C++ loop"
                    && o.width == r.width
                    && r.backend == "embree"
            });
            let share = native
                .map_or_else(String::new, |o| format!("{:.1} %", 100.0 * r.mrays_1 / o.mrays_1));
            writeln!(
                f,
                "{:<8} {:<9} {:>6} {:>18.3} {:>19.3} {:>9} {:>9} {share:>12}",
                r.stream, r.backend, r.width, r.mrays_1, r.mrays_n, r.hits, r.differing
            )?;
        }
        if let Some(reason) = &self.no_native_loop {
            writeln!(f, "\nno C++ loop to compare with: {reason}")?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Mesh, Scene};

    #[test]
    fn every_backend_answers_alike() {
        let mut mesh = Mesh::default();
        for i in 0..200 {
            let p = glam::Vec3::new(
                (i % 20) as f32 * 0.1 - 1.0,
                (i / 20) as f32 * 0.2 - 1.0,
                (i * 7 % 11) as f32 * 0.1,
            );
            mesh.positions.extend([
                p,
                p + glam::Vec3::X * 0.3,
                p + glam::Vec3::new(0.1, 0.3, 0.05),
            ]);
            mesh.triangles.push([3 * i, 3 * i + 1, 3 * i + 2]);
            mesh.materials.push(0);
        }
        let scene = Scene {
            meshes: vec![mesh],
            materials: vec![crate::scene::Material::default()],
            ..Scene::default()
        };
        let run = Run::new(2).unwrap();
        let world = World::new(&scene, Backend::Bvh, &run).unwrap();
        let report = bench_backends(
            &world,
            &BackendBenchSettings { rays: 20_000, rounds: 1, seed: 1 },
            &run,
        )
        .unwrap();
        assert!(
            !report.rates.is_empty()
                && report.rates.iter().all(|r| r.mrays_1 > 0.0 && r.mrays_n > 0.0),
            "{report}"
        );
        for rate in &report.rates {
            assert!(rate.hits > 0 && rate.differing <= 4, "{rate:?}");
        }
        assert!(report.to_string().contains("gather"));
    }

    #[test]
    fn the_middle_of_the_runs_counts() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
    }
}
