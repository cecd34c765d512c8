//! Outer walls, slabs, floors, mouldings: what encloses the court.

use glam::{Vec2, Vec3};

use super::{
    COURT, GALLERY, JOINT, LIMESTONE, MARBLE, OCHRE, PAVING, PLASTER, POMPEIAN, ROOF, STOREYS,
    Side, TILE_DARK, TILE_LIGHT, TILE_ROSE, TILE_SLATE, UPPER_FLOOR, WOOD,
};
use crate::builtin::solid::Solids;
use crate::sampling::{Rng, Stream};

const WALL: f32 = 0.5;
/// Depth of the doors' niches.
const NICHE: f32 = 0.3;
const DADO: f32 = 1.15;
const DOOR: [f32; 2] = [1.3, 2.5];

/// Ground, outer walls with niches for doors, upper slab and roof: one solid on a grid.
pub(super) fn walls(s: &mut Solids) {
    let [x, z] = COURT.map(|c| c + GALLERY);
    let lines = |half: f32, court: f32, doors: &[f32]| {
        let mut l = vec![
            -half - WALL,
            -half - NICHE,
            -half,
            -court,
            court,
            half,
            half + NICHE,
            half + WALL,
        ];
        doors.iter().for_each(|d| l.extend([d - 0.5 * DOOR[0], d + 0.5 * DOOR[0]]));
        l.sort_by(f32::total_cmp);
        l
    };
    let (doors_x, doors_z) = ([-7.5, -1.5, 4.5], [-3.0, 3.0]);
    let (xs, zs) = (lines(x, COURT[0], &doors_x), lines(z, COURT[1], &doors_z));
    let ys = [
        -0.5,
        -0.03,
        DADO,
        DOOR[1],
        UPPER_FLOOR - 0.4,
        UPPER_FLOOR - 0.03,
        UPPER_FLOOR + DADO,
        UPPER_FLOOR + DOOR[1],
        ROOF,
        ROOF + 0.4,
    ];
    let middle = |l: &[f32], i: usize| 0.5 * (l[i] + l[i + 1]);
    let near = |c: f32, doors: &[f32]| doors.iter().any(|d| (c - d).abs() < 0.5 * DOOR[0]);
    let filled = |[i, j, k]: [usize; 3]| {
        let c = Vec3::new(middle(&xs, i), middle(&ys, j), middle(&zs, k));
        let court = c.x.abs() < COURT[0] && c.z.abs() < COURT[1];
        let slab = !court && (c.y > ROOF || (c.y > UPPER_FLOOR - 0.4 && c.y < UPPER_FLOOR - 0.03));
        let door_height =
            (c.y > 0.0 && c.y < DOOR[1]) || (c.y > UPPER_FLOOR && c.y < UPPER_FLOOR + DOOR[1]);
        let niche_x = c.z.abs() > z && c.z.abs() < z + NICHE && near(c.x, &doors_x);
        let niche_z = c.x.abs() > x && c.x.abs() < x + NICHE && near(c.z, &doors_z);
        let wall = (c.x.abs() > x || c.z.abs() > z) && !(door_height && (niche_x || niche_z));
        c.y < -0.03 || slab || wall
    };
    s.grid([&xs, &ys, &zs], filled, |c, n| {
        let deep = c.x.abs() > x + 0.5 * NICHE || c.z.abs() > z + 0.5 * NICHE;
        let upper = c.y > UPPER_FLOOR - 0.2;
        let above = c.y - if upper { UPPER_FLOOR } else { 0.0 };
        if n.y > 0.5 {
            JOINT
        } else if n.y < -0.5 {
            PLASTER
        } else if deep {
            WOOD
        } else if above < DADO {
            if upper { OCHRE } else { POMPEIAN }
        } else {
            PLASTER
        }
    });
}

