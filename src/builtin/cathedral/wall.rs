//! The nave's walls, storey by storey, and the aisles': arcade, triforium, clerestory, and the
//! piers that cover their joints.

use glam::{Vec2, Vec3};

use super::arch::Pointed;
use super::masonry::chance;
use super::sweep::{Plane, moulding, panel, polyline, roll};
use super::window::lights;
use super::{
    AISLE_FACE, AISLE_ROOF, AISLE_SPRING, ARCADE_TOP, BAY, BAYS, HALF_WALL, LENGTH, NAVE,
    RIB_TINTS, ROOF, STONE, Segments, TINTS, TRIFORIUM_TOP, VAULT_SPRING, column,
};
use crate::builtin::solid::Solids;

const ARCH: Pointed = Pointed { half: 1.78, sharp: 1.8 };

/// The middle plane of a nave wall, `side` −1 or 1, looking into the nave.
fn nave_plane(side: f32) -> Plane {
    Plane {
        origin: Vec3::new(0.0, 0.0, side * NAVE),
        across: Vec3::X * side,
        out: Vec3::NEG_Z * side,
    }
}

/// Middles of the bays in the plane's coordinates.
fn bays(side: f32) -> impl Iterator<Item = f32> {
    (0..BAYS).map(move |i| side * (i as f32 + 0.5) * BAY)
}

/// The voussoirs' tints along an arch.
pub(super) fn voussoirs(key: f32) -> impl Fn(usize) -> u32 {
    move |k| {
        RIB_TINTS[(chance((key * 16.0) as i64, k as i64 / 2, 9) * RIB_TINTS.len() as f32) as usize]
    }
}

/// Pointed arches on the columns: two orders with rolls, and the wall above.
pub(super) fn arcade(s: &mut Solids, side: f32, segments: &Segments) {
    let plane = nave_plane(side);
    let n = segments.of(14);
    let spring = AISLE_SPRING;
    let order = |s: &mut Solids, offset: f32, half: f32, top: f32, material: u32| {
        let mut outline = vec![Vec2::new(if side > 0.0 { -0.4 } else { -LENGTH - 0.4 }, spring)];
        let mut middles: Vec<f32> = bays(side).collect();
        middles.sort_by(f32::total_cmp);
        middles.iter().for_each(|&x| {
            outline.extend(ARCH.curve(Vec2::new(x, spring), n, offset).iter().map(|p| p.0))
        });
        outline.push(Vec2::new(if side > 0.0 { LENGTH + 0.4 } else { 0.4 }, spring));
        let ring = |p: &Vec2| {
            vec![
                plane.at(*p, -half),
                plane.at(Vec2::new(p.x, top), -half),
                plane.at(Vec2::new(p.x, top), half),
                plane.at(*p, half),
            ]
        };
        s.tube(&outline.iter().map(ring).collect::<Vec<_>>(), false, material);
    };
    order(s, 0.22, HALF_WALL, ARCADE_TOP, STONE);
    for (i, x) in bays(side).enumerate() {
        let foot = Vec2::new(x, spring - 0.03);
        let key = x + side * 100.0 + i as f32;
        // The inner order: a narrower ring of voussoirs.
        let inner: Vec<Vec2> =
            [(0.4, -0.26), (0.4, 0.26), (0.03, 0.26), (0.0, 0.22), (0.0, -0.22), (0.03, -0.26)]
                .map(Vec2::from)
                .into();
        moulding(s, &plane, &ARCH.curve(foot, n, 0.0), &inner, false, voussoirs(key));
        for face in [-1.0, 1.0] {
            let m = segments.of(10);
            moulding(
                s,
                &plane,
                &ARCH.curve(foot, n, 0.10),
                &roll(Vec2::new(0.0, face * 0.26), 0.075, m),
                false,
                voussoirs(key + 1.0),
            );
            moulding(
                s,
                &plane,
                &ARCH.curve(foot, n, 0.25),
                &roll(Vec2::new(0.0, face * (HALF_WALL - 0.02)), 0.07, m),
                false,
                voussoirs(key + 2.0),
            );
            if segments.coarse() {
                continue;
            }
            // A label over the arch.
            let label: Vec<Vec2> = [
                (-0.05, -0.04),
                (0.06, -0.04),
                (0.08, 0.02),
                (0.08, 0.07),
                (0.03, 0.08),
                (-0.01, 0.05),
                (-0.05, 0.02),
            ]
            .map(|(r, d): (f32, f32)| Vec2::new(r, face * (HALF_WALL + d)))
            .into();
            moulding(s, &plane, &ARCH.curve(foot, n, 0.45), &label, false, voussoirs(key + 3.0));
        }
    }
}

