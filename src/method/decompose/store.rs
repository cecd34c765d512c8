//! Proxy, clusters and their SH in one file: binary little-endian PLY, whose first element viewers
//! show as coloured points.
//!
//! The comments hold a [`crate::method::key`]: kind "decomposition", the scene, the settings of the
//! proxy and of passes 1 and 2. The element `vertex` holds the clusters: x y z nx ny nz radius,
//! sh_0_r sh_0_g sh_0_b …, red green blue. The other element holds the rows of the proxy
//! ([`SavedProxy`]). Coefficient l² + l + m of colour c is `sh_<index>_<c>`, radiance
//! (W·sr⁻¹·m⁻²), as [`crate::sh`] has them. Settings of pass 3 may differ between the render that
//! saves and the one that loads, and so may the camera and the seed.
//!
//! Floats are stored as they are: what is loaded is bit for bit what was saved. A file is there
//! whole or not at all; files of another scene, other settings or another version, cut short or
//! damaged, are refused, with what differs. A cluster takes 31 B and 12 B for each
//! coefficient.

use std::path::Path;

use glam::Vec3;

use super::far::SampledClusters;
use super::{DecomposeSettings, Prepared};
use crate::error::{Error, Result};
use crate::method::key::Key;
use crate::method::stage::Inputs;
use crate::ply::{self, Columns, Rows};
use crate::proxy::{ProxySettings, SavedProxy};
use crate::radiometry::Rgb;
use crate::scene::Fingerprint;
use crate::sh::ShRgb;
use crate::shading::World;

const VERSION: u32 = 6;

/// Settings of the last pass, of sampling the camera, and lengths, which count by their value in
/// this scene.
const LEFT_OUT: [&str; 13] = [
    "alpha",
    "near_cell",
    "cluster_radius",
    "blend_radius",
    "pool_radius",
    "record_stride",
    "near_integral",
    "near_samples",
    "near_visibility",
    "near_rays",
    "near_noise",
    "near_filter",
    "near_filter_reach",
];

/// What does not belong to a view: the proxy, clusters without members, their SH.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Known {
    /// The proxy.
    pub proxy: SavedProxy,
    /// Clusters without members, and their distant light.
    pub sampled: SampledClusters,
}

impl Known {
    /// Of a render.
    pub fn new(prepared: &Prepared) -> Self {
        let Prepared { sampled, stage, .. } = prepared;
        let mut sampled = sampled.clone();
        sampled.clusters.forget_members();
        Self { proxy: stage.proxy.saved(), sampled }
    }
}

/// What a file belongs to.
pub fn key(
    scene: Fingerprint,
    inputs: &Inputs<'_>,
    settings: &DecomposeSettings,
    world: &World,
) -> Key {
    let lengths = settings.lengths(world.around.extent);
    Key::new("decomposition", VERSION, scene, world.around)
        .with("decompose", settings, &LEFT_OUT)
        .with("proxy", inputs.photon, &[])
        // As text: infinity is no number in JSON.
        .with_value("decompose.alpha", lengths.alpha.to_string())
        .with_value("decompose.cluster_radius", lengths.cluster_radius)
        .with_value("decompose.pool_radius", lengths.pool_radius)
        .with_value("decompose.near_cell", inputs.near_cell)
}

fn columns(bands: u32, proxy: &ProxySettings) -> [Columns; 2] {
    let names = |list: &[&str]| list.iter().map(|&n| n.to_owned()).collect::<Vec<String>>();
    let mut vertex = names(&[
        "x", "y", "z", "nx", "ny", "nz", "radius", "anchor_x", "anchor_y", "anchor_z", "scale",
    ]);
    vertex.extend((0..bands * bands).flat_map(|i| ["r", "g", "b"].map(|c| format!("sh_{i}_{c}"))));
    [
        Columns::new("vertex").floats(vertex).bytes(["red", "green", "blue"]),
        Columns::new(SavedProxy::element(proxy))
            .floats(SavedProxy::floats(proxy))
            .bytes(SavedProxy::bytes(proxy)),
    ]
}

