//! The text of OBJ and MTL files as programs really write it → text as the parser takes it.
//!
//! [`decode`] takes UTF-8, UTF-16 with a byte order mark and, as Latin-1, what is neither; lines
//! may end in LF, CR LF or CR. [`plain`] writes statements as `tobj` reads them:
//!
//! * lines that go on after a backslash are joined, comments after data cut off, tabs made spaces;
//! * `usemtl` without a name gets one, and its comment is cut off where no material has it in its
//!   name;
//! * normals that are not finite become zero, which means the face's own; colours of vertices are
//!   cut off (both are counted, for a warning);
//! * faces that name texture coordinates or normals and faces that do not are put into groups of
//!   their own, for `tobj` gives a group either to all of its faces or to none.
//!
//! Text that needs none of this is handed on as it is. Cost: a parallel look at every line.

use std::borrow::Cow;
use std::fmt::Write;

use rayon::prelude::*;

/// Name of the material of `usemtl` without one.
pub const UNNAMED: &str = "default";

/// The text of a file, its lines ending in LF.
pub fn decode(bytes: Vec<u8>) -> String {
    let wide = |from_bytes: fn([u8; 2]) -> u16| {
        let units = bytes[2..].chunks_exact(2).map(|b| from_bytes([b[0], b[1]]));
        char::decode_utf16(units).map(|c| c.unwrap_or(char::REPLACEMENT_CHARACTER)).collect()
    };
    let mut text = match bytes.get(..2) {
        Some([0xff, 0xfe]) => wide(u16::from_le_bytes),
        Some([0xfe, 0xff]) => wide(u16::from_be_bytes),
        _ => String::from_utf8(bytes)
            .unwrap_or_else(|e| e.as_bytes().iter().map(|&b| char::from(b)).collect()),
    };
    if text.starts_with('\u{feff}') {
        text.remove(0);
    }
    if text.contains('\r') {
        text = text.replace("\r\n", "\n").replace('\r', "\n");
    }
    text
}

/// What was changed that the user should know.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Changed {
    /// Normals that were not finite.
    pub normals: usize,
    /// Vertices with a colour.
    pub colours: usize,
    /// `usemtl` without a name.
    pub unnamed: usize,
}

/// Statements whose words are numbers, which a comment may follow and a backslash may break.
fn is_data(key: &str) -> bool {
    matches!(key, "v" | "vt" | "vn" | "f" | "l" | "p" | "s")
}

fn key(line: &str) -> &str {
    line.split_ascii_whitespace().next().unwrap_or("")
}

/// Which of texture coordinate and normal a face corner names.
fn form(corner: &str) -> [bool; 2] {
    let mut parts = corner.split('/').skip(1).map(|part| !part.is_empty());
    std::array::from_fn(|_| parts.next().unwrap_or(false))
}

/// That which all corners of a face name.
fn face_form(line: &str) -> [bool; 2] {
    let corners = line.split_ascii_whitespace().skip(1).map(form);
    corners.reduce(|[a, b], [c, d]| [a && c, b && d]).unwrap_or_default()
}

/// A number for each form, as a bit; all bits for what [`plain`] has to change.
fn look(line: &str) -> u8 {
    const CHANGE: u8 = 0xff;
    let key = key(line);
    let change = match key {
        "f" => {
            let face = face_form(line);
            let mixed = line.split_ascii_whitespace().skip(1).any(|c| form(c) != face);
            if mixed || line.contains(['#', '\\']) {
                return CHANGE;
            }
            return 1 << (usize::from(face[0]) + 2 * usize::from(face[1]));
        }
        "v" => line.split_ascii_whitespace().count() > 5 || line.contains(['#', '\\']),
        "vn" => line.contains(['#', '\\', 'n', 'N', 'i', 'I']) && !finite(line),
        "vt" | "l" | "p" => line.contains(['#', '\\']),
        "usemtl" => line.contains('\t') || line.split_ascii_whitespace().count() != 2,
        _ => false,
    };
    if change { CHANGE } else { 0 }
}

/// Whether a `vn` line has three finite numbers; one without three numbers is not for us to judge.
fn finite(line: &str) -> bool {
    let words = line.split_ascii_whitespace().skip(1).take(3);
    !line.contains('\\') && words.filter_map(|w| w.parse::<f32>().ok()).all(f32::is_finite)
}

/// Data lines joined and without comments; other lines as they are. Lines that were joined leave
/// empty ones, so that line numbers stay.
pub fn joined(text: &str) -> Cow<'_, str> {
    let touched = |line: &str| line.contains(['#', '\\']) && is_data(key(line));
    if !text.par_lines().any(touched) {
        return Cow::Borrowed(text);
    }
    let mut out = String::with_capacity(text.len());
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if !is_data(key(line)) {
            out.push_str(line);
            out.push('\n');
            continue;
        }
        let mut gone = 0;
        let mut part = line;
        loop {
            let data = part.split('#').next().unwrap_or("").trim_end();
            let Some(start) = data.strip_suffix('\\') else {
                out.push_str(data);
                break;
            };
            out.push_str(start);
            out.push(' ');
            let Some(next) = lines.next() else { break };
            part = next;
            gone += 1;
        }
        out.extend(std::iter::repeat_n('\n', gone + 1));
    }
    Cow::Owned(out)
}

