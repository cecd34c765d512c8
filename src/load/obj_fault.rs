//! Finds the line of an OBJ file that a parser stumbled over, and says how to mend it.

/// Counts of positions, texture coordinates and normals.
#[derive(Clone, Copy, Default)]
struct Counts([i64; 3]);

const KINDS: [&str; 3] = ["vertices", "texture coordinates", "normals"];

/// The first faulty line (1-based) and what is wrong with it.
pub fn find_fault(text: &str) -> Option<(usize, String)> {
    let kind = |line: &str| {
        ["v", "vt", "vn"].iter().position(|k| line.split_whitespace().next() == Some(k))
    };
    let mut totals = Counts::default();
    for line in text.lines() {
        if let Some(k) = kind(line) {
            totals.0[k] += 1;
        }
    }
    // Most parsers allow a face before its vertices; the second look does not.
    [true, false].into_iter().find_map(|forward| {
        let mut seen = Counts::default();
        for (index, line) in text.lines().enumerate() {
            if let Some(k) = kind(line) {
                seen.0[k] += 1;
            }
            if let Some(message) = fault(line, seen, if forward { totals } else { seen }) {
                return Some((index + 1, message));
            }
        }
        None
    })
}

fn fault(line: &str, seen: Counts, allowed: Counts) -> Option<String> {
    let mut words = line.split_whitespace();
    let rest: Vec<&str>;
    let key = words.next()?;
    let shown = line.trim();
    match key {
        "v" | "vt" | "vn" => {
            rest = words.collect();
            let need = if key == "vt" { 2 } else { 3 };
            if rest.len() < need {
                return Some(format!(
                    "\"{key}\" needs {need} numbers, found \"{shown}\"; export the mesh again"
                ));
            }
            if let Some(word) = rest.iter().take(need).find(|w| w.parse::<f32>().is_err()) {
                return Some(format!(
                    "\"{word}\" is not a number in \"{shown}\"; export the mesh again"
                ));
            }
            if rest.iter().take(need).any(|w| w.parse::<f32>().is_ok_and(|x| !x.is_finite())) {
                return Some(format!(
                    "numbers must be finite, found \"{shown}\"; correct or remove the vertex"
                ));
            }
            if key == "v"
                && rest.len() == 4
                && rest[3].parse::<f32>().map_or(true, |w| w == 0.0 || !w.is_finite())
            {
                return Some(format!(
                    "the fourth number of a vertex divides the others and may not be \"{}\"; \
                     remove it",
                    rest[3]
                ));
            }
            if key == "v" && (rest.len() == 5 || rest.len() > 6) {
                return Some(format!(
                    "a vertex has 3 numbers, 4 with a weight or 6 with a colour, found {}; export \
                     the mesh again",
                    rest.len()
                ));
            }
            None
        }
        "f" | "l" => words.find_map(|corner| corner_fault(corner, seen, allowed)),
        _ => None,
    }
}

fn corner_fault(corner: &str, seen: Counts, allowed: Counts) -> Option<String> {
    if corner.split('/').count() > 3 {
        return Some(format!("\"{corner}\" is not a face corner; write v, v/vt, v//vn or v/vt/vn"));
    }
    corner.split('/').enumerate().find_map(|(k, word)| {
        if word.is_empty() && k > 0 {
            return None;
        }
        let Ok(index) = word.parse::<i64>() else {
            let large = !word.is_empty() && word.bytes().all(|b| b.is_ascii_digit());
            return Some(if large {
                format!(
                    "index {word} is out of range: the file has {} {}; correct the index or \
                     export the mesh again",
                    allowed.0[k], KINDS[k]
                )
            } else {
                format!("\"{corner}\" is not a face corner; write v, v/vt, v//vn or v/vt/vn")
            });
        };
        if index == 0 {
            return Some(format!("index 0 in \"{corner}\" is not allowed: OBJ files count from 1"));
        }
        let absolute = if index < 0 { seen.0[k] + index + 1 } else { index };
        (absolute < 1 || absolute > allowed.0[k]).then(|| {
            format!(
                "index {index} is out of range: the file has {} {}; correct the index or export \
                 the mesh again",
                allowed.0[k], KINDS[k]
            )
        })
    })
}