/// Writes what a render knows.
///
/// # Errors
/// [`Error::Write`] when the system refuses.
pub fn save(
    path: &Path,
    key: &Key,
    known: &Known,
    inputs: &Inputs<'_>,
    settings: &DecomposeSettings,
) -> Result<()> {
    save_with(path, key, known, (inputs, settings), Vec::new())
}

/// As [`save`], with more elements after those of the render.
///
/// # Errors
/// As [`save`].
pub fn save_with(
    path: &Path,
    key: &Key,
    known: &Known,
    (inputs, settings): (&Inputs<'_>, &DecomposeSettings),
    more: Vec<(Columns, Rows)>,
) -> Result<()> {
    let SampledClusters { clusters, sh } = &known.sampled;
    let irradiance: Vec<Rgb> =
        sh.iter().zip(&clusters.normal).map(|(sh, &n)| sh.irradiance(n)).collect();
    let scale = ply::colour_scale(irradiance.iter().copied());
    let (mut vertex, mut rows) = (Rows::default(), Rows::default());
    for (i, &e) in irradiance.iter().enumerate() {
        let coefficients = sh[i]
            .0
            .iter()
            .take((settings.sh_bands * settings.sh_bands) as usize)
            .flat_map(|c| c.to_array());
        let c = clusters;
        let place =
            c.center[i].to_array().into_iter().chain(c.normal[i].to_array()).chain([c.radius[i]]);
        let place = place.chain(c.anchor[i].to_array()).chain([c.scale_of(i)]);
        vertex.push(place.chain(coefficients), &ply::colour(e, scale));
    }
    for (floats, bytes) in known.proxy.rows() {
        rows.push(floats, &bytes);
    }
    let [of_vertex, of_proxy] = columns(settings.sh_bands, inputs.photon);
    let mut elements = vec![(of_vertex, vertex), (of_proxy, rows)];
    elements.extend(more);
    ply::write_elements(path, &key.comments(), &elements)
}

/// Reads a file that belongs to `key`.
///
/// # Errors
/// [`Error::Input`] for files of something else, cut short, or with numbers that cannot be.
pub fn load(
    path: &Path,
    key: &Key,
    inputs: &Inputs<'_>,
    settings: &DecomposeSettings,
) -> Result<Known> {
    load_with(path, key, (inputs, settings), &[]).map(|(known, _)| known)
}

/// As [`load`], with more elements after those of the render.
///
/// # Errors
/// As [`load`].
pub fn load_with(
    path: &Path,
    key: &Key,
    (inputs, settings): (&Inputs<'_>, &DecomposeSettings),
    more: &[Columns],
) -> Result<(Known, Vec<Rows>)> {
    let mut columns = columns(settings.sh_bands, inputs.photon).to_vec();
    columns.extend_from_slice(more);
    let mut rows = ply::read_elements(path, |comments| key.difference(comments), &columns)?;
    let damaged = |element: &str, i: usize| {
        Error::input(
            path,
            None,
            format!(
                "{element} {i} is damaged: a number is not finite or out of range; save it again"
            ),
        )
    };
    let mut known = Known::default();
    for (i, (v, _)) in rows[0].iter(&columns[0]).enumerate() {
        let normal = Vec3::from_slice(&v[3..]);
        if !v.iter().all(|x| x.is_finite()) || (normal.length() - 1.0).abs() > 1e-3 || v[6] < 0.0 {
            return Err(damaged("cluster", i));
        }
        let c = &mut known.sampled.clusters;
        c.center.push(Vec3::from_slice(&v));
        c.normal.push(normal);
        c.radius.push(v[6]);
        c.anchor.push(Vec3::from_slice(&v[7..]));
        c.scale.push(v[10]);
        let mut sh = ShRgb::default();
        sh.0.iter_mut().zip(v[11..].chunks_exact(3)).for_each(|(c, v)| *c = Vec3::from_slice(v));
        known.sampled.sh.push(sh);
    }
    let clusters = &mut known.sampled.clusters;
    clusters.forget_members();
    if clusters.scale.iter().all(|&s| s == 1.0) {
        clusters.scale.clear();
    }
    known.proxy = SavedProxy::from_rows(rows[1].iter(&columns[1]), inputs.photon)
        .map_err(|row| damaged(SavedProxy::element(inputs.photon), row))?;
    Ok((known, rows.split_off(2)))
}
