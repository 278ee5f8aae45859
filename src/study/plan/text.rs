//! The TOML of a plan, and its checks.

use super::several::Several;
use super::{CalibrationPlan, DataPlan, Extend, PLAN_VERSION, Plan, PlanError, PlatoonPlan};
use super::{StoredExtension, Validation};
use crate::calibrate::{BoundSet, EVALUATIONS_MIN, OptimizerKind, Overrides, REPLICATES_MAX, Stop};
use crate::catalog::Variant;
use crate::lanes::LanesPrecision;
use crate::score::GoodnessOfFit;
use crate::select::{Kind, Selection};
use crate::symbols::Symbol;
use crate::text::spelling::{any_of, nearest};
use crate::trajectory::Layout;
use serde::Deserialize;
use std::collections::{BTreeSet, HashSet};
use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use strum::VariantNames;

/// The key of the variants.
pub(super) const VARIANTS: &str = "calibration.variants";

/// Goodness-of-fit functions of the paper (Section 4.1), for suggestions.
const GOFS: [&str; 6] = ["nrmse-sva", "nrmse-sv", "rmse-s", "rmse-v", "u-sv", "u-sva"];

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlanText {
    schema_version: u32,
    name: Option<String>,
    data: DataText,
    platoon: Vec<PlatoonText>,
    calibration: CalibrationText,
    #[serde(default)]
    validation: ValidationText,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct DataText {
    #[serde(default)]
    folder: PathBuf,
    vehicles: Option<PathBuf>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PlatoonText {
    name: String,
    file: Option<PathBuf>,
    table: Option<PathBuf>,
    files: Option<PathBuf>,
    layout: Option<String>,
    columns: Option<String>,
    trajectory: Option<String>,
    trajectories: Option<String>,
    followers: Option<Several<usize>>,
    #[serde(default)]
    smooth: bool,
    from_s: Option<f64>,
    to_s: Option<f64>,
    grade: Option<String>,
    leader_start_m: Option<f64>,
    vehicle: Option<String>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct CalibrationText {
    variants: Several<VariantText>,
    #[serde(default)]
    extend: Several<String>,
    gof: Option<Several<String>>,
    convention: Option<String>,
    replicates: Option<u64>,
    seed: Option<u64>,
    optimizer: Option<String>,
    max_evaluations: Option<u64>,
    max_stall: Option<u64>,
    evaluator: Option<String>,
    precision: Option<String>,
    bounds: Option<toml::Value>,
}

#[derive(Deserialize)]
#[serde(untagged, expecting = "expected ids and names of variants, such as [1, \"gipps+delay\", \"19-36\"]")]
enum VariantText {
    Id(u32),
    Name(String),
}

#[derive(Deserialize, Default)]
#[serde(deny_unknown_fields)]
struct ValidationText {
    on: Option<String>,
}

pub(super) fn read(
    content: &str,
    path: &str,
    folder: &Path,
    name: &str,
    stored: &[StoredExtension],
) -> Result<Plan, PlanError> {
    let plan: PlanText = toml::from_str(content).map_err(|error| at(content, path, &error))?;
    if plan.schema_version != PLAN_VERSION {
        let (path, found) = (path.to_owned(), plan.schema_version);
        return Err(PlanError::Version { path, expected: PLAN_VERSION, found });
    }
    let of = Reader { path, folder, stored };
    Ok(Plan {
        name: plan.name.unwrap_or_else(|| name.to_owned()),
        data: DataPlan {
            folder: folder.join(plan.data.folder),
            vehicles: plan.data.vehicles,
            platoons: of.platoons(plan.platoon)?,
        },
        calibration: of.calibration(plan.calibration)?,
        validation: match plan.validation.on.as_deref() {
            None | Some("same-vehicle") => Validation::SameVehicle,
            Some("none") => Validation::None,
            Some(found) => {
                return Err(of.word("validation.on", found, "same-vehicle or none", ["same-vehicle", "none"]));
            }
        },
    })
}

/// Message of the TOML reader, with the place and the nearest known key.
fn at(content: &str, path: &str, error: &toml::de::Error) -> PlanError {
    let start = error.span().map_or(0, |span| span.start).min(content.len());
    let before = &content[..start];
    let line = before.matches('\n').count() + 1;
    let column = before.rsplit('\n').next().map_or(0, |text| text.chars().count()) + 1;
    let message = error.message().trim().to_owned();
    let mut quoted = message.split('`').skip(1).step_by(2);
    let unknown = message.starts_with("unknown field").then(|| quoted.next()).flatten();
    let nearest = unknown.and_then(|word| nearest(word, quoted)).map(str::to_owned);
    let mut reason = message.replace("unknown field", "unknown key").replace("missing field", "missing key");
    // Replaces words of the program's language by those of the plan's.
    for (type_name, words) in [
        ("expected u64", "expected a whole number from 0"),
        ("expected u32", "expected a whole number from 0"),
        ("expected usize", "expected a whole number from 0"),
        ("expected f64", "expected a number"),
    ] {
        reason = reason.replace(type_name, words);
    }
    // Messages about values and about invalid TOML have no key.
    let of_value = ["invalid type", "invalid value", "expected "].iter().any(|begin| reason.starts_with(begin));
    let text = content.lines().nth(line - 1).unwrap_or_default();
    let key = text.split_once('=').map(|(key, _)| key.trim()).filter(|_| of_value);
    let reason = key.map_or(reason.clone(), |key| format!("{key}: {reason}"));
    PlanError::Toml { path: path.to_owned(), line, column, reason, nearest }
}

/// Reads the values of one plan.
pub(super) struct Reader<'a> {
    /// The plan, for messages.
    pub path: &'a str,
    /// The folder to which names of files are relative.
    pub folder: &'a Path,
    /// Extensions whose texts are known already.
    pub stored: &'a [StoredExtension],
}

impl Reader<'_> {
    pub(super) fn value(&self, key: impl Into<String>, reason: impl Display, nearest: Option<&str>) -> PlanError {
        let (path, nearest) = (self.path.to_owned(), nearest.map(str::to_owned));
        PlanError::Value { path, key: key.into(), reason: reason.to_string(), nearest }
    }

    fn word<'a>(&self, key: &str, found: &str, expected: &str, known: impl IntoIterator<Item = &'a str>) -> PlanError {
        self.value(key, format!("expected {expected}, found `{found}`"), nearest(found, known))
    }

    pub(super) fn parse<T: FromStr<Err: Display>>(
        &self,
        key: &str,
        text: &str,
        known: &[&str],
    ) -> Result<T, PlanError> {
        text.parse().map_err(|e| self.value(key, e, nearest(text, known.iter().copied())))
    }

    /// One of the words of an enum.
    fn one_of<T: FromStr + VariantNames>(&self, key: &str, text: &str) -> Result<T, PlanError> {
        text.parse().map_err(|_| self.word(key, text, &any_of(T::VARIANTS), T::VARIANTS.iter().copied()))
    }

    fn platoons(&self, entries: Vec<PlatoonText>) -> Result<Vec<PlatoonPlan>, PlanError> {
        if entries.is_empty() {
            return Err(self.value("platoon", "expected at least one [[platoon]]", None));
        }
        let layouts = Layout::names();
        let mut names = HashSet::new();
        let mut platoons = Vec::new();
        for mut entry in entries {
            let followers = entry.followers.take().map(|several| several.0);
            let key = |field: &str| format!("platoon {}: {field}", entry.name);
            let plain = |c: char| c.is_ascii_alphanumeric() || "-_.".contains(c);
            if entry.name.is_empty() || !entry.name.chars().all(plain) {
                return Err(self.value(key("name"), "expected letters, digits, `-`, `_` and `.`", None));
            }
            if !names.insert(entry.name.clone()) {
                return Err(self.value(key("name"), "occurs more than once", None));
            }
            if let Some(followers) = &followers {
                let distinct: HashSet<_> = followers.iter().collect();
                if followers.is_empty() || followers.contains(&0) || distinct.len() < followers.len() {
                    let reason = "expected numbers from 1 (right behind the platoon leader), each once";
                    return Err(self.value(key("followers"), format!("{reason}, found {followers:?}"), None));
                }
            }
            let named = [&entry.file, &entry.table, &entry.files].into_iter().flatten().count();
            if named != 1 {
                let reason = format!("expected one of file, table and files, found {named} of them");
                return Err(self.value(key("file"), reason, None));
            }
            let is_pattern = entry.files.is_some();
            let stars = |file: &PathBuf| {
                let name = file.file_name().unwrap_or_default().to_string_lossy().into_owned();
                [file.to_string_lossy().matches('*').count(), name.matches('*').count()]
            };
            if let Some(files) = entry.files.as_ref().filter(|files| stars(files) != [1, 1]) {
                let reason =
                    format!("expected one * in the name of the file, such as pairs/*.csv, found {}", files.display());
                return Err(self.value(key("files"), reason, None));
            }
            if let Some(found) = entry.trajectories.as_deref().filter(|text| *text != "all") {
                return Err(self.word(&key("trajectories"), found, "all; one is chosen by trajectory", ["all"]));
            }
            if entry.trajectories.is_some() && entry.trajectory.is_some() {
                return Err(self.value(key("trajectories"), "not together with trajectory", None));
            }
            if entry.columns.is_some() && entry.layout.is_some() {
                return Err(self.value(
                    key("layout"),
                    "not together with columns, which describe their own layout",
                    None,
                ));
            }
            let layout = entry.layout.as_deref().map(|text| self.parse(&key("layout"), text, &layouts)).transpose()?;
            platoons.push(PlatoonPlan {
                layout,
                columns: entry.columns,
                trajectory: entry.trajectory,
                all: entry.trajectories.is_some(),
                is_pattern,
                name: entry.name,
                file: entry.file.or(entry.table).or(entry.files).expect("one of them is there"),
                followers,
                smooth: entry.smooth,
                from: entry.from_s,
                to: entry.to_s,
                grade: entry.grade,
                leader_start: entry.leader_start_m,
                vehicle: entry.vehicle,
            });
        }
        Ok(platoons)
    }

    fn calibration(&self, entry: CalibrationText) -> Result<CalibrationPlan, PlanError> {
        let default = Stop::default();
        let gofs = entry.gof.map_or_else(|| vec![GoodnessOfFit::NRMSE_SVA.to_string()], |several| several.0);
        let gofs = gofs.iter().map(|text| self.parse("calibration.gof", text, &GOFS)).collect::<Result<Vec<_>, _>>()?;
        self.once("calibration.gof", &gofs.iter().map(GoodnessOfFit::to_string).collect::<Vec<_>>())?;
        let convention = entry.convention.as_deref().unwrap_or("paper");
        let optimizer = entry.optimizer.as_deref().unwrap_or("auto");
        let (evaluator, precision) = self.evaluator(entry.evaluator.as_deref(), entry.precision.as_deref())?;
        let extend = self.extensions(entry.extend.0)?;
        let mut laws = Vec::new();
        let variants = self.variants(&entry.variants.0, &mut laws)?;
        let variants = self.extended(variants, &extend)?;
        self.have_own_columns(&laws, &extend)?;
        Ok(CalibrationPlan {
            bounds: self.bounds(entry.bounds.as_ref(), &variants)?,
            variants,
            gofs,
            convention: self.parse("calibration.convention", convention, &["paper", "authors"])?,
            replicates: self.within("calibration.replicates", entry.replicates.unwrap_or(1), [1, REPLICATES_MAX])?,
            seed: entry.seed.unwrap_or(1),
            optimizer: self.parse::<OptimizerKind>("calibration.optimizer", optimizer, OptimizerKind::VARIANTS)?,
            stop: Stop {
                max_evaluations: self.within(
                    "calibration.max_evaluations",
                    entry.max_evaluations.unwrap_or(default.max_evaluations),
                    [EVALUATIONS_MIN, u64::MAX],
                )?,
                max_stall: self.within(
                    "calibration.max_stall",
                    entry.max_stall.unwrap_or(default.max_stall),
                    [1, u64::MAX],
                )?,
                ..default
            },
            extend,
            laws,
            evaluator,
            precision,
        })
    }

    fn within(&self, key: &str, found: u64, [lowest, highest]: [u64; 2]) -> Result<u64, PlanError> {
        let expected = match found {
            _ if found < lowest => format!("at least {lowest}"),
            _ if found > highest => format!("at most {highest}"),
            _ => return Ok(found),
        };
        Err(self.value(key, format!("expected {expected}, found {found}"), None))
    }

    fn once(&self, key: &str, items: &[String]) -> Result<(), PlanError> {
        if items.is_empty() {
            return Err(self.value(key, "expected at least one", None));
        }
        let mut seen = HashSet::new();
        match items.iter().find(|item| !seen.insert(*item)) {
            Some(twice) => Err(self.value(key, format!("{twice} occurs more than once"), None)),
            None => Ok(()),
        }
    }

    /// Ids, names, `all`, ranges of ids such as `1-90`, and files with a law.
    fn variants(&self, entries: &[VariantText], laws: &mut Vec<Extend>) -> Result<Vec<Variant>, PlanError> {
        let key = VARIANTS;
        let by_id = |id| Variant::from_id(id).map_err(|e| self.value(key, e, None));
        let mut variants: Vec<Variant> = Vec::new();
        for entry in entries {
            let range = |text: &str| {
                let (first, last) = text.split_once('-')?;
                Some((first.trim().parse::<u32>().ok()?, last.trim().parse::<u32>().ok()?))
            };
            match entry {
                VariantText::Id(id) => variants.push(by_id(*id)?),
                VariantText::Name(name) if name == "all" => variants.extend(Variant::all()),
                VariantText::Name(name) => match range(name) {
                    Some((first, last)) if first > last => {
                        return Err(self.value(key, format!("expected a range FIRST-LAST, found `{name}`"), None));
                    }
                    Some((first, last)) => {
                        by_id(last)?;
                        variants.extend((first..=last).map(by_id).collect::<Result<Vec<_>, _>>()?);
                    }
                    None => variants.push(self.variant(name, laws)?),
                },
            }
        }
        self.once(key, &variants.iter().map(Variant::name).collect::<Vec<_>>())?;
        Ok(variants)
    }

    /// `lanes` by default: the same bytes on every machine.
    fn evaluator(
        &self,
        name: Option<&str>,
        precision: Option<&str>,
    ) -> Result<(Kind, Option<LanesPrecision>), PlanError> {
        let kind = self.one_of("calibration.evaluator", name.unwrap_or("lanes"))?;
        let precision = precision.map(|text| self.one_of("calibration.precision", text)).transpose()?;
        let selection = Selection { kind, precision, ..Selection::default() };
        // The words of the command line become keys here.
        selection.check().map_err(|e| self.value("calibration.precision", e.to_string().replace("--", ""), None))?;
        Ok((kind, precision))
    }

    /// Bounds of parameters that variants of the plan have: a set by its name, or bounds by parameter, where `set` may name a set that they
    /// partly replace.
    fn bounds(&self, given: Option<&toml::Value>, variants: &[Variant]) -> Result<Overrides, PlanError> {
        match given {
            None => Ok(Overrides::new()),
            Some(toml::Value::String(set)) => self.set("calibration.bounds", set, variants),
            Some(toml::Value::Table(table)) => {
                let (mut table, mut bounds) = (table.clone(), Overrides::new());
                if let Some(set) = table.get("set").and_then(toml::Value::as_str) {
                    bounds = self.set("calibration.bounds.set", set, variants)?;
                    table.remove("set");
                }
                bounds.extend(self.single(&table, variants)?);
                Ok(bounds)
            }
            Some(found) => {
                let expected = "expected a set, such as \"human\", or a table such as { v_0 = [25, 40] }";
                Err(self.value("calibration.bounds", format!("{expected}; found {found}"), None))
            }
        }
    }

    /// The bounds of a named set for every variant.
    fn set(&self, key: &str, set: &str, variants: &[Variant]) -> Result<Overrides, PlanError> {
        let set: BoundSet = self.one_of(key, set)?;
        Ok(variants.iter().flat_map(|variant| set.overrides(variant)).collect())
    }

    fn single(&self, table: &toml::Table, variants: &[Variant]) -> Result<Overrides, PlanError> {
        let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|i| i as f64));
        let known: BTreeSet<Symbol> = variants.iter().flat_map(Variant::parameters).collect();
        let mut bounds = Overrides::new();
        for (name, value) in table {
            let key = format!("calibration.bounds.{name}");
            let symbol = known.iter().find(|symbol| symbol.name() == name).ok_or_else(|| {
                let near = nearest(name, known.iter().map(|symbol| symbol.name()));
                self.value(&key, "not a parameter of any variant of this plan", near)
            })?;
            let pair = match value.as_array().map(Vec::as_slice) {
                Some([lower, upper]) => number(lower).zip(number(upper)).map(|(lower, upper)| [lower, upper]),
                Some(_) => None,
                None => number(value).map(|x| [x, x]),
            };
            let domain = symbol.domain();
            let possible =
                |[lower, upper]: &[f64; 2]| domain.contains(*lower) && domain.contains(*upper) && lower <= upper;
            let pair = pair.filter(possible).ok_or_else(|| {
                let expected = domain.expected();
                let reason = format!(
                    "expected [lower, upper] in order, or one number to fix it, each {expected}; found {value}"
                );
                self.value(&key, reason, None)
            })?;
            bounds.insert(name.clone(), pair);
        }
        Ok(bounds)
    }
}
