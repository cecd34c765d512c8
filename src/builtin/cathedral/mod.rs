//! A Gothic church: nave, two aisles, ribbed vaults, windows with tracery and a rose, lit by the
//! sun or by hundreds of candles.
//!
//! Metres, y up, x eastwards. Nave x 0–35 in seven bays, z −4.55–4.55, vault from 14.2 to 21.1 m;
//! aisles z ±5.45–10, vaults from 5.6 to 9.3 m. Storeys of the nave: arcade on clustered columns,
//! triforium, clerestory. Light enters only through the windows.
//!
//! Knob  `detail` (default 1) multiplies the segments of all round parts and divides the masonry
//!       finer; the count grows with its square.
//! Knob  `lit` (default false) lights the candles.
//!
//! Every part is closed and faces outwards; parts are sunk into one another, never laid face on
//! face.

mod arch;
mod candles;
mod column;
mod ends;
mod furniture;
mod masonry;
mod sweep;
mod vault;
mod wall;
mod window;

use glam::{Vec2, Vec3};
use serde::Deserialize;

use super::Generated;
use super::solid::Solids;
use crate::radiometry::Rgb;
use crate::scene::Material;

/// Parameters of the cathedral.
#[derive(Clone, Debug, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct CathedralParameters {
    /// Multiplies the segments of round parts and the fineness of floor and masonry, 0.1 (some 60 k
    /// triangles) to 3.2 (10 M).
    pub detail: f32,
    /// The candles burn.
    pub lit: bool,
}

impl Default for CathedralParameters {
    fn default() -> Self {
        Self { detail: 1.0, lit: false }
    }
}

const NAMES: [(&str, [f32; 3]); 23] = [
    ("stone-a", [0.66, 0.60, 0.49]),
    ("stone-b", [0.60, 0.54, 0.44]),
    ("stone-c", [0.70, 0.65, 0.55]),
    ("stone-d", [0.58, 0.54, 0.47]),
    ("web-a", [0.72, 0.68, 0.60]),
    ("web-b", [0.67, 0.62, 0.53]),
    ("rib-a", [0.64, 0.58, 0.48]),
    ("rib-b", [0.69, 0.63, 0.53]),
    ("rib-c", [0.60, 0.55, 0.46]),
    ("marble", [0.26, 0.25, 0.25]),
    ("joint", [0.30, 0.28, 0.26]),
    ("tile-dark-a", [0.16, 0.15, 0.15]),
    ("tile-dark-b", [0.20, 0.17, 0.15]),
    ("tile-light-a", [0.58, 0.52, 0.43]),
    ("tile-light-b", [0.52, 0.45, 0.36]),
    ("tile-red-a", [0.40, 0.20, 0.12]),
    ("tile-red-b", [0.47, 0.27, 0.17]),
    ("wood", [0.22, 0.12, 0.06]),
    ("oak", [0.34, 0.20, 0.10]),
    ("cloth", [0.50, 0.05, 0.06]),
    ("brass", [0.50, 0.36, 0.14]),
    ("wax", [0.80, 0.76, 0.65]),
    ("flame", [0.80, 0.70, 0.50]),
];
/// Walls before their masonry is laid.
const STONE: u32 = 0;
/// Webs before their masonry is laid.
const WEB: u32 = 4;
const TINTS: [u32; 4] = [0, 1, 2, 3];
const WEB_TINTS: [u32; 2] = [4, 5];
const RIB_TINTS: [u32; 3] = [6, 7, 8];
const MARBLE: u32 = 9;
const JOINT: u32 = 10;
/// The first of three pairs.
const TILES: u32 = 11;
const WOOD: u32 = 17;
const OAK: u32 = 18;
const CLOTH: u32 = 19;
const BRASS: u32 = 20;
const WAX: u32 = 21;
const FLAME: u32 = 22;
/// Radiance of a burning flame.
const FLAME_RADIANCE: [f32; 3] = [120.0, 67.0, 26.0];

const BAYS: u32 = 7;
const BAY: f32 = 5.0;
const LENGTH: f32 = BAYS as f32 * BAY;
/// z of the arcades' middle.
const NAVE: f32 = 5.0;
const HALF_WALL: f32 = 0.45;
/// z of the aisles' outer walls, inside.
const AISLE_FACE: f32 = 10.0;
const AISLE_SPRING: f32 = 5.6;
const AISLE_ROOF: f32 = 10.0;
const ARCADE_TOP: f32 = 10.6;
const TRIFORIUM_TOP: f32 = 13.2;
const VAULT_SPRING: f32 = 14.2;
const ROOF: f32 = 22.0;

/// How many segments a round part gets.
struct Segments {
    detail: f32,
}

impl Segments {
    /// So few that small parts are made plainly or left out.
    fn coarse(&self) -> bool {
        self.detail < 0.12
    }

    fn of(&self, n: u32) -> u32 {
        ((n as f32 * self.detail).round() as u32).max(if n <= 10 {
            1
        } else if self.coarse() {
            3
        } else {
            4
        })
    }
}