/// A passage in the wall behind three small arches on colonnettes in every bay.
pub(super) fn triforium(s: &mut Solids, side: f32, segments: &Segments) {
    let plane = nave_plane(side);
    let (low, spring) = (ARCADE_TOP + 0.12, ARCADE_TOP + 1.45);
    // The passage's back and floor.
    let slab = |s: &mut Solids, y: [f32; 2], depth: [f32; 2]| {
        let (a, b) = (
            plane.at(Vec2::new(side * -0.35, y[0]), depth[0]),
            plane.at(Vec2::new(side * (LENGTH + 0.35), y[1]), depth[1]),
        );
        s.cuboid(a.min(b), a.max(b), STONE);
    };
    slab(s, [ARCADE_TOP - 0.2, TRIFORIUM_TOP + 0.2], [-HALF_WALL - 0.02, -HALF_WALL + 0.2]);
    slab(s, [ARCADE_TOP - 0.1, low], [-HALF_WALL + 0.1, HALF_WALL + 0.02]);
    let arch = Pointed { half: 0.56, sharp: 1.9 };
    let n = segments.of(7);
    for x in bays(side) {
        let middles = [x - 1.42, x, x + 1.42];
        let (front, back) = (HALF_WALL - 0.03, HALF_WALL - 0.28);
        let mut outline = vec![Vec2::new(x - 2.3, spring)];
        middles.iter().for_each(|&m| {
            outline.extend(arch.curve(Vec2::new(m, spring), n, 0.06).iter().map(|p| p.0))
        });
        outline.push(Vec2::new(x + 2.3, spring));
        let top = TRIFORIUM_TOP + 0.05;
        let ring = |p: &Vec2| {
            vec![
                plane.at(*p, back),
                plane.at(Vec2::new(p.x, top), back),
                plane.at(Vec2::new(p.x, top), front),
                plane.at(*p, front),
            ]
        };
        s.tube(&outline.iter().map(ring).collect::<Vec<_>>(), false, STONE);
        for m in middles {
            let foot = Vec2::new(m, spring - 0.02);
            moulding(
                s,
                &plane,
                &arch.curve(foot, n, 0.05),
                &roll(Vec2::new(0.0, front - 0.03), 0.06, segments.of(9)),
                false,
                voussoirs(m + 50.0 * side),
            );
        }
        for k in -1..=2 {
            let at = x + (k as f32 - 0.5) * 1.42;
            let off = at.clamp(x - 2.06, x + 2.06);
            let depths = [front - 0.12, back + 0.02];
            for &depth in if segments.coarse() { &depths[..1] } else { &depths } {
                column::shaft(
                    s,
                    plane.at(Vec2::new(off, low - 0.02), depth),
                    spring + 0.01,
                    0.065,
                    &[],
                    TINTS[(k + 1) as usize % 4],
                    segments,
                );
            }
        }
    }
}

/// The upper storey: a pair of lights under a roundel in every bay.
pub(super) fn clerestory(s: &mut Solids, side: f32, segments: &Segments) {
    let plane = nave_plane(side);
    for x in bays(side) {
        let window = Pointed { half: 1.42, sharp: 2.0 };
        let (foot, sill) = (Vec2::new(x, 16.9), TRIFORIUM_TOP + 0.75);
        opening(
            s,
            &plane,
            [Vec2::new(x - 2.42, TRIFORIUM_TOP - 0.02), Vec2::new(x + 2.42, ROOF - 0.1)],
            window,
            foot,
            sill,
            segments,
        );
        lights(s, &plane, window, foot, sill, segments);
    }
}

/// A wall panel with a splayed pointed window and a roll around it.
pub(super) fn opening(
    s: &mut Solids,
    plane: &Plane,
    rectangle: [Vec2; 2],
    window: Pointed,
    foot: Vec2,
    sill: f32,
    segments: &Segments,
) {
    let n = segments.of(12);
    let hole = |offset: f32| window.lancet(foot, sill, n, offset);
    let h = HALF_WALL;
    panel(
        s,
        plane,
        rectangle,
        &[
            (hole(0.26), h),
            (hole(0.22), h - 0.12),
            (hole(0.0), 0.08),
            (hole(0.0), -0.10),
            (hole(0.14), -h),
        ],
        STONE,
    );
    let m = segments.of(9);
    let mut edge: Vec<(Vec2, Vec2)> = window.curve(foot, n, 0.27);
    edge.insert(0, (Vec2::new(foot.x - window.half - 0.27, sill - 0.2), Vec2::NEG_X));
    edge.push((Vec2::new(foot.x + window.half + 0.27, sill - 0.2), Vec2::X));
    moulding(
        s,
        plane,
        &edge,
        &roll(Vec2::new(0.0, h - 0.01), 0.065, m),
        false,
        voussoirs(foot.x + 31.0),
    );
}

