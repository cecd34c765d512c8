//! Cells: cubes of a grid, each for the surfaces that face along one axis.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::math::{Ray, offset_origin};
use crate::run::{RayKind, Run};
use crate::sampling::{BuildReady, Sobol, Stream, Words};
use crate::shading::World;

/// Pixels that are looked through, about.
const PIXELS: f32 = 32_768.0;
/// Where the grid lies, in cells: at no round number, since walls stand at those.
const SHIFT: f32 = 0.371;

/// A surface point.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// Position, lifted off the surface on the seen side.
    pub p: Vec3,
    /// Unit geometric normal of that side.
    pub ng: Vec3,
    /// Unit shading normal.
    pub ns: Vec3,
}

impl Seen {
    /// The middle of some points.
    pub fn mean(points: &[Self]) -> Self {
        let count = points.len().max(1) as f32;
        let sum = |of: fn(&Self) -> Vec3| points.iter().map(of).sum::<Vec3>();
        let first = points.first().map_or(Vec3::Z, |s| s.ns);
        Self {
            p: sum(|s| s.p) / count,
            ng: sum(|s| s.ng).normalize_or(first),
            ns: sum(|s| s.ns).normalize_or(first),
        }
    }
}

/// Which cell a point belongs to.
#[derive(Debug, Default)]
pub(super) struct Grid {
    size: f32,
    /// By the hash of a key.
    index: HashMap<u64, u32, BuildReady>,
    keys: Vec<[i32; 4]>,
}

fn hash(key: [i32; 4]) -> u64 {
    let mut words = Words(0);
    key.iter().for_each(|&k| words.add(u64::from(k as u32)));
    words.0
}

impl Grid {
    fn key(&self, p: Vec3, n: Vec3) -> [i32; 4] {
        let cube = (p / self.size + SHIFT).floor().as_ivec3();
        let axis = n.abs().max_position();
        [cube.x, cube.y, cube.z, 2 * axis as i32 + i32::from(n[axis] < 0.0)]
    }

    pub fn find(&self, p: Vec3, n: Vec3) -> Option<usize> {
        self.index.get(&hash(self.key(p, n))).map(|&c| c as usize)
    }

    /// Cells in the 26 cubes around that of cell `c` which face the same way.
    pub fn around(&self, c: usize) -> impl Iterator<Item = usize> {
        let [x, y, z, axis] = self.keys[c];
        let cubes = (0..27).filter(|&i| i != 13).filter_map(move |i| {
            let key = [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1, axis];
            self.index.get(&hash(key))
        });
        cubes.map(|&beside| beside as usize)
    }
}

/// The cells of what a lattice of pixels sees, and the points in each.
pub(super) fn lattice(world: &World, size: f32, seed: u64, run: &Run) -> (Grid, Vec<Vec<Seen>>) {
    let camera = &world.camera;
    let (width, height) = (camera.width as f32, camera.height as f32);
    let pixels = PIXELS.min(width * height);
    let columns = (pixels * width / height).sqrt().ceil().max(1.0) as u32;
    let rows = (pixels * height / width).sqrt().ceil().max(1.0) as u32;
    let row = |j: u32| {
        let look = |i: u32| {
            let sobol = Sobol::new(seed, Stream::Guide, 1 << 40 | u64::from(j * columns + i));
            let at = glam::Vec2::new(i as f32, j as f32) + sobol.sample_2d(0, 0);
            let pixel = at * glam::Vec2::new(width / columns as f32, height / rows as f32);
            let surface = world.closest(&Ray::new(camera.eye, camera.direction(pixel)))?;
            let p = offset_origin(surface.p, surface.ng, world.diagonal);
            (surface.albedo != Vec3::ZERO).then_some(Seen { p, ng: surface.ng, ns: surface.ns })
        };
        (0..columns).filter_map(look).collect()
    };
    let seen: Vec<Vec<Seen>> = run.install(|| (0..rows).into_par_iter().map(row).collect());
    run.rays.add(RayKind::Primary, u64::from(rows * columns));
    let mut grid = Grid { size, ..Grid::default() };
    let mut members: Vec<Vec<Seen>> = Vec::new();
    for point in seen.into_iter().flatten() {
        let key = grid.key(point.p, point.ns);
        let cell = *grid.index.entry(hash(key)).or_insert_with(|| {
            grid.keys.push(key);
            members.push(Vec::new());
            members.len() as u32 - 1
        });
        members[cell as usize].push(point);
    }
    (grid, members)
}
