//! Curve files → [`Curves`]: Cem Yuksel's binary `.hair`, and text as Mitsuba 3's curve shapes read
//! it.
//!
//! **`.hair`**, little-endian: a header of 128 bytes (`"HAIR"`, u32 strands, u32 points, u32
//! arrays, u32 default segments, f32 default thickness, f32 default transparency, 3 × f32 default
//! colour, 88 bytes of text), then the arrays whose bit is set: segments u16 a strand (bit 0),
//! points 3 × f32 (bit 1, always there), thickness f32 a point (bit 2), transparency f32 a point
//! (bit 3), colour 3 × f32 a point (bit 4). A strand of n segments has n + 1 points. Thickness is
//! taken for the diameter; the colours' mean becomes the albedo; transparency is left out with a
//! warning.
//!
//! **Text** (`.curves`, `.txt`): a control point a line, `x y z radius`; an empty line ends a
//! curve; `#` begins a comment. The radius may be left out where the scene gives `width`. Points of
//! text are read in double precision and kept relative to an origin of the file.

use std::path::Path;

use glam::{DVec3, Vec3};

use super::origin::origin_of;
use crate::error::{Error, Result};
use crate::input_file;
use crate::math::Aabb;
use crate::radiometry::Rgb;
use crate::scene::Curves;

/// Largest coordinate over the diagonal: beyond, single precision has fewer than 4096 steps for the
/// whole file.
const MAX_OFFSET: f32 = 4096.0;

/// Curves and what colour the file gives them.
#[derive(Debug)]
pub struct CurveFile {
    /// Linear curves, relative to `origin`; the scene may say otherwise.
    pub curves: Curves,
    /// Zero of the curves' coordinates, the file's space.
    pub origin: DVec3,
    /// Mean colour.
    pub albedo: Option<Rgb>,
}

/// True for names that [`read_curves`] understands.
pub fn is_curve_file(path: &Path) -> bool {
    path.extension().is_some_and(|x| {
        ["hair", "curves", "txt"].iter().any(|known| x.eq_ignore_ascii_case(known))
    })
}

/// Reads a curve file; `width` (diameter) replaces the file's own.
///
/// # Errors
/// [`Error::Io`], or [`Error::Input`] with the line (text) or the place (binary).
pub fn read_curves(
    path: &Path,
    width: Option<f32>,
    warnings: &mut Vec<String>,
) -> Result<CurveFile> {
    let bytes = input_file::read(path)?;
    let binary = path.extension().is_some_and(|x| x.eq_ignore_ascii_case("hair"));
    let mut file =
        if binary { read_hair(path, &bytes, warnings)? } else { read_text(path, &bytes, width)? };
    file.curves.name = path.display().to_string();
    if let Some(width) = width {
        file.curves.widths.fill(width);
    }
    let left_out = drop_points(&mut file.curves);
    if left_out > 0 {
        warnings.push(format!(
            "{}: {left_out} curves are but a point and are left out",
            path.display()
        ));
    }
    if file.curves.is_empty() {
        return Err(Error::input(path, None, "holds no curves; export it again"));
    }
    Ok(file)
}

/// Leaves out curves without extent; returns how many.
fn drop_points(curves: &mut Curves) -> usize {
    let is_point = |i: usize| {
        let points = &curves.points[curves.curve(i)];
        points.iter().all(|p| *p == points[0])
    };
    let (points, rest): (Vec<usize>, Vec<usize>) = (0..curves.len()).partition(|&i| is_point(i));
    if !points.is_empty() {
        let mut kept =
            Curves { name: curves.name.clone(), basis: curves.basis, ..Curves::default() };
        for i in rest {
            let range = curves.curve(i);
            kept.push_curve(range.map(|k| (curves.points[k], curves.widths[k])));
        }
        *curves = kept;
    }
    points.len()
}

fn read_text(path: &Path, bytes: &[u8], width: Option<f32>) -> Result<CurveFile> {
    let text = std::str::from_utf8(bytes)
        .map_err(|_| Error::input(path, None, "is not UTF-8 text; save it as UTF-8"))?;
    // Points with their widths, and where each curve begins.
    let mut points: Vec<(DVec3, f32)> = Vec::new();
    let mut starts = vec![0];
    let end = |count: usize, starts: &mut Vec<usize>| {
        if starts.last() != Some(&count) {
            starts.push(count);
        }
    };
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let comment = line.trim_start().starts_with('#');
        let content = line.split('#').next().unwrap_or_default();
        if content.trim().is_empty() {
            if !comment {
                end(points.len(), &mut starts);
            }
            continue;
        }
        let fail = |message: String| Error::input(path, index + 1, message);
        let mut n = Vec::with_capacity(4);
        for word in content.split_whitespace() {
            let x = word.parse::<f64>().ok().filter(|x| (*x as f32).is_finite());
            n.push(x.ok_or_else(|| {
                fail(format!("\"{word}\" is no finite number; a point is x y z radius"))
            })?);
        }
        let p = match (n.len(), width) {
            (4, _) if n[3] < 0.0 => {
                return Err(fail(format!(
                    "the radius {} is negative; give a radius from 0 on",
                    n[3]
                )));
            }
            (4, _) => (DVec3::new(n[0], n[1], n[2]), (2.0 * n[3]) as f32),
            (3, Some(width)) => (DVec3::new(n[0], n[1], n[2]), width),
            (3, None) => return Err(fail(
                "the point has no radius; write x y z radius, or give curves.width in the scene"
                    .into(),
            )),
            (count, _) => {
                return Err(fail(format!("a point is x y z radius, found {count} numbers")));
            }
        };
        points.push(p);
    }
    end(points.len(), &mut starts);
    let origin =
        origin_of(points.len(), points.iter(), |p| p.0).map_err(|m| Error::input(path, None, m))?;
    let mut curves = Curves::default();
    for pair in starts.windows(2) {
        let near = |&(p, width): &(DVec3, f32)| ((p - origin).as_vec3(), width);
        curves.push_curve(points[pair[0]..pair[1]].iter().map(near));
    }
    Ok(CurveFile { curves, origin, albedo: None })
}