/// Piers over the joints of a nave wall's panels, wall shafts before them, and string courses.
pub(super) fn nave_piers(s: &mut Solids, side: f32, segments: &Segments) {
    let plane = nave_plane(side);
    for i in 0..=BAYS {
        let x = side * i as f32 * BAY;
        let (a, b) = (
            plane.at(Vec2::new(x - 0.31, AISLE_SPRING - 0.15), -HALF_WALL - 0.22),
            plane.at(Vec2::new(x + 0.31, ROOF - 0.25), HALF_WALL + 0.1),
        );
        s.cuboid(a.min(b), a.max(b), STONE);
        let foot = plane.at(Vec2::new(x, AISLE_SPRING + 0.02), HALF_WALL + 0.1);
        column::triple(
            s,
            foot,
            VAULT_SPRING,
            plane.out,
            &[ARCADE_TOP + 0.02, TRIFORIUM_TOP + 0.02],
            segments,
        );
    }
    for (y, scale) in [(ARCADE_TOP, 1.0), (TRIFORIUM_TOP, 1.0)] {
        string(s, &plane, side, y, HALF_WALL, scale, segments);
    }
}

/// A string course along a wall's face: through the joint of two storeys, so that their edges are
/// covered.
fn string(
    s: &mut Solids,
    plane: &Plane,
    side: f32,
    y: f32,
    face: f32,
    scale: f32,
    segments: &Segments,
) {
    let n = segments.of(6);
    let mut profile: Vec<Vec2> = [(-0.09, -0.20), (-0.09, 0.03), (-0.05, 0.06)]
        .map(|(h, d): (f32, f32)| Vec2::new(h * scale, face + d * scale))
        .into();
    profile.extend((0..=n).map(|i| {
        let a = -1.2 + 2.4 * i as f32 / n as f32;
        Vec2::new(0.035 + 0.06 * a.sin(), 0.07 + 0.06 * a.cos()) * Vec2::new(scale, scale)
            + Vec2::Y * face
    }));
    profile.push(Vec2::new(0.12 * scale, face - 0.20 * scale));
    let (from, to) = (-0.3 * side, side * (LENGTH + 0.3));
    let points: Vec<Vec2> = (0..=BAYS * 4)
        .map(|i| Vec2::new(from + (to - from) * i as f32 / (BAYS * 4) as f32, y))
        .collect();
    polyline(s, plane, &points, &profile, false, voussoirs(y));
}

/// The outer wall of an aisle: a window in every bay, wall shafts between, a plinth bench below.
pub(super) fn aisle(s: &mut Solids, side: f32, segments: &Segments) {
    let plane = Plane {
        origin: Vec3::new(0.0, 0.0, side * (AISLE_FACE + HALF_WALL)),
        across: Vec3::X * side,
        out: Vec3::NEG_Z * side,
    };
    for x in bays(side) {
        let window = Pointed { half: 1.05, sharp: 2.1 };
        let (foot, sill) = (Vec2::new(x, 5.2), 2.3);
        opening(
            s,
            &plane,
            [Vec2::new(x - 2.42, -0.3), Vec2::new(x + 2.42, AISLE_ROOF - 0.1)],
            window,
            foot,
            sill,
            segments,
        );
        lights(s, &plane, window, foot, sill, segments);
    }
    for i in 0..=BAYS {
        let x = side * i as f32 * BAY;
        let (a, b) = (
            plane.at(Vec2::new(x - 0.31, -0.25), -HALF_WALL - 0.5),
            plane.at(Vec2::new(x + 0.31, AISLE_ROOF - 0.2), HALF_WALL + 0.1),
        );
        s.cuboid(a.min(b), a.max(b), STONE);
        column::triple(
            s,
            plane.at(Vec2::new(x, 0.55), HALF_WALL + 0.1),
            AISLE_SPRING,
            plane.out,
            &[2.1],
            segments,
        );
        let (a, b) = (
            plane.at(Vec2::new(x - 0.42, -0.2), 0.0),
            plane.at(Vec2::new(x + 0.42, 0.57), HALF_WALL + 0.36),
        );
        super::sweep::block(s, a.min(b), a.max(b), 0.05, TINTS[1]);
    }
    string(s, &plane, side, 2.02, HALF_WALL, 0.9, segments);
}
