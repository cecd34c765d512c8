//! What is no file, in the place of every file that the program reads: nothing, an empty one, a
//! folder, a pipe, a device, a link to itself, a file of something else.

use super::{Case, Entry, Right, SCENE, case};

/// Things that stand where a file should.
fn things() -> Vec<(&'static str, Entry)> {
    vec![
        ("nothing", Entry::Nothing),
        ("an empty file", "".into()),
        ("a line end", "\n".into()),
        ("a byte", "x".into()),
        ("a folder", Entry::Folder),
        ("a pipe", Entry::Pipe),
        ("a link to itself", Entry::Link("LOOP")),
        ("a link to nothing", Entry::Link("/no/such/file")),
        ("a link to /dev/zero", Entry::Link("/dev/zero")),
        ("a link to /dev/null", Entry::Link("/dev/null")),
        ("a link to a folder", Entry::Link("/")),
        ("a link to what changes", Entry::Link("/proc/self/maps")),
        ("nulls", vec![0; 4096].into()),
        ("text", "This is no such file, but a letter.\n".repeat(200).into()),
        ("an ELF file", [&b"\x7fELF\x02\x01\x01"[..], &[0x5a; 900]].concat().into()),
    ]
}

/// The files that are read: name, what the scene says, and the command where it is another.
const ROLES: [(&str, &str, &[&str]); 19] = [
    ("s.toml", "", &[]),
    ("a.obj", "", &[]),
    ("b.obj", "", &["render", "b.obj", "-q", "--size", "4x4", "-o", "out.exr"]),
    ("cage.obj", "[[mesh]]\nfile = \"cage.obj\"\nsubdivision = { levels = 1 }\n", &[]),
    ("fur.hair", "[[mesh]]\nfile = \"fur.hair\"\n", &[]),
    ("fur.curves", "[[mesh]]\nfile = \"fur.curves\"\n", &[]),
    ("t.png", "[material.m]\nalbedo_texture = \"t.png\"\n", &[]),
    ("t.jpg", "[material.m]\nopacity_texture = \"t.jpg\"\n", &[]),
    ("sky.hdr", "[[light]]\ntype = \"environment\"\nfile = \"sky.hdr\"\n", &[]),
    ("sky.exr", "[[light]]\ntype = \"environment\"\nfile = \"sky.exr\"\n", &[]),
    ("k.ply", "", &["render", "s.toml", "-q", "-o", "out.exr", "--load-cache", "k.ply"]),
    (
        "r.exr",
        "",
        &["reference", "s.toml", "-q", "--spp", "2", "-o", "out.exr", "--resume", "r.exr"],
    ),
    ("p.toml", "", &["fly", "s.toml", "-q", "--path", "p.toml", "--frames", "2", "-o", "out.exr"]),
    ("one.exr", "", &["compare", "one.exr", "one.exr"]),
    ("show.exr", "", &["show", "show.exr", "-o", "out.png"]),
    ("c.ply", "", &["cloud", "gather", "s.toml", "-q", "--cloud", "c.ply", "-o", "out.exr"]),
    ("d.ply", "", &["cloud", "show", "d.ply", "-o", "out.html"]),
    ("report/report.toml", "", &["report", "report", "-o", "out.exr"]),
    ("report/a.exr", "", &["report", "report", "-o", "out.exr"]),
];

pub fn cases() -> Vec<Case> {
    let mut all = Vec::new();
    for (file, scene, arguments) in ROLES {
        for (what, entry) in things() {
            let stem = file.rsplit('/').next().unwrap_or(file);
            // A report is of what there is.
            let silent = file.starts_with("report/");
            let right = if silent { Right::Told } else { Right::Refused(stem) };
            let mut entries = vec![("s.toml", format!("{SCENE}{scene}").into())];
            // Pictures that the plan is of.
            if silent {
                entries.push(("report/x", Entry::Folder));
            }
            let looped = matches!(entry, Entry::Link("LOOP"));
            entries.push((file, if looped { Entry::Link(stem) } else { entry }));
            let case = case(format!("{what} as {file}"), right, entries);
            all.push(if arguments.is_empty() { case } else { case.arguments(arguments) });
        }
    }
    for (what, entry) in things() {
        // A library that cannot be read is a warning, one that is something else may be one.
        let entries = vec![("a.mtl", entry)];
        all.push(case(format!("{what} as a.mtl"), Right::Told, entries));
    }
    all
}