/// Bevelled slabs with joints; the court and the upper floor in plain stone, the galleries
/// chequered.
pub(super) fn floors(s: &mut Solids, detail: f32) {
    let [x, z] = COURT.map(|c| c + GALLERY);
    let pitch = 0.6 / detail.clamp(0.2, 1.0);
    let divisions = (detail * 2.0).round().max(1.0) as u32;
    let mut rng = Rng::new(7, Stream::Scene, 1, 0);
    for floor in [0.0, UPPER_FLOOR] {
        let (nx, nz) = ((2.0 * x / pitch).floor() as u32, (2.0 * z / pitch).floor() as u32);
        let (px, pz) = (2.0 * x / nx as f32, 2.0 * z / nz as f32);
        for i in 0..nx {
            for k in 0..nz {
                let low = Vec3::new(-x + i as f32 * px, floor, -z + k as f32 * pz);
                let high = low + Vec3::new(px, 0.0, pz);
                let center = 0.5 * (low + high);
                let inside = center.x.abs() < COURT[0] - 0.25 && center.z.abs() < COURT[1] - 0.25;
                if floor > 0.0
                    && (center.x.abs() < COURT[0] + 0.1 + 0.5 * px
                        && center.z.abs() < COURT[1] + 0.1 + 0.5 * pz)
                {
                    continue;
                }
                let material = if inside {
                    PAVING[rng.below(3)]
                } else if (i + k) % 2 == 0 {
                    [TILE_LIGHT, TILE_LIGHT, TILE_ROSE][rng.below(3)]
                } else {
                    [TILE_DARK, TILE_DARK, TILE_SLATE][rng.below(3)]
                };
                tile(s, low, high, divisions, 0.004 * (rng.next_f32() - 0.5), material);
            }
        }
    }
}

/// One slab between two corners of its cell: joints around, edges bevelled, the top slightly worn.
fn tile(s: &mut Solids, low: Vec3, high: Vec3, divisions: u32, lift: f32, material: u32) {
    let (joint, bevel) = (0.005, 0.008);
    let y = low.y + lift;
    let (a, b) = (low + Vec3::new(joint, 0.0, joint), high - Vec3::new(joint, 0.0, joint));
    let n = divisions as usize;
    let mut positions = Vec::new();
    let mut triangles: Vec<[u32; 3]> = Vec::new();
    for k in 0..=n {
        for i in 0..=n {
            let (u, v) = (i as f32 / n as f32, k as f32 / n as f32);
            let worn = 0.002 * (16.0 * u * (1.0 - u) * v * (1.0 - v));
            let at = |l: f32, h: f32, t: f32| l + bevel + (h - l - 2.0 * bevel) * t;
            positions.push(Vec3::new(at(a.x, b.x, u), y - worn, at(a.z, b.z, v)));
        }
    }
    let id = |i: usize, k: usize| (k * (n + 1) + i) as u32;
    for k in 0..n {
        for i in 0..n {
            triangles.extend([
                [id(i, k), id(i, k + 1), id(i + 1, k + 1)],
                [id(i, k), id(i + 1, k + 1), id(i + 1, k)],
            ]);
        }
    }
    // The rim once around, then the same pushed out to the bevel's foot, and down to the bed.
    let rim: Vec<u32> = (0..n)
        .map(|i| id(i, 0))
        .chain((0..n).map(|k| id(n, k)))
        .chain((0..n).map(|i| id(n - i, n)))
        .chain((0..n).map(|k| id(0, n - k)))
        .collect();
    let m = rim.len() as u32;
    let foot = positions.len() as u32;
    for depth in [bevel, 0.05] {
        for &r in &rim {
            let p = positions[r as usize];
            let out = |v: f32, l: f32, h: f32| {
                if v <= l + bevel * 1.01 {
                    l
                } else if v >= h - bevel * 1.01 {
                    h
                } else {
                    v
                }
            };
            positions.push(Vec3::new(out(p.x, a.x, b.x), y - depth, out(p.z, a.z, b.z)));
        }
    }
    let ring = |level: u32, i: u32| {
        if level == 0 { rim[(i % m) as usize] } else { foot + (level - 1) * m + i % m }
    };
    for level in 0..2 {
        for i in 0..m {
            triangles.extend([
                [ring(level, i), ring(level, i + 1), ring(level + 1, i + 1)],
                [ring(level, i), ring(level + 1, i + 1), ring(level + 1, i)],
            ]);
        }
    }
    let center = positions.len() as u32;
    positions.push(0.5 * (a + b) + Vec3::Y * (lift - 0.05));
    (0..m).for_each(|i| triangles.push([ring(2, i), ring(2, i + 1), center]));
    let count = triangles.len();
    s.solid(&positions, triangles, &vec![material; count]);
}

