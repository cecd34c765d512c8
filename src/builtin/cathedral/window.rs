//! Tracery: mullions, sub-arches and foils as moulded bars in the middle of an opening.

use std::f32::consts::{PI, TAU};

use glam::Vec2;

use super::arch::Pointed;
use super::sweep::{Plane, moulding, polyline, roll};
use super::wall::voussoirs;
use super::{RIB_TINTS, Segments};
use crate::builtin::solid::Solids;

/// Section of a tracery bar: (across, depth), a chamfered bar with a roll's nose on both faces.
fn bar(scale: f32, segments: &Segments) -> Vec<Vec2> {
    if segments.coarse() {
        return [(0.8, -1.1), (0.8, 1.1), (-0.8, 1.1), (-0.8, -1.1)]
            .map(|p| Vec2::from(p) * scale)
            .into();
    }
    let n = segments.of(4);
    let mut section = Vec::new();
    for face in [1.0, -1.0] {
        section.extend([Vec2::new(0.9, 0.35), Vec2::new(0.42, 0.95)].map(|p| p * face));
        section.extend((0..=n).map(|i| {
            let a = PI * i as f32 / n as f32;
            Vec2::new(0.32 * a.cos(), 1.05 + 0.32 * a.sin()) * face
        }));
        section.extend([Vec2::new(-0.42, 0.95), Vec2::new(-0.9, 0.35)].map(|p| p * face));
    }
    section.iter().map(|p| *p * scale).collect()
}

/// A ring of circle segments that bulge outwards (`foils` of them) inside a circle.
fn foils(
    s: &mut Solids,
    plane: &Plane,
    center: Vec2,
    radius: f32,
    foils: u32,
    scale: f32,
    segments: &Segments,
) {
    if segments.coarse() {
        return;
    }
    let n = segments.of(8).max(2);
    // Lobes of radius ρ whose centres lie at c: neighbours meet at distance m from the middle.
    let lobe = radius * 0.80 * (PI / foils as f32).sin();
    let reach = radius - lobe;
    let open = 0.62 * PI;
    let mut curve = Vec::new();
    for k in 0..foils {
        let middle = TAU * k as f32 / foils as f32 + 0.5 * PI;
        for i in 0..=n {
            let a = middle - open + 2.0 * open * i as f32 / n as f32;
            let direction = Vec2::from_angle(a);
            curve.push((center + Vec2::from_angle(middle) * reach + direction * lobe, direction));
        }
    }
    moulding(s, plane, &curve, &bar(scale, segments), true, |_| RIB_TINTS[1]);
}

fn circle_curve(center: Vec2, radius: f32, n: u32) -> Vec<(Vec2, Vec2)> {
    (0..n)
        .map(|i| Vec2::from_angle(TAU * i as f32 / n as f32))
        .map(|d| (center + d * radius, d))
        .collect()
}

