//! Cells: cubes of some grids, each for the surfaces that face along one axis.

use std::collections::HashMap;

use glam::Vec3;
use rayon::prelude::*;

use crate::math::{Ray, offset_origin};
use crate::run::{RayKind, Run};
use crate::sampling::{BuildReady, Sobol, Stream, Words};
use crate::shading::World;

/// Pixels that are looked through, about.
const PIXELS: f32 = 32_768.0;
/// Sizes of large cells over that of a small one.
const LARGE: [f32; 2] = [4.0, 16.0];
/// Share that the rays of a cell beside have.
const BESIDE: f32 = 0.5;
/// Most small cells that tell of a large one.
const MOST_TELLERS: usize = 32;
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

/// Cubes of one size.
#[derive(Debug, Default)]
struct Grid {
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
    fn new(size: f32) -> Self {
        Self { size, ..Self::default() }
    }

    fn key(&self, p: Vec3, n: Vec3) -> [i32; 4] {
        let cube = (p / self.size + SHIFT).floor().as_ivec3();
        let axis = n.abs().max_position();
        [cube.x, cube.y, cube.z, 2 * axis as i32 + i32::from(n[axis] < 0.0)]
    }

    fn find(&self, p: Vec3, n: Vec3) -> Option<usize> {
        self.index.get(&hash(self.key(p, n))).map(|&c| c as usize)
    }

    fn find_or_add(&mut self, p: Vec3, n: Vec3) -> usize {
        let key = self.key(p, n);
        *self.index.entry(hash(key)).or_insert_with(|| {
            self.keys.push(key);
            self.keys.len() as u32 - 1
        }) as usize
    }

    /// Cells in the 26 cubes around that of cell `c` which face the same way.
    fn around(&self, c: usize) -> impl Iterator<Item = usize> {
        let [x, y, z, axis] = self.keys[c];
        let cubes = (0..27).filter(|&i| i != 13).filter_map(move |i| {
            let key = [x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1, axis];
            self.index.get(&hash(key))
        });
        cubes.map(|&beside| beside as usize)
    }
}

/// Large cells of one grid.
#[derive(Debug, Default)]
struct Large {
    grid: Grid,
    /// Number of the first one, among all cells.
    first: usize,
    /// Small cells in each.
    within: Vec<Vec<u32>>,
}

/// Small cells, and larger ones for points where no small cell is. Small ones come first in their
/// common numbers.
#[derive(Debug, Default)]
pub(super) struct Cells {
    small: Grid,
    large: Vec<Large>,
    /// Points of the small cells.
    pub members: Vec<Vec<Seen>>,
}

impl Cells {
    /// The cells of what a lattice of pixels sees.
    pub fn new(world: &World, size: f32, seed: u64, run: &Run) -> Self {
        let mut cells = Self { small: Grid::new(size), ..Self::default() };
        let larger = |factor| Large { grid: Grid::new(factor * size), ..Large::default() };
        cells.large = LARGE.map(larger).into();
        for point in lattice(world, seed, run) {
            let small = cells.small.find_or_add(point.p, point.ns);
            if small == cells.members.len() {
                cells.members.push(Vec::new());
                for large in &mut cells.large {
                    let c = large.grid.find_or_add(point.p, point.ns);
                    large.within.resize_with(large.within.len().max(c + 1), Vec::new);
                    large.within[c].push(small as u32);
                }
            }
            cells.members[small].push(point);
        }
        let mut first = cells.members.len();
        for large in &mut cells.large {
            large.first = first;
            first += large.within.len();
        }
        cells
    }

    /// How many, of all sizes.
    pub fn len(&self) -> usize {
        self.large.iter().fold(self.members.len(), |sum, large| sum + large.within.len())
    }

    /// The smallest cell of a point.
    pub fn find(&self, p: Vec3, n: Vec3) -> Option<usize> {
        let of = |large: &Large| large.grid.find(p, n).map(|c| large.first + c);
        self.small.find(p, n).or_else(|| self.large.iter().find_map(of))
    }

    /// Small cells in a large one.
    fn within(&self, c: usize) -> Option<&[u32]> {
        let large = self.large.iter().rfind(|large| large.first <= c)?;
        Some(&large.within[c - large.first])
    }

    /// The middle of a cell.
    pub fn middle(&self, c: usize) -> Seen {
        match self.within(c) {
            None => Seen::mean(&self.members[c]),
            Some(within) => {
                let middle = |&c: &u32| Seen::mean(&self.members[c as usize]);
                Seen::mean(&within.iter().map(middle).collect::<Vec<_>>())
            }
        }
    }

    /// Small cells whose rays tell of a cell, and their weights: its own, or those in it, and those
    /// beside it.
    pub fn tellers(&self, c: usize) -> Vec<(usize, f32)> {
        match self.within(c) {
            None => {
                let around = self.small.around(c).map(|beside| (beside, BESIDE));
                std::iter::once((c, 1.0)).chain(around).collect()
            }
            Some(within) => {
                let step = within.len().div_ceil(MOST_TELLERS);
                within.iter().step_by(step).map(|&c| (c as usize, 1.0)).collect()
            }
        }
    }
}

/// What a lattice of pixels sees.
fn lattice(world: &World, seed: u64, run: &Run) -> Vec<Seen> {
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
    seen.into_iter().flatten().collect()
}
