//! A fleet in words, as a file and as a page, with the drivers in the centre.

mod figures;
mod forest;
mod page;
mod text;

pub use page::{Fit, Shown, page};
pub use text::text;

use crate::fleet::{
    Comparison, EVALUATIONS_PER_PARAMETER, Overview, Pair, ParameterOverview, Row, Rule, SCHEMA_VERSION, Settings,
    overview,
};
use crate::identify::{SHORT, SHORT_S};
use crate::report::html::short;
use crate::result::ExtensionEntry;
use crate::text::option::HOLDOUT;
use crate::trajectory::{Source, Treatment};
use indexmap::IndexMap;

/// `fleet.json`: data, settings and summary. The rows are in `parameters.csv`.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct FleetFile {
    pub schema_version: u32,
    /// The program and the state of its search.
    pub program: String,
    /// The files.
    pub data: Vec<Source>,
    /// Pairs that the files have.
    pub pairs: usize,
    /// Pairs whose data are doubtful, with the kinds of their faults.
    #[serde(default, skip_serializing_if = "IndexMap::is_empty")]
    pub doubtful: IndexMap<String, String>,
    /// Reasons for missing results, without the place, and their numbers; pairs times models and measures.
    pub reasons: IndexMap<String, usize>,
    pub convention: String,
    /// The column map, if the files have one: the name of a built-in one, or a file.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub columns: Option<String>,
    /// The car of all followers, if it was given: `NAME` or `FILE#NAME`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub vehicle: Option<String>,
    /// The treatment of the first drive.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub treatment: Option<Treatment>,
    /// The algorithm.
    pub optimizer: String,
    pub seed: u64,
    /// Largest number of simulations of a search, if requested.
    pub max_evaluations: Option<u64>,
    /// Number of simulations of a search per searched parameter, otherwise.
    pub evaluations_per_parameter: u64,
    /// Whether there are intervals.
    pub intervals: bool,
    /// Cautions, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub note: Option<String>,
    /// Bounds that differ from Table 3, by model.
    pub bounds: IndexMap<String, IndexMap<String, [f64; 2]>>,
    /// The source of the bounds.
    pub bounds_from: String,
    /// Laws and causes of the models that are not built in, with their texts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub own: Vec<ExtensionEntry>,
    /// Rule of the comparison; files of earlier versions lack it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub compared_by: Option<Rule>,
    /// The held-back data of each driver, in words.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub holdout: Option<String>,
    /// One entry per model and measure.
    pub overview: Vec<Overview>,
}

impl FleetFile {
    /// Summary of the rows.
    pub fn of(
        pairs: &[Pair],
        settings: &Settings,
        rows: &[Row],
        comparison: &Comparison,
        holdout: Option<String>,
        bounds_from: String,
    ) -> FleetFile {
        let sound = || pairs.iter().filter_map(|pair| pair.drive.as_ref().ok());
        let mut data: Vec<Source> = Vec::new();
        for drive in sound() {
            let source = &drive.trajectory.source;
            if data.last() != Some(source) && !data.contains(source) {
                data.push(source.clone());
            }
        }
        let mut reasons: IndexMap<String, usize> = IndexMap::new();
        for row in rows {
            if let Err(reason) = &row.found {
                let first = reason.lines().next().unwrap_or_default();
                let Pair { file, drive, .. } = &pairs[row.place.pair];
                let label = drive.as_ref().map_or(file, |drive| &drive.trajectory.label);
                let told =
                    first.strip_prefix(file.as_str()).or_else(|| first.strip_prefix(label.as_str())).unwrap_or(first);
                *reasons.entry(kind(told.trim_start_matches([':', ' ']))).or_default() += 1;
            }
        }
        reasons.sort_by(|a, one, b, another| another.cmp(one).then(a.cmp(b)));
        let bounds = settings.models.iter().map(|model| {
            (model.variant.name(), model.overrides.iter().map(|(name, ends)| (name.clone(), *ends)).collect())
        });
        let mut own: Vec<ExtensionEntry> = Vec::new();
        for extension in
            settings.models.iter().flat_map(|model| model.variant.law().into_iter().chain(model.variant.causes()))
        {
            let entry = ExtensionEntry::of(extension);
            if entry.text.is_some() && !own.contains(&entry) {
                own.push(entry);
            }
        }
        let short =
            settings.intervals && sound().any(|drive| drive.trajectory.len() as f64 * drive.trajectory.dt < SHORT_S);
        FleetFile {
            schema_version: SCHEMA_VERSION,
            program: crate::calibrate::PROGRAM.clone(),
            data,
            pairs: pairs.len(),
            doubtful: pairs
                .iter()
                .map(|pair| (pair.place(), pair.doubts(&settings.measures)))
                .filter(|(_, kinds)| !kinds.is_empty())
                .collect(),
            reasons,
            convention: settings.convention.to_string(),
            columns: None,
            vehicle: None,
            treatment: sound().next().map(|drive| Treatment::of(&drive.trajectory)),
            optimizer: settings.calibration.optimizer.runs().to_owned(),
            seed: settings.calibration.seed,
            max_evaluations: settings.max_evaluations,
            evaluations_per_parameter: EVALUATIONS_PER_PARAMETER,
            intervals: settings.intervals,
            note: short.then(|| SHORT.to_owned()),
            bounds: bounds.collect(),
            bounds_from,
            own,
            compared_by: Some(comparison.rule),
            holdout,
            overview: overview(pairs, settings, rows, comparison),
        }
    }

