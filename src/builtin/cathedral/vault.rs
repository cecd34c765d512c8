//! Ribbed quadripartite vaults: two pointed tunnels of one height that meet in groins, with moulded
//! ribs under the groins.
//!
//! Over a bay of half sides a and b the web's height is H · h(min(|x|/a, |z|/b)), h the profile of
//! a pointed arch of half span 1 and rise 1; so groins stand over the diagonals. A row of bays is
//! one solid: the web below, a flat top.

use std::f32::consts::{PI, TAU};

use glam::{Vec2, Vec3};

use super::arch::Pointed;
use super::masonry::chance;
use super::sweep::rib;
use super::{RIB_TINTS, Segments, WEB};
use crate::builtin::solid::Solids;

const PROFILE: Pointed = Pointed { half: 1.0, sharp: 1.5 };

/// A row of bays along x.
pub(super) struct Vault {
    /// Middle of the first bay's western edge, at the springing.
    pub origin: Vec3,
    pub bays: u32,
    /// Half a bay along x and z.
    pub half: Vec2,
    pub rise: f32,
    /// Height of the solid's top above the springing.
    pub top: f32,
    /// Scale of the ribs' section.
    pub rib: f32,
}

impl Vault {
    fn center(&self, bay: u32) -> Vec3 {
        self.origin + Vec3::X * self.half.x * (2.0 * bay as f32 + 1.0)
    }

    /// A point under the web, `u` and `v` from −1 to 1.
    fn at(&self, bay: u32, u: f32, v: f32) -> Vec3 {
        let t = |s: f32| PROFILE.at(s, 0.0).0.x;
        let height = PROFILE.at(u.abs().min(v.abs()), 0.0).0.y / PROFILE.rise(0.0);
        self.center(bay) + Vec3::new(self.half.x * t(u), self.rise * height, self.half.y * t(v))
    }

    pub(super) fn build(&self, s: &mut Solids, segments: &Segments) {
        self.webs(s, segments);
        let n = segments.of(22);
        let line = |from: Vec2, to: Vec2, bay: u32| -> Vec<Vec3> {
            (0..=2 * n)
                .map(|i| from.lerp(to, i as f32 / (2 * n) as f32))
                .map(|p| self.at(bay, p.x, p.y))
                .collect()
        };
        let section = |scale: f32| section(scale * self.rib, segments.of(8));
        let tint = |key: i64| {
            move |k: usize| RIB_TINTS[(chance(key, k as i64, 5) * RIB_TINTS.len() as f32) as usize]
        };
        for bay in 0..self.bays {
            let key = i64::from(bay) * 64 + (self.origin.z * 8.0) as i64;
            for z in [-1.0, 1.0] {
                let across = Vec3::new(self.half.y * z, 0.0, self.half.x).normalize();
                rib(
                    s,
                    &line(Vec2::new(1.0, -z), Vec2::new(-1.0, z), bay),
                    across,
                    &section(1.0),
                    tint(key + z as i64),
                );
                if segments.coarse() {
                    continue;
                }
                // Along the walls, a little inside.
                let mut wall = line(Vec2::new(1.0, z), Vec2::new(-1.0, z), bay);
                wall.iter_mut().for_each(|p| p.z -= z * 0.12);
                rib(s, &wall, Vec3::Z, &section(0.62), tint(key + 8 + z as i64));
            }
            self.boss(s, bay, segments);
        }
        for edge in 0..=self.bays {
            let (bay, u) = if edge < self.bays { (edge, -1.0) } else { (edge - 1, 1.0) };
            rib(
                s,
                &line(Vec2::new(u, 1.0), Vec2::new(u, -1.0), bay),
                Vec3::NEG_X,
                &section(1.45),
                tint(i64::from(edge) + 7000),
            );
        }
    }

