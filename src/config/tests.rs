use super::*;

fn config(text: &str) -> Result<RenderConfig> {
    RenderConfig::from_table(text.parse().unwrap())
}

fn error(text: &str) -> String {
    config(text).unwrap_err().to_string()
}

#[test]
fn values_and_defaults() {
    let c = config("seed = 4\n[path]\nspp = 3\n[decompose]\nnear_cell = \"3%\"").unwrap();
    assert_eq!((c.seed, c.path.spp, c.path.max_depth), (4, 3, 0));
    assert_eq!(c.decompose.near_cell, Some(crate::length::Length::Percent(3.0)));
    let written = RenderConfig::default().to_table().unwrap();
    assert_eq!(RenderConfig::from_table(written).unwrap(), config("").unwrap());
}

#[test]
fn the_reference_lists_what_is_written() {
    let table = RenderConfig::default().to_table().unwrap();
    let whole = Value::Table(table.clone());
    let mut listed = Vec::new();
    for setting in RenderConfig::reference().iter().flat_map(|g| &g.settings) {
        let found = setting.key.split('.').try_fold(&whole, |at, k| at.get(k));
        let follows = setting.default.starts_with("follows: ");
        assert!(found.is_some() != follows, "{} has no default, or two", setting.key);
        assert!(!setting.meaning.is_empty() && !setting.meaning.contains("  "), "{setting:?}");
        listed.push(setting.key.clone());
    }
    for (key, value) in &table {
        if let Value::Table(inner) = value {
            assert!(inner.keys().all(|k| listed.contains(&format!("{key}.{k}"))), "{key}");
        }
    }
}

#[test]
fn unknown_keys_are_named_and_mended() {
    for (text, expected) in [
        (
            "[path]\nsppp = 3",
            "setting \"path.sppp\": unknown key; did you mean \"path.spp\"? (keys of [path]: spp, ",
        ),
        ("[pth]\nspp = 3", "setting \"pth.spp\": unknown key; did you mean \"path.spp\"? (sect"),
        ("spp = 3", "setting \"spp\": unknown key; did you mean \"record.spp\"? (sections: direct"),
        ("denose = 3", "setting \"denose\": unknown key; did you mean \"denoise\"? "),
        ("zebra = 3", "setting \"zebra\": unknown key (sections: "),
        ("[photon]\ncount = 3", "setting \"photon.count\": is called \"proxy.photons\" now"),
        ("[photon]\nrays = 3", "setting \"photon.rays\": the section is called [proxy] now"),
        ("[points]\nbias = 3", "setting \"points.bias\": the section is called [point_based] now"),
        ("[points]\npointbased = true", "setting \"points.pointbased\": is no setting any more"),
        ("path = 3", "setting \"path\": is a section, not a value: write path.KEY = VALUE"),
    ] {
        assert!(error(text).starts_with(expected), "{}", error(text));
    }
}

#[test]
fn wrong_values_are_named_with_what_is_allowed() {
    for (text, expected) in [
        (
            "[decompose]\nnear_cell = 0.1\nalpha = \"x\"",
            "setting \"decompose.alpha\": \"x\" is not allowed: write a length, at least 0, or inf",
        ),
        (
            "[path]\nspp = \"many\"",
            "setting \"path.spp\": \"many\" is not allowed: write a whole number, at least 1",
        ),
        ("[path]\nspp = 0", "setting \"path.spp\": 0 is not allowed"),
        (
            "denoise = \"odin\"",
            "setting \"denoise\": \"odin\" is not allowed: write one of auto, none, oidn",
        ),
        (
            "[proxy]\nestimate = \"gathr\"",
            "setting \"proxy.estimate\": \"gathr\" is not allowed: write one of cells, gather, \
             density, places; did you mean \"gather\"?",
        ),
        (
            "[direct]\nlight_samples = 0",
            "setting \"direct.light_samples\": 0 is not allowed: write a whole number, 1 to 4096",
        ),
        (
            "[record]\nshare_normal_cos = nan",
            "setting \"record.share_normal_cos\": NaN is not allowed: write a number, -1 to 1",
        ),
        (
            "[decompose]\npool_radius = inf",
            "setting \"decompose.pool_radius\": inf is not allowed: write a length, at least 0",
        ),
        ("[cache]\nmax_spacing = 1.0", "setting \"cache.max_spacing\": must be at least cache.min"),
        ("[local]\nambient = [[1.0, 2.0]]", "setting \"local.ambient\": [[1.0, 2.0]] is not"),
        ("[local]\nambient = []", "setting \"local.ambient\": write one RGB triple"),
    ] {
        assert!(error(text).starts_with(expected), "{}", error(text));
    }
}

/// Every number there is refuses NaN and less than nothing; those that may be infinite say so.
#[test]
fn numbers_are_checked_as_a_kind() {
    let mut floats = 0;
    for setting in RenderConfig::reference().into_iter().flat_map(|g| g.settings) {
        let (section, key) = setting.key.split_once('.').unwrap_or(("", &setting.key));
        let with = |value: &str| {
            let head = if section.is_empty() { String::new() } else { format!("[{section}]\n") };
            config(&format!("{head}{key} = {value}")).map(drop).map_err(|e| e.to_string())
        };
        if !["whole number", "number", "length"].contains(&setting.kind) {
            continue;
        }
        let mut bad = vec!["-1e30", "nan", "true", "\"x\""];
        let cosine = setting.range.starts_with('-');
        if setting.kind == "whole number" {
            bad.extend(["-1", "1.5"]);
        } else {
            floats += 1;
            bad.extend((!cosine).then_some("-0.1"));
            bad.extend((!setting.range.contains("inf")).then_some("inf"));
        }
        for value in bad {
            let refused = with(value).err().unwrap_or_default();
            assert!(
                refused.contains(&format!("\"{}\"", setting.key)),
                "{key} = {value}: {refused}"
            );
        }
    }
    assert!(floats > 30, "{floats}");
}

#[test]
fn what_follows_gives_way_to_what_is_set() {
    let filter = |text: &str| config(text).unwrap().decompose.near_filter();
    assert_eq!(filter(""), 4);
    assert_eq!(filter("denoise = \"oidn\""), 0);
    assert_eq!(filter("denoise = \"oidn\"\n[decompose]\nnear_filter = 3"), 3);
    assert_eq!(config("[record]\nfilter = \"tent\"").unwrap().path.filter.radius, 1.0);
    let mut by_hand = RenderConfig { denoise: Some(Denoise::Oidn), ..RenderConfig::default() };
    by_hand.record.filter_radius = Some(2.0);
    let taken = by_hand.for_method(Method::Path, 1.0).unwrap();
    assert_eq!((taken.path.filter.radius, taken.decompose.near_filter()), (2.0, 0));
}