    /// The entry of the recommended model, of the first measure.
    pub fn chosen(&self) -> Option<&Overview> {
        let first = &self.overview.first()?.gof;
        let own = || self.overview.iter().filter(|one| one.gof == *first);
        own().find(|one| one.chosen).or_else(|| own().max_by_key(|one| one.calibrated))
    }

    /// All entries, that of the recommended model first.
    pub fn chosen_first(&self) -> impl Iterator<Item = &Overview> {
        let chosen = self.chosen();
        let others = self.overview.iter().filter(move |one| !chosen.is_some_and(|chosen| std::ptr::eq(chosen, *one)));
        chosen.into_iter().chain(others)
    }

    /// The pairs with doubtful data, by the kinds of their faults; at most `most` of each kind by name.
    pub fn doubts(&self, most: usize) -> String {
        let mut by_kind: IndexMap<&str, Vec<&str>> = IndexMap::new();
        self.doubtful.iter().for_each(|(pair, kinds)| by_kind.entry(kinds).or_default().push(pair));
        let told = |(kinds, pairs): (&str, Vec<&str>)| {
            if pairs.len() > 1 && pairs.len() == self.pairs {
                return format!("all ({kinds})");
            }
            let more = pairs.len().saturating_sub(most);
            let more = if more > 0 { format!(" and {more} more") } else { String::new() };
            format!("{}{more} ({kinds})", pairs[..most.min(pairs.len())].join(", "))
        };
        by_kind.into_iter().map(told).collect::<Vec<_>>().join("; ")
    }

    /// Rule of the comparison, in a sentence; empty for one model without held-back data.
    pub fn rule(&self) -> String {
        let held = self.holdout.as_deref().unwrap_or("what was held back");
        let several = self.overview.iter().any(|one| one.model != self.overview[0].model);
        match self.compared_by {
            Some(Rule::HeldBack) => format!("Compared: the score on {held}, on data that no fit has used."),
            Some(Rule::Expected) if several => format!(
                "Compared: the score that is expected on another drive of the same driver, its own score plus a penalty for fitted noise. \
                 {HOLDOUT} 0.3 measures it."
            ),
            Some(Rule::None) if several => format!(
                "Not compared: on its own drive the larger of two nested models always fits better. Give {HOLDOUT} 0.3, or \
                 let leadlag estimate intervals."
            ),
            _ => String::new(),
        }
    }

    /// Result of the comparison of the models by the first measure, in a sentence; empty without one.
    pub fn verdict(&self) -> String {
        let Some(chosen) = self.chosen().filter(|one| one.behind.is_some()) else { return String::new() };
        let own = self.overview.iter().filter(|one| one.gof == chosen.gof && one.model != chosen.model);
        let (mut open, mut worse) = (Vec::new(), 0);
        for one in own {
            match one.behind {
                Some(behind) if behind.is_open() => open.push(one.model.as_str()),
                _ => worse += 1,
            }
        }
        let chosen = &chosen.model;
        match (open.as_slice(), worse) {
            ([], 0) => String::new(),
            ([], _) => format!("{chosen} follows these drivers best."),
            (open, _) => {
                format!(
                    "{chosen} cannot be distinguished from {}, and none of them has fewer parameters.",
                    open.join(", ")
                )
            }
        }
    }

    /// Calibrations with a result.
    pub fn calibrated(&self) -> usize {
        self.overview.iter().map(|one| one.calibrated).sum()
    }

    /// As JSON, for `fleet.json`.
    pub fn to_json(&self) -> String {
        serde_json::to_string_pretty(self).expect("numbers and text can be written") + "\n"
    }
}

/// What to do about doubtful data.
const ADVICE: &str = "leadlag inspect has the remedies";

/// A reason without the numbers of the one pair that has it.
fn kind(reason: &str) -> String {
    let mut kind = String::new();
    for c in reason.chars() {
        match c {
            '0'..='9' if kind.ends_with('#') => {}
            '0'..='9' => kind.push('#'),
            '.' if kind.ends_with('#') => {}
            c => kind.push(c),
        }
    }
    kind.replace("#.#", "#")
}

/// A parameter with its unit.
fn heading(parameter: &ParameterOverview) -> String {
    match parameter.unit.as_str() {
        "-" => parameter.name.clone(),
        unit => format!("{} [{unit}]", parameter.name),
    }
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

fn range([low, high]: [f64; 2]) -> String {
    format!("{} to {}", short(low), short(high))
}
