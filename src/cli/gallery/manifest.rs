//! The sections of the gallery's page: one a scene, further ones for sweeps, layers and switches,
//! of the pictures that are there.

use std::path::Path;

use super::key::with;
use super::plan::{Plan, SceneEntry, TRUTH};
use crate::page::report::manifest::{Manifest, SectionPlan, Sweep, Toggle};

/// What `report.toml` in `output` says.
pub(super) fn manifest(plan: &Plan, scenes: &[&SceneEntry], output: &Path) -> Manifest {
    let section = scenes.iter().flat_map(|scene| Section::all(plan, scene, output)).collect();
    Manifest {
        title: Some("nearfar: the gallery".into()),
        text: format!(
            "Diffuse global illumination by near/far irradiance decomposition beside irradiance \
             caching and path-traced ground truth of {} samples a pixel, {}x{}. Times are of the \
             machine that made the page.",
            plan.spp, plan.size.0, plan.size.1
        ),
        section,
    }
}

/// Makes the sections of one scene.
struct Section<'a> {
    scene: &'a SceneEntry,
    output: &'a Path,
}

impl Section<'_> {
    fn all(plan: &Plan, scene: &SceneEntry, output: &Path) -> Vec<SectionPlan> {
        let makes = Section { scene, output };
        [makes.methods(), makes.by_hand(), makes.visibility(), makes.sweep(plan)]
            .into_iter()
            .flatten()
            .collect()
    }

    fn there(&self, name: &str) -> bool {
        with(&self.output.join(self.scene.name).join(name), "exr").is_file()
    }

    fn all_there(&self, names: &[&str]) -> bool {
        names.iter().all(|n| self.there(n))
    }

    /// A section of those pictures that are there; what is compared at first are `pair`.
    fn section(&self, what: &str, text: &str, names: &[&str], pair: [&str; 2]) -> SectionPlan {
        let there = names.iter().filter(|n| self.there(n)).map(|&n| n.to_owned());
        SectionPlan {
            folder: self.scene.name.into(),
            title: Some(format!("{}{what}", self.scene.title)),
            text: text.into(),
            pictures: there.collect(),
            reference: self.there(TRUTH).then(|| TRUTH.into()),
            pair: self.all_there(&pair).then(|| pair.map(str::to_owned)),
            ..SectionPlan::default()
        }
    }

    fn toggle(&self, label: &str, off: &str, on: &str) -> Option<Toggle> {
        self.all_there(&[off, on]).then(|| Toggle {
            label: label.into(),
            off: off.into(),
            on: on.into(),
        })
    }

    fn methods(&self) -> Option<SectionPlan> {
        let (ours, cache) = ("decomposition", "irradiance-cache");
        if !self.there(ours) && !self.there(TRUTH) {
            return None;
        }
        let names = [ours, cache, "point-based", TRUTH];
        let section = self.section("", self.scene.text, &names, [ours, TRUTH]);
        Some(SectionPlan {
            ratio: self.all_there(&[ours, cache]).then(|| [cache, ours].map(str::to_owned)),
            layers: self.there(ours).then(|| ours.into()).into_iter().collect(),
            toggle: self.toggle("point-based method", ours, "point-based").into_iter().collect(),
            ..section
        })
    }

    fn by_hand(&self) -> Option<SectionPlan> {
        let pair = ["uncorrected", "corrected"];
        let text = "Off: lights without shadows and a flat ambient term. On: corrected by the near \
                    surfaces.";
        let toggle = self.toggle("local correction", pair[0], pair[1])?;
        let names = [pair[0], pair[1], TRUTH];
        let section = self.section(": local correction", text, &names, pair);
        Some(SectionPlan { toggle: vec![toggle], ..section })
    }

    fn visibility(&self) -> Option<SectionPlan> {
        let [assumed, traced, ours] = ["assumed", "traced", "decomposition"];
        let text = "assumed: every near surface counts as seen, as in the course. traced: one ray \
                    to each. decomposition: the default, short rays.";
        let repair = self.toggle("visibility repair", assumed, ours)?;
        let names = [assumed, traced, ours, TRUTH];
        let section = self.section(": visibility of near surfaces", text, &names, [assumed, ours]);
        let toggle =
            [Some(repair), self.toggle("one ray a surface", assumed, traced)].into_iter().flatten();
        Some(SectionPlan { toggle: toggle.collect(), ..section })
    }

    fn sweep(&self, plan: &Plan) -> Option<SectionPlan> {
        let name = |alpha: f64| format!("alpha-{alpha}");
        let values: Vec<f64> =
            plan.alphas().iter().copied().filter(|&a| self.there(&name(a))).collect();
        let pictures: Vec<String> = values.iter().map(|&a| name(a)).collect();
        if values.len() < 2 {
            return None;
        }
        let text = "The near distance, in per cent of the extent of the scene: at 0 everything \
                    is far.";
        let names: Vec<&str> = pictures.iter().map(String::as_str).chain([TRUTH]).collect();
        let section = self.section(": alpha", text, &names, [names[0], TRUTH]);
        let sweep = Sweep { label: "alpha in %".into(), values, pictures };
        Some(SectionPlan { sweep: Some(sweep), ..section })
    }
}