/// Two lights under a foiled circle, in a pointed opening.
pub(super) fn lights(
    s: &mut Solids,
    plane: &Plane,
    window: Pointed,
    foot: Vec2,
    sill: f32,
    segments: &Segments,
) {
    let scale = 0.035 + 0.022 * window.half;
    let section = bar(scale, segments);
    let n = segments.of(10);
    let half = 0.5 * window.half;
    // Mullion and frame.
    polyline(
        s,
        plane,
        &[Vec2::new(foot.x, sill - 0.1), Vec2::new(foot.x, foot.y + 0.25 * half)],
        &section,
        false,
        |_| RIB_TINTS[0],
    );
    let mut frame: Vec<(Vec2, Vec2)> = window.curve(foot, n, -0.02);
    frame.insert(0, (Vec2::new(foot.x - window.half + 0.02, sill - 0.1), Vec2::NEG_X));
    frame.push((Vec2::new(foot.x + window.half - 0.02, sill - 0.1), Vec2::X));
    if !segments.coarse() {
        moulding(s, plane, &frame, &section, false, voussoirs(foot.x));
    }
    // The two sub-arches end in the mullion, at different places, so that their end faces do not
    // coincide.
    let sub = Pointed { half: half - 0.004, sharp: 1.9 };
    for side in [-1.0, 1.0] {
        let at = Vec2::new(foot.x + side * half, foot.y - 0.1 + 0.005 * side);
        moulding(s, plane, &sub.curve(at, n, 0.0), &section, false, voussoirs(at.x));
        if segments.coarse() {
            continue;
        }
        // A trefoil's cusps under the point.
        let cusp = Pointed { half: 0.62 * half, sharp: 1.25 };
        let small = bar(scale * 0.6, segments);
        let curve = cusp.curve(at + Vec2::Y * (0.62 * half), segments.of(6), 0.0);
        moulding(s, plane, &curve, &small, false, |_| RIB_TINTS[2]);
        for cheek in [-1.0, 1.0] {
            let points: Vec<Vec2> = (0..=segments.of(5))
                .map(|i| {
                    let t = i as f32 / segments.of(5) as f32;
                    let a = -0.5 * PI + PI * 0.75 * t;
                    at + Vec2::new(
                        cheek * (half * 0.66 + 0.32 * half * a.cos()),
                        half * (0.32 + 0.32 * a.sin()),
                    )
                })
                .collect();
            polyline(s, plane, &points, &small, false, |_| RIB_TINTS[2]);
        }
    }
    // The circle touches the frame and both sub-arches.
    let radius = 0.60 * half.mul_add(1.0, 0.12);
    let center = Vec2::new(foot.x, foot.y + window.rise(0.0) - radius - 0.42 * window.half);
    moulding(
        s,
        plane,
        &circle_curve(center, radius, segments.of(28).max(6)),
        &section,
        true,
        |_| RIB_TINTS[1],
    );
    foils(s, plane, center, radius - 0.3 * scale, 4, scale * 0.6, segments);
}

/// A rose: hub, twelve petals with pointed heads, a circle of roundels, and moulded rings.
pub(super) fn rose(s: &mut Solids, plane: &Plane, center: Vec2, radius: f32, segments: &Segments) {
    let petals = 12;
    let step = TAU / petals as f32;
    let around = segments.of(96).max(if segments.coarse() { 16 } else { 24 });
    let n = segments.of(8);
    let (hub, heads) = (0.17 * radius, 0.63 * radius);
    for (r, scale) in [(radius * 0.995, 0.11), (hub, 0.07)] {
        moulding(
            s,
            plane,
            &circle_curve(center, r, around),
            &bar(scale, segments),
            true,
            voussoirs(r),
        );
    }
    moulding(
        s,
        plane,
        &circle_curve(center, radius * 1.06, around),
        &roll(Vec2::new(0.0, 0.30), 0.09, segments.of(10)),
        true,
        voussoirs(2.0),
    );
    foils(s, plane, center, hub * 0.92, 6, 0.035, segments);
    for k in 0..petals {
        let a = k as f32 * step;
        let (d, e) = (Vec2::from_angle(a), Vec2::from_angle(a + 0.5 * step));
        polyline(
            s,
            plane,
            &[center + d * hub * 0.95, center + d * (0.5 * heads), center + d * heads],
            &bar(0.065, segments),
            false,
            |_| RIB_TINTS[0],
        );
        // A round head between this spoke and the next, and a smaller foil in it.
        let middle = center + e * (heads * (0.5 * step).cos());
        let half = heads * (0.5 * step).sin();
        let arc = |r: f32, reach: f32| -> Vec<(Vec2, Vec2)> {
            (0..=2 * n)
                .map(|i| Vec2::from_angle(a + 0.5 * step + reach * (i as f32 / n as f32 - 1.0)))
                .map(|q| (middle + q * r, q))
                .collect()
        };
        moulding(s, plane, &arc(half, 0.5 * PI), &bar(0.06, segments), false, |_| RIB_TINTS[1]);
        moulding(s, plane, &arc(half * 0.62, 0.72 * PI), &bar(0.033, segments), false, |_| {
            RIB_TINTS[2]
        });
        // Roundels over the spokes.
        let ring = 0.835 * radius;
        let r = 0.138 * radius;
        moulding(
            s,
            plane,
            &circle_curve(center + d * ring, r, segments.of(28).max(6)),
            &bar(0.055, segments),
            true,
            |_| RIB_TINTS[0],
        );
        foils(s, plane, center + d * ring, r * 0.93, 4, 0.028, segments);
    }
}