/// Makes the cathedral.
///
/// # Errors
/// When `detail` is out of range.
pub fn cathedral(p: &CathedralParameters) -> Result<Generated, String> {
    if !(0.1..=3.2).contains(&p.detail) {
        return Err(format!("detail is {} but must lie from 0.1 to 3.2", p.detail));
    }
    let segments = Segments { detail: 0.6 * p.detail };
    let mut s = Solids::default();
    s.cuboid(Vec3::new(-1.2, -0.8, -11.4), Vec3::new(LENGTH + 1.2, -0.03, 11.4), JOINT);
    furniture::floor(&mut s, p.detail);
    furniture::pews(&mut s, &segments);
    furniture::altar(&mut s, &segments);
    candles::candles(&mut s, p.lit, &segments);
    for side in [-1.0, 1.0] {
        ends::end(&mut s, side, &segments);
        wall::arcade(&mut s, side, &segments);
        wall::triforium(&mut s, side, &segments);
        wall::clerestory(&mut s, side, &segments);
        wall::nave_piers(&mut s, side, &segments);
        wall::aisle(&mut s, side, &segments);
        for i in 0..=BAYS {
            column::clustered(
                &mut s,
                Vec3::new(i as f32 * BAY, 0.0, side * NAVE),
                AISLE_SPRING + 0.01,
                &segments,
            );
        }
        let middle = 0.5 * (NAVE + HALF_WALL + AISLE_FACE);
        vault::Vault {
            origin: Vec3::new(0.0, AISLE_SPRING - 0.04, side * middle),
            bays: BAYS,
            half: Vec2::new(0.5 * BAY, AISLE_FACE + 0.12 - middle),
            rise: 3.7,
            top: AISLE_ROOF - AISLE_SPRING,
            rib: 0.095,
        }
        .build(&mut s, &segments);
    }
    vault::Vault {
        origin: Vec3::new(0.0, VAULT_SPRING - 0.04, 0.0),
        bays: BAYS,
        half: Vec2::new(0.5 * BAY, NAVE - HALF_WALL + 0.12),
        rise: 6.9,
        top: ROOF - VAULT_SPRING,
        rib: 0.14,
    }
    .build(&mut s, &segments);
    let size = 1.0 / p.detail.clamp(0.2, 1.2);
    let pitch = |m: u32| match m {
        STONE => Some([0.45 * size, 0.42 * size]),
        WEB => Some([1.25 * size, 0.36 * size]),
        _ => None,
    };
    let tint = |chance: f32, m: u32| {
        let tints: &[u32] = if m == STONE { &TINTS } else { &WEB_TINTS };
        tints[(chance * tints.len() as f32) as usize]
    };
    if p.detail >= 0.3 {
        masonry::lay(&mut s.mesh, pitch, tint);
    }
    let mut materials: Vec<Material> = NAMES
        .iter()
        .map(|&(name, albedo)| Material {
            name: name.into(),
            albedo: Rgb::from(albedo),
            ..Material::default()
        })
        .collect();
    if p.lit {
        materials[FLAME as usize].emission = Rgb::from(FLAME_RADIANCE);
    }
    Ok(Generated { mesh: s.mesh, materials, ..Generated::default() })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Camera, Scene};
    use crate::tessellate::{Geometry, analyze_topology};

    fn made(detail: f32, lit: bool) -> Generated {
        cathedral(&CathedralParameters { detail, lit }).unwrap()
    }

    #[test]
    fn counts_grow_with_detail_and_repeat() {
        let count = |detail: f32| made(detail, true).mesh.triangles.len();
        let (coarse, half, one) = (count(0.1), count(0.5), count(1.0));
        assert!((15_000..70_000).contains(&coarse), "{coarse}");
        assert!(half > 2 * coarse && one > 2 * half, "{coarse} {half} {one}");
        assert_eq!(made(0.3, true).mesh.positions, made(0.3, true).mesh.positions);
        assert!(
            cathedral(&CathedralParameters { detail: 9.0, lit: false })
                .unwrap_err()
                .contains("from 0.1 to 3.2")
        );
    }

    #[test]
    fn closed_at_every_detail() {
        for detail in [0.1, 0.37, 0.8] {
            let made = made(detail, true);
            let geometry = Geometry::new(&Scene {
                meshes: vec![made.mesh],
                materials: made.materials,
                camera: Camera { eye: Vec3::splat(1e4), ..Camera::default() },
                ..Scene::default()
            });
            assert_eq!(geometry.dropped_degenerate + geometry.dropped_duplicate, 0, "{detail}");
            let topology = analyze_topology(&geometry);
            assert_eq!(
                topology.boundary_edges + topology.inconsistent_edges + topology.inside_out,
                0,
                "{detail}: {topology:?}",
                topology = Small(&topology)
            );
            assert!(topology.closed_of_triangle.iter().all(|c| *c), "{detail}");
        }
    }

    struct Small<'a>(&'a crate::tessellate::Topology);
    impl std::fmt::Debug for Small<'_> {
        fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
            let open = self.0.closed_of_triangle.iter().filter(|c| !**c).count();
            write!(
                f,
                "open {open} boundary {} nonmanifold {} inconsistent {} inside out {}",
                self.0.boundary_edges,
                self.0.nonmanifold_edges,
                self.0.inconsistent_edges,
                self.0.inside_out
            )
        }
    }
}
