//! A point file as one page for a browser: discs, clusters, cache records, sample locations or
//! photons, to be walked around, coloured by any of their numbers and picked.
//!
//! Input   any binary little-endian PLY whose first element is `vertex` with `x y z`. `nx ny nz`
//!         make discs possible; their size is `_area`, or else `radius`, or else the mean of
//!         `radius_along` and `radius_across`; without any the elements are points.
//! Output  HTML that needs nothing else: style, program and data are inside, and its policy lets it
//!         ask nobody for anything. WebGL2 and a browser of 2023 or later.
//! Data    columns, elements in the order of [`crate::cloud::Hierarchy`]; bytes of equal weight
//!         stand together (all first bytes, all second …), which lets DEFLATE find what neighbours
//!         have in common; then base64. Nodes of the tree follow as columns of their own: range of
//!         elements, depth, centre, normal, area. Means over a node are taken in the page.
//!
//! Guarantees  what a pick shows is the number in the file, to the last bit; only pictures are
//!             rounded (colours and normals to 8 bits).
//! Not     numbers of later elements than `vertex`, lists, text or big-endian files.
//! Cost    about 50 B an element in the page for what `nearfar cloud bake` writes, 24 B on the
//!         graphics card, one buffer and one draw call.
//!
//! | File | Job |
//! |---|---|
//! | `table` | [`Table`]: the columns of a file |
//! | `pack` | columns as text |
//! | `viewer.html`, `viewer.css` | what the page looks like |
//! | `data.js`, `camera.js` | columns and colours, the view |
//! | `draw.js`, `viewer.js` | WebGL, the controls |

mod pack;
mod table;

use glam::Vec3;
use serde_json::json;

use crate::cloud::{Cloud, Hierarchy, HitSides};
use crate::error::Result;
use pack::column;
pub use table::Table;

const PAGE: &str = include_str!("viewer.html");
const STYLE: &str = include_str!("viewer.css");
const PROGRAM: [&str; 4] = [
    include_str!("data.js"),
    include_str!("camera.js"),
    include_str!("draw.js"),
    include_str!("viewer.js"),
];

/// The page of a table. Call inside the thread pool.
///
/// # Errors
/// [`crate::error::Error::Render`] for tables without elements or with more than 2³⁰.
pub fn page(table: &Table, title: &str) -> Result<String> {
    let (cloud, sized) = cloud(table);
    let tree = Hierarchy::new(&cloud, HitSides::Both)?;
    let (mut columns, mut data) = (Vec::new(), String::new());
    let mut add =
        |list: &mut Vec<serde_json::Value>, name: &str, kind: &str, bytes: &[u8], size: usize| {
            list.push(json!({ "name": name, "type": kind }));
            data.push_str("<script type=\"text/plain\" class=\"column\">");
            data.push_str(&column(bytes, size));
            data.push_str("</script>\n");
        };
    for c in table.columns() {
        add(&mut columns, c.name, c.type_code(), &table.sorted(&c, tree.order()), c.kind.size());
    }
    let index: Vec<u8> = tree.order().iter().flat_map(|i| i.to_le_bytes()).collect();
    add(&mut columns, "", "u4", &index, 4);
    let (groups, mut nodes) = (tree.all_groups(), Vec::new());
    let ints = |f: &dyn Fn(&crate::cloud::Group) -> u32| {
        groups.iter().flat_map(|g| f(g).to_le_bytes()).collect::<Vec<u8>>()
    };
    for (name, bytes) in [
        ("first", ints(&|g| g.first)),
        ("count", ints(&|g| g.count)),
        ("depth", ints(&|g| g.depth << 1 | u32::from(g.leaf))),
        ("x", ints(&|g| g.center.x.to_bits())),
        ("y", ints(&|g| g.center.y.to_bits())),
        ("z", ints(&|g| g.center.z.to_bits())),
        ("nx", ints(&|g| g.normal.x.to_bits())),
        ("ny", ints(&|g| g.normal.y.to_bits())),
        ("nz", ints(&|g| g.normal.z.to_bits())),
        ("area", ints(&|g| g.area.to_bits())),
    ] {
        add(
            &mut nodes,
            name,
            if matches!(name, "first" | "count" | "depth") { "u4" } else { "f4" },
            &bytes,
            4,
        );
    }
    let meta = json!({
        "count": table.len(), "columns": columns, "nodes": nodes, "comments": table.comments,
        "sized": sized, "oriented": table.has_normals(),
    });
    // "<" could end the script that holds it.
    let meta = meta.to_string().replace('<', "\\u003c");
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    Ok(fill(&[
        ("title", &title),
        ("style", STYLE),
        ("meta", &meta),
        ("data", &data),
        ("program", &PROGRAM.concat()),
    ]))
}

/// The template with its `{{name}}` replaced, each once, none inside a replacement.
fn fill(parts: &[(&str, &str)]) -> String {
    let mut page =
        String::with_capacity(PAGE.len() + parts.iter().map(|p| p.1.len()).sum::<usize>());
    let mut rest = PAGE;
    while let Some((before, after)) = rest.split_once("{{") {
        let Some((name, after)) = after.split_once("}}") else { break };
        page.push_str(before);
        page.push_str(parts.iter().find(|p| p.0 == name).map_or("", |p| p.1));
        rest = after;
    }
    page.push_str(rest);
    page
}

/// Places, normals and areas for the tree; whether the areas are of the file.
fn cloud(table: &Table) -> (Cloud, bool) {
    let (n, count) = (table.normals(), table.len());
    let areas = table.areas();
    let sized = areas.is_some();
    let usable = |a: f32| if a.is_finite() && a > 0.0 { a } else { f32::MIN_POSITIVE };
    let cloud = Cloud {
        p: table.places(),
        n: n.map_or_else(
            || vec![Vec3::Z; count],
            |n| n.into_iter().map(|v| v.try_normalize().unwrap_or(Vec3::Z)).collect(),
        ),
        area: areas.map_or_else(|| vec![1.0; count], |a| a.into_iter().map(usable).collect()),
        one_sided: vec![false; count],
        channels: Vec::new(),
    };
    (cloud, sized)
}

/// Writes the page of a table, whole or not at all.
///
/// # Errors
/// As [`page`], and [`crate::error::Error::Write`] when the system refuses.
pub fn write_page(table: &Table, title: &str, path: &std::path::Path) -> Result<()> {
    crate::atomic_file::write_bytes(path, page(table, title)?)
}
