//! Subdivision surfaces with all that their cages can hold: a row of cubes whose rims are creases
//! of growing sharpness, a frame of high genus, a turned vase with sharp rims and an open mouth,
//! and an open sheet with a sharp fold, on a floor.
//!
//! The unit of length is a cube of the row. Cages only; how fine they become is up to the
//! `subdivision` of the mesh entry.

use std::f32::consts::TAU;

use glam::{IVec3, Vec2, Vec3};
use serde::Deserialize;

use super::solid::Solids;
use super::{Generated, diffuse};
use crate::scene::{Cage, INFINITE_SHARPNESS};

/// The scene has no parameters.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct SubdivisionParameters {}

/// Makes the floor and the cages.
///
/// # Errors
/// None.
pub fn subdivision(_: &SubdivisionParameters) -> Result<Generated, String> {
    let mut s = Solids::default();
    s.cuboid(Vec3::new(-6.0, -0.5, -6.0), Vec3::new(8.0, 0.0, 6.0), 0);
    let mut cage = Cage::default();
    for (i, sharpness) in [0.0, 1.0, 2.0, 3.0, INFINITE_SHARPNESS].into_iter().enumerate() {
        cube(&mut cage, Vec3::new(i as f32 * 1.5, 0.0, 2.2), sharpness);
    }
    frame(&mut cage, Vec3::new(4.0, 0.0, -1.2), 0.75);
    vase(&mut cage, Vec3::new(0.0, 0.0, -0.6));
    sheet(&mut cage, Vec3::new(2.4, 0.0, -3.2));
    let colors: [(&str, [f32; 3]); 5] = [
        ("floor", [0.7; 3]),
        ("cubes", [0.75, 0.55, 0.25]),
        ("frame", [0.25, 0.45, 0.7]),
        ("vase", [0.7, 0.25, 0.2]),
        ("sheet", [0.45, 0.6, 0.3]),
    ];
    let materials = diffuse(&colors);
    Ok(Generated { mesh: s.mesh, cages: vec![cage], materials, ..Generated::default() })
}

/// A cube whose top and bottom rims are creases.
fn cube(cage: &mut Cage, foot: Vec3, sharpness: f32) {
    let base = cage.positions.len() as u32;
    for i in 0..8u32 {
        cage.positions
            .push(foot + Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2 & 1) as f32));
    }
    for face in [[0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6], [0, 4, 6, 2], [1, 3, 7, 5]]
    {
        cage.push_face(&face.map(|i| base + i), 1);
    }
    for [a, b] in [[0, 1], [1, 5], [5, 4], [4, 0], [2, 3], [3, 7], [7, 6], [6, 2]] {
        cage.creases.push(([base + a, base + b], sharpness));
    }
}

/// The twelve edges of a cube, as a surface over the cells of a 3 × 3 × 3 grid.
fn frame(cage: &mut Cage, foot: Vec3, cell: f32) {
    let solid = |c: IVec3| {
        let inside = c.min_element() >= 0 && c.max_element() < 3;
        inside && c.to_array().iter().filter(|&&x| x == 1).count() < 2
    };
    let mut ids = std::collections::BTreeMap::new();
    for index in 0..27 {
        let c = IVec3::new(index % 3, index / 3 % 3, index / 9);
        if !solid(c) {
            continue;
        }
        for axis in 0..3 {
            for outward in [0, 1] {
                let unit = |a: usize| [IVec3::X, IVec3::Y, IVec3::Z][a % 3];
                let step = unit(axis) * (2 * outward - 1);
                if solid(c + step) {
                    continue;
                }
                let (u, v) = (unit(axis + 1), unit(axis + 2));
                let o = c + unit(axis) * outward;
                let ring = if outward == 1 {
                    [o, o + u, o + u + v, o + v]
                } else {
                    [o, o + v, o + u + v, o + u]
                };
                let corners = ring.map(|p| {
                    *ids.entry(p.to_array()).or_insert_with(|| {
                        cage.positions.push(foot + p.as_vec3() * cell);
                        cage.positions.len() as u32 - 1
                    })
                });
                cage.push_face(&corners, 2);
            }
        }
    }
}

/// Rings of eight around an axis, outside up and inside down; two of them sharp.
fn vase(cage: &mut Cage, foot: Vec3) {
    const AROUND: u32 = 8;
    let profile: [(f32, f32, f32); 9] = [
        (0.75, 0.0, INFINITE_SHARPNESS),
        (1.1, 0.8, 0.0),
        (0.9, 1.7, 0.0),
        (0.45, 2.3, 0.0),
        (0.75, 2.9, INFINITE_SHARPNESS),
        (0.62, 2.9, INFINITE_SHARPNESS),
        (0.35, 2.3, 0.0),
        (0.75, 1.6, 0.0),
        (0.6, 0.3, 0.0),
    ];
    let base = cage.positions.len() as u32;
    let at = |ring: u32, k: u32| base + ring * AROUND + k % AROUND;
    for (r, h, _) in profile {
        for k in 0..AROUND {
            let (sin, cos) = (TAU * k as f32 / AROUND as f32).sin_cos();
            cage.positions.push(foot + Vec3::new(r * cos, h, r * sin));
        }
    }
    for ring in 0..profile.len() as u32 - 1 {
        for k in 0..AROUND {
            cage.push_face(
                &[at(ring, k), at(ring + 1, k), at(ring + 1, k + 1), at(ring, k + 1)],
                3,
            );
        }
    }
    let last = profile.len() as u32 - 1;
    cage.push_face(&(0..AROUND).map(|k| at(0, k)).collect::<Vec<_>>(), 3);
    cage.push_face(&(0..AROUND).rev().map(|k| at(last, k)).collect::<Vec<_>>(), 3);
    for (ring, (_, _, sharpness)) in profile.into_iter().enumerate().filter(|(_, p)| p.2 > 0.0) {
        for k in 0..AROUND {
            cage.creases.push(([at(ring as u32, k), at(ring as u32, k + 1)], sharpness));
        }
    }
}

/// A wavy sheet that stands on the floor, with one sharp fold.
fn sheet(cage: &mut Cage, foot: Vec3) {
    const ACROSS: u32 = 9;
    let base = cage.positions.len() as u32;
    for j in 0..4 {
        for i in 0..ACROSS {
            let wave = if i == 4 { 0.7 } else { [0.0, 0.35, 0.0, -0.35][i as usize % 4] };
            let at = Vec2::new(i as f32 * 0.34 - 1.3, wave * (1.0 - 0.15 * j as f32));
            cage.positions.push(foot + Vec3::new(at.x, j as f32 * 0.9, at.y));
        }
    }
    let at = |i: u32, j: u32| base + j * ACROSS + i;
    for j in 0..3 {
        for i in 0..ACROSS - 1 {
            cage.push_face(&[at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)], 4);
        }
        cage.creases.push(([at(4, j), at(4, j + 1)], INFINITE_SHARPNESS));
    }
}