    fn webs(&self, s: &mut Solids, segments: &Segments) {
        let half = segments.of(12);
        let n = 2 * half;
        let (nx, nz) = (n * self.bays, n);
        let mut positions = Vec::new();
        for i in 0..=nx {
            let bay = (i / n).min(self.bays - 1);
            let u = (i - bay * n) as f32 / half as f32 - 1.0;
            positions.extend((0..=nz).map(|k| self.at(bay, u, k as f32 / half as f32 - 1.0)));
        }
        let id = |i: u32, k: u32| i * (nz + 1) + k;
        let mut triangles = Vec::new();
        for i in 0..nx {
            for k in 0..nz {
                let (a, b, c, d) = (id(i, k), id(i + 1, k), id(i + 1, k + 1), id(i, k + 1));
                if (i % n < half) == (k < half) {
                    triangles.extend([[a, b, c], [a, c, d]]);
                } else {
                    triangles.extend([[a, b, d], [b, c, d]]);
                }
            }
        }
        let rim: Vec<u32> = (0..nx)
            .map(|i| id(i, 0))
            .chain((0..nz).map(|k| id(nx, k)))
            .chain((0..nx).map(|i| id(nx - i, nz)))
            .chain((0..nz).map(|k| id(0, nz - k)))
            .collect();
        let (m, base) = (rim.len() as u32, positions.len() as u32);
        for &r in &rim {
            let p = positions[r as usize];
            positions.push(Vec3::new(p.x, self.origin.y + self.top, p.z));
        }
        let apex = positions.len() as u32;
        positions.push(self.origin + Vec3::new(self.half.x * self.bays as f32, self.top, 0.0));
        for i in 0..m {
            let (p, q) = (rim[i as usize], rim[((i + 1) % m) as usize]);
            let (p1, q1) = (base + i, base + (i + 1) % m);
            triangles.extend([[q, p, p1], [q, p1, q1], [p1, apex, q1]]);
        }
        let count = triangles.len();
        s.solid(&positions, triangles, &vec![WEB; count]);
    }

    /// A carved knob where the ribs cross.
    fn boss(&self, s: &mut Solids, bay: u32, segments: &Segments) {
        let r = 2.0 * self.rib;
        let n = segments.of(8);
        let profile: Vec<Vec2> = (0..=n)
            .map(|i| {
                let a = 0.5 * PI * i as f32 / n as f32;
                Vec2::new((0.05 + a.cos()) * r * 0.95, 0.2 * r - 1.35 * r * a.sin())
            })
            .collect();
        let petals = |a: f32, p: Vec2| {
            1.0 + 0.13 * (8.0 * a).cos() * (TAU * (p.x / r).clamp(0.0, 1.0) * 0.5).sin()
        };
        s.lathe(
            self.center(bay) + Vec3::Y * self.rise,
            &profile,
            segments.of(40),
            petals,
            RIB_TINTS[0],
        );
    }
}

/// A rib's section, (across, outwards): sunk into the web, hollow flanks, a filleted roll below.
fn section(scale: f32, n: u32) -> Vec<Vec2> {
    if n < 2 {
        return [(0.95, 0.6), (0.5, -1.7), (-0.5, -1.7), (-0.95, 0.6)]
            .map(|p| Vec2::from(p) * scale)
            .into();
    }
    let mut right: Vec<Vec2> =
        [(0.95, 0.6), (0.95, -0.25), (0.80, -0.42), (0.58, -0.55), (0.47, -0.78)]
            .map(Vec2::from)
            .into();
    right.extend((0..=n).map(|i| {
        let a = 0.15 * PI - 0.62 * PI * i as f32 / n as f32;
        Vec2::new(0.5 * a.cos(), -1.25 + 0.5 * a.sin()).max(Vec2::new(0.09, -9.0))
    }));
    right.push(Vec2::new(0.09, -1.86));
    let mut all = right.clone();
    all.extend(right.iter().rev().map(|p| Vec2::new(-p.x, p.y)));
    all.iter().map(|p| *p * scale).collect()
}