const HEADER: usize = 128;

fn read_hair(path: &Path, bytes: &[u8], warnings: &mut Vec<String>) -> Result<CurveFile> {
    let fail = |message: String| Error::input(path, None, message);
    if bytes.len() < HEADER || &bytes[..4] != b"HAIR" {
        return Err(fail(
            "is no HAIR file: its header is missing; give a .hair file, or rename a text file to \
             .curves"
                .into(),
        ));
    }
    let word = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
    let (whole, real) =
        (|at: usize| u32::from_le_bytes(word(at)), |at: usize| f32::from_le_bytes(word(at)));
    let (strands, points, arrays, segments) =
        (whole(4) as usize, whole(8) as usize, whole(12), whole(16) as usize);
    let has = |bit: u32| arrays >> bit & 1 == 1;
    if !has(1) {
        return Err(fail("has no points array; export it again".into()));
    }
    let sizes =
        [(0, 2 * strands), (1, 12 * points), (2, 4 * points), (3, 4 * points), (4, 12 * points)];
    let need = HEADER + sizes.iter().filter(|(bit, _)| has(*bit)).map(|(_, n)| n).sum::<usize>();
    if bytes.len() < need {
        return Err(fail(format!(
            "is cut short: {strands} strands of {points} points take {need} bytes, the file has \
             {}; copy it again",
            bytes.len()
        )));
    }
    let mut at = HEADER;
    let mut array = |bit: u32| {
        has(bit).then(|| {
            let from = at;
            at += sizes[bit as usize].1;
            &bytes[from..at]
        })
    };
    let floats = |b: &[u8]| {
        b.chunks_exact(4)
            .map(|w| f32::from_le_bytes([w[0], w[1], w[2], w[3]]))
            .collect::<Vec<f32>>()
    };
    if strands > points {
        return Err(fail(format!(
            "its header says {strands} strands of {points} points together; export it again"
        )));
    }
    let counts: Vec<usize> = match array(0) {
        Some(b) => {
            b.chunks_exact(2).map(|w| usize::from(u16::from_le_bytes([w[0], w[1]]))).collect()
        }
        None => vec![segments; strands],
    };
    let total = counts.iter().map(|n| n + 1).sum::<usize>();
    if total != points {
        return Err(fail(format!(
            "its strands have {total} points together, its header says {points}; export it again"
        )));
    }
    let positions: Vec<Vec3> =
        floats(array(1).unwrap_or_default()).chunks_exact(3).map(Vec3::from_slice).collect();
    if let Some(i) = positions.iter().position(|p| !p.is_finite()) {
        return Err(fail(format!("point {i} is not finite; export it again")));
    }
    let around = Aabb::around(positions.iter().copied());
    let farthest = around.min.abs().max(around.max.abs()).max_element();
    if farthest > MAX_OFFSET * around.diagonal() {
        return Err(fail(format!(
            "lies {farthest:.0} units from its origin and is {:.3} units large: the single \
             precision of .hair files cannot tell its points apart there; export it about its \
             origin, and move it by translate in the [[mesh]]",
            around.diagonal()
        )));
    }
    let widths = array(2).map_or_else(|| vec![real(20); points], floats);
    if let Some(i) = widths.iter().position(|w| !w.is_finite() || *w < 0.0) {
        return Err(fail(format!(
            "the thickness of point {i} is {}; it must be finite and not negative",
            widths[i]
        )));
    }
    if array(3).map_or(real(24) > 0.0, |b| floats(b).iter().any(|t| *t > 0.0)) {
        warnings.push(format!("{}: transparency of hair is left out", path.display()));
    }
    let colors = array(4).map_or_else(|| vec![real(28), real(32), real(36)], floats);
    let mean = colors.chunks_exact(3).map(|c| Rgb::from_slice(c).as_dvec3()).sum::<glam::DVec3>()
        / (colors.len() / 3).max(1) as f64;
    let mut curves = Curves { widths, points: positions, starts: vec![0], ..Curves::default() };
    let mut start = 0;
    curves.starts.extend(counts.iter().map(|n| {
        start += *n as u32 + 1;
        start
    }));
    let albedo = mean.as_vec3();
    let usable = albedo.is_finite() && albedo.min_element() >= 0.0 && albedo.max_element() <= 1.0;
    Ok(CurveFile { curves, origin: DVec3::ZERO, albedo: usable.then_some(albedo) })
}