/// The text as `tobj` reads it, and what is lost. `text` comes from [`joined`]; `material` gives
/// the name that one in `usemtl` means.
pub fn plain(text: &str, material: impl Fn(&str) -> String) -> (Cow<'_, str>, Changed) {
    let seen = text.par_lines().map(look).reduce(|| 0, |a, b| a | b);
    if seen.count_ones() <= 1 {
        return (Cow::Borrowed(text), Changed::default());
    }
    let mut out = String::with_capacity(text.len() + text.len() / 8);
    let (mut changed, mut group, mut last) = (Changed::default(), "", None);
    for line in text.lines() {
        match key(line) {
            "f" => {
                let face = face_form(line);
                if last.is_some_and(|last| last != face) {
                    out.push_str("g ");
                    out.push_str(group);
                    out.push('\n');
                }
                last = Some(face);
                write_face(&mut out, line, face);
            }
            "v" if line.split_ascii_whitespace().count() == 7 => {
                changed.colours += 1;
                out.extend(line.split_ascii_whitespace().take(4).flat_map(|w| [w, " "]));
            }
            "vn" if !finite(line) => {
                changed.normals += 1;
                out.push_str("vn 0 0 0");
            }
            "g" | "o" => {
                group = line.trim_start()[1..].trim();
                out.push_str(line);
            }
            "usemtl" => {
                let name = name(line);
                changed.unnamed += usize::from(name.is_empty());
                let meant = if name.is_empty() { UNNAMED.into() } else { material(name) };
                // A string takes whatever is written to it.
                let _ = write!(out, "usemtl {meant}");
            }
            _ => out.push_str(line),
        }
        out.push('\n');
    }
    (Cow::Owned(out), changed)
}

/// What stands after the key of a line.
pub fn name(line: &str) -> &str {
    line.trim_start().split_once([' ', '\t']).map_or("", |(_, rest)| rest.trim())
}

/// A face whose corners all have the given form.
fn write_face(out: &mut String, line: &str, [vt, vn]: [bool; 2]) {
    out.push('f');
    for corner in line.split_ascii_whitespace().skip(1) {
        let parts: Vec<&str> = corner.split('/').collect();
        let part = |i: usize, wanted: bool| parts.get(i).filter(|_| wanted).map_or("", |p| p);
        let _ = match (vt, vn) {
            // What is no corner is left for the parser to refuse.
            _ if parts.len() > 3 => write!(out, " {corner}"),
            (false, false) => write!(out, " {}", parts[0]),
            (true, false) => write!(out, " {}/{}", parts[0], part(1, vt)),
            (_, true) => write!(out, " {}/{}/{}", parts[0], part(1, vt), part(2, vn)),
        };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cleaned(text: &str) -> String {
        plain(&joined(text), |name| name.into()).0.into_owned()
    }

    #[test]
    fn encodings_and_line_ends() {
        let wide = |to: fn(u16) -> [u8; 2]| {
            "\u{feff}v 1\r\né".encode_utf16().flat_map(to).collect::<Vec<u8>>()
        };
        assert_eq!(decode(wide(u16::to_le_bytes)), "v 1\né");
        assert_eq!(decode(wide(u16::to_be_bytes)), "v 1\né");
        assert_eq!(decode(b"\xef\xbb\xbfv 1\rv 2\r".to_vec()), "v 1\nv 2\n");
        assert_eq!(decode(b"usemtl gr\xfcn".to_vec()), "usemtl grün");
    }

    #[test]
    fn plain_text_stays() {
        let text = "mtllib a.mtl\nv 1 2 3\nvn 0 0 1\nusemtl m\nf 1//1 1//1 1//1\n# a\\\n";
        assert!(matches!(joined(text), Cow::Borrowed(_)));
        assert!(matches!(plain(text, |name| name.into()).0, Cow::Borrowed(_)));
    }

    #[test]
    fn lines_are_joined_and_comments_cut() {
        assert_eq!(joined("f 1 2 \\\n3 # x\n# c \\\nv 1 1 1#y\n"), "f 1 2  3\n\n# c \\\nv 1 1 1\n");
        assert_eq!(joined("f 1 2 \\"), "f 1 2  \n");
    }

    #[test]
    fn statements() {
        assert_eq!(cleaned("usemtl\tred\nusemtl\n"), "usemtl red\nusemtl default\n");
        let (text, changed) = plain("vn nan 0 1\nv 1 2 3 0 0 1\n", |name| name.into());
        assert_eq!((&*text, changed.normals, changed.colours), ("vn 0 0 0\nv 1 2 3 \n", 1, 1));
    }

    #[test]
    fn faces_of_other_forms_are_groups_of_their_own() {
        let text = "g a\nf 1/1 2/2 3/3\nf 1 2 3\nf 1/1/1 2//2 3/3/3\n";
        let expected = "g a\nf 1/1 2/2 3/3\ng a\nf 1 2 3\ng a\nf 1//1 2//2 3//3\n";
        assert_eq!(cleaned(text), expected);
    }
}