/// String course, cornice, beams of the gallery ceilings, skirtings, pilasters and door frames.
pub(super) fn mouldings(s: &mut Solids) {
    let [cx, cz] = COURT;
    let course = |s: &mut Solids, y: f32, scale: f32, material| {
        let profile: Vec<Vec2> = [
            (-0.1, -0.16),
            (0.06, -0.16),
            (0.08, -0.10),
            (0.13, -0.07),
            (0.15, 0.0),
            (0.22, 0.02),
            (0.22, 0.08),
            (0.18, 0.11),
            (-0.1, 0.11),
        ]
        .iter()
        .map(|&(r, h)| Vec2::new(r + 0.2, h) * Vec2::new(1.0, scale))
        .collect();
        let corner = Vec3::new(-cx, y, cz);
        s.frame(corner, Vec3::X * 2.0 * cx, Vec3::NEG_Z * 2.0 * cz, &profile, material);
    };
    course(s, UPPER_FLOOR - 0.08, 1.0, LIMESTONE);
    course(s, ROOF + 0.12, 1.6, LIMESTONE);
    let beam: Vec<Vec2> = [
        (-0.13, 0.03),
        (-0.13, -0.13),
        (-0.10, -0.19),
        (-0.07, -0.22),
        (0.07, -0.22),
        (0.10, -0.19),
        (0.13, -0.13),
        (0.13, 0.03),
    ]
    .map(Vec2::from)
    .into();
    let joist: Vec<Vec2> =
        [(-0.05, 0.03), (-0.05, -0.11), (0.05, -0.11), (0.05, 0.03)].map(Vec2::from).into();
    for side in Side::all() {
        let out = -side.inwards();
        for half_bay in 0..=4 * side.bays {
            let at = side.from + side.along * (half_bay as f32 * 0.75) + Vec3::Y * ROOF;
            let profile = if half_bay % 4 == 0 { &beam } else { &joist };
            s.bar(at + out * 0.1, at + out * (GALLERY + 0.05), side.along, Vec3::Y, profile, WOOD);
        }
        let corner = side.from + out * GALLERY - side.along * GALLERY;
        let length = side.length() + 2.0 * GALLERY;
        for floor in [0.0, UPPER_FLOOR] {
            pilasters(s, corner, &side, length, floor);
        }
    }
}

/// Pilasters on the outer wall, opposite the columns.
fn pilasters(s: &mut Solids, corner: Vec3, side: &Side, length: f32, floor: f32) {
    let (along, inwards) = (side.along, side.inwards());
    // Below, the capitals carry the vaults' ribs.
    let height = if floor > 0.0 { ROOF - floor } else { STOREYS[0].spring + 0.403 };
    let slab = |s: &mut Solids, at: f32, half: f32, depth: f32, low: f32, high: f32, material| {
        let foot = corner + along * at + Vec3::Y * floor;
        let (p, q) = (
            foot - along * half - inwards * 0.04 + Vec3::Y * low,
            foot + along * half + inwards * depth + Vec3::Y * high,
        );
        s.cuboid(p.min(q), p.max(q), material);
    };
    let count = (length / 3.0).round() as u32;
    for i in 1..count {
        let at = i as f32 * 3.0;
        slab(
            s,
            at,
            0.21,
            0.10,
            -0.02,
            if floor > 0.0 { height + 0.02 } else { height - 0.41 },
            PLASTER,
        );
        slab(s, at, 0.26, 0.15, -0.025, 0.22, MARBLE);
        slab(s, at, 0.24, 0.13, height - 0.62, height - 0.5, MARBLE);
        slab(s, at, 0.28, 0.17, height - 0.51, height - 0.40, MARBLE);
    }
}
