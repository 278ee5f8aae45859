//! Result of a calibration.

use super::calibration::Calibration;
use super::drive::Drive;
use super::error::Error;
use super::loading::Loaded;
#[cfg(feature = "cli")]
use crate::evaluator::Case;
use crate::reference::Trace;
use crate::rescore;
use crate::result::ResultFile;
use crate::score::Measures;
use crate::simulate::CalibratedVariant;
use crate::trajectory::Treatment;
use indexmap::IndexMap;
use std::fmt;
use std::path::Path;

/// Calibrated parameters, with intervals and correlations.
#[derive(Debug, Clone)]
pub struct Fit {
    result: ResultFile,
    variant: CalibratedVariant,
    warnings: Vec<String>,
}

/// A run of a calibrated model on a drive.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Simulation {
    /// Times \[s\] of the samples up to the end of the run.
    pub time: Vec<f64>,
    /// Simulated spacing \[m\].
    pub spacing: Vec<f64>,
    /// Simulated speed \[m/s\].
    pub speed: Vec<f64>,
    /// Simulated acceleration \[m/s²\].
    pub acceleration: Vec<f64>,
    /// Every measure of the error by name, such as `nrmse_sva` or `rmse_s`; those that do not exist for the drive are left out, all of them
    /// if the run ended early.
    pub scores: IndexMap<&'static str, f64>,
    /// Why the run ended early: a crash, for example.
    pub ended: Option<String>,
    /// Differences in the treatment of this drive and of the calibrated ones, one line each.
    pub warnings: Vec<String>,
}

impl Fit {
    pub(super) fn of(result: ResultFile) -> anyhow::Result<Fit> {
        let variant = result.calibrated_variant()?;
        Ok(Fit { result, variant, warnings: Vec::new() })
    }

    pub(super) fn with_warning(mut self, warning: Option<String>) -> Fit {
        self.warnings.extend(warning);
        self
    }

    /// What a calibration could not add to its result, one line each; empty for a fit that was read.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Reads a `result.json` that a calibration wrote.
    ///
    /// # Errors
    /// For text that is not a fit, or a model that this version lacks.
    pub fn read(path: impl AsRef<Path>) -> Result<Fit, Error> {
        Ok(Fit::of(ResultFile::read(path.as_ref()).map_err(anyhow::Error::from)?)?)
    }

    /// Reads the text of a `result.json`.
    ///
    /// # Errors
    /// As [`Fit::read`].
    pub fn from_json(text: &str) -> Result<Fit, Error> {
        Ok(Fit::of(serde_json::from_str(text).map_err(anyhow::Error::from)?)?)
    }

    /// The text of `result.json`: the fit, and its settings.
    #[must_use]
    pub fn to_json(&self) -> String {
        self.result.to_json()
    }

    /// The model, by its name.
    #[must_use]
    pub fn model(&self) -> String {
        self.result.model()
    }

    /// The minimised measure, by the f64 reference.
    #[must_use]
    pub fn score(&self) -> f64 {
        let gof = self.result.gof.replace('-', "_");
        let best = self.result.replicates.iter().filter_map(|replicate| replicate.score).reduce(f64::min);
        let pooled = self.result.per_drive.as_ref().and_then(|scores| scores.pooled);
        self.result.score.get(&gof).copied().flatten().or(pooled).or(best).unwrap_or(f64::NAN)
    }

    /// The calibrated parameters by the paper's symbols, in SI units; of own parameters, those in the middle of the drivers.
    #[must_use]
    pub fn parameters(&self) -> &IndexMap<String, f64> {
        &self.result.parameters
    }

    /// 95 % intervals of the parameters that the data determine.
    #[must_use]
    pub fn intervals(&self) -> &IndexMap<String, [f64; 2]> {
        &self.result.intervals
    }

    /// Parameters within 0.1 % of their range of a bound.
    #[must_use]
    pub fn at_bound(&self) -> &[String] {
        &self.result.at_bound
    }

    /// The units of the parameters.
    #[must_use]
    pub fn units(&self) -> &IndexMap<String, String> {
        &self.result.units
    }

    /// Simulates the calibrated model on a drive, by the f64 reference.
    ///
    /// # Errors
    /// For a drive that lacks data of the model.
    pub fn simulate(&self, drive: &Drive) -> Result<Simulation, Error> {
        let one = self.on(drive)?;
        let parameters = &self.variant.parameters;
        let case = self.variant.case(&one.trajectory, one.vehicle()).map_err(anyhow::Error::from)?;
        case.check(parameters).map_err(anyhow::Error::from)?;
        let mut trace = Trace::default();
        let outcome = rescore::outcome(&case, parameters, &mut trace).map_err(anyhow::Error::from)?;
        let now = Treatment::of(&drive.trajectory);
        let warnings = self.result.data.first().and_then(|data| data.treatment.differs(&now));
        let scores = outcome.result.map_or_else(
            |_| IndexMap::new(),
            |measures| {
                let finite = |(name, value): (&&'static str, f64)| value.is_finite().then_some((*name, value));
                Measures::NAMES.iter().zip(measures.values()).filter_map(finite).collect()
            },
        );
        let ended = outcome.result.err().map(|failure| {
            let t = drive.trajectory.t.get(failure.step).copied().unwrap_or(f64::NAN);
            format!("{} at sample {} ({t:.1} s)", failure.kind, failure.step)
        });
        let time = drive.trajectory.t[..trace.s.len()].to_vec();
        let Trace { s: spacing, v: speed, a: acceleration, .. } = trace;
        Ok(Simulation { time, spacing, speed, acceleration, scores, ended, warnings: warnings.into_iter().collect() })
    }

    /// The drives with their cars, for their runs.
    #[cfg(feature = "cli")]
    pub(crate) fn cases(&self, drives: &[&Drive]) -> anyhow::Result<(Vec<Loaded>, Vec<Case>)> {
        let loaded = drives.iter().map(|drive| self.on(drive)).collect::<anyhow::Result<Vec<Loaded>>>()?;
        let case = |one: &Loaded| Ok(self.variant.case(&one.trajectory, one.vehicle())?);
        let cases = loaded.iter().map(case).collect::<anyhow::Result<_>>()?;
        Ok((loaded, cases))
    }

    /// The result file.
    #[cfg(feature = "cli")]
    pub(crate) fn result(&self) -> &ResultFile {
        &self.result
    }

    /// Gives a drive the calibrated car, unless it has another one.
    fn on(&self, drive: &Drive) -> anyhow::Result<Loaded> {
        let mut reading = (*drive.recording.reading).clone();
        reading.vehicle = reading.vehicle.or_else(|| self.result.vehicle.as_ref().map(|vehicle| vehicle.from.clone()));
        let vehicle = reading.vehicle_for(&drive.trajectory, &self.variant.variant)?;
        Ok(Loaded { trajectory: (*drive.trajectory).clone(), vehicle, twin: None })
    }

    /// Spacing, speed and acceleration on a drive over time, measured and simulated, as SVG.
    ///
    /// # Errors
    /// As [`Fit::simulate`].
    #[cfg(feature = "report")]
    pub fn picture(&self, drive: &Drive) -> Result<String, Error> {
        use crate::report::plot::{AHEAD, draw};
        let one = self.on(drive)?;
        let case = self.variant.case(&one.trajectory, one.vehicle()).map_err(anyhow::Error::from)?;
        let mut trace = Trace::default();
        let outcome = rescore::outcome(&case, &self.variant.parameters, &mut trace).map_err(anyhow::Error::from)?;
        let title = format!("{}: {}", drive.label(), self.model());
        Ok(draw(&title, AHEAD, drive.time(), &case, &trace, &outcome).map_err(anyhow::Error::from)?)
    }

    /// The same calibration on other data.
    ///
    /// # Errors
    /// For a model that this version lacks.
    pub fn calibration(&self) -> Result<Calibration, Error> {
        let mut calibration = Calibration::of_variant(self.variant.variant);
        calibration.convention = self.variant.convention;
        calibration.search.seed = self.result.seed;
        calibration.own = self.result.own.iter().flat_map(|own| own.parameters.keys().cloned()).collect();
        calibration.single = self.result.bounds.iter().map(|(name, bounds)| (name.clone(), *bounds)).collect();
        calibration.minimise(&self.result.gof)
    }
}

/// Model and score, then one line per parameter with its unit and 95 % interval.
impl fmt::Display for Fit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}: {} {:.6}", self.model(), self.result.gof, self.score())?;
        for (name, value) in self.parameters() {
            let unit = self.result.units.get(name).map_or("", String::as_str);
            let is_fixed = self.result.bounds.get(name).is_some_and(|[lower, upper]| lower == upper);
            let known = match (self.result.intervals.get(name), &self.result.identifiability) {
                _ if is_fixed => "  fixed".to_owned(),
                (Some([lower, upper]), _) => format!("  [{lower:.4}, {upper:.4}]"),
                (None, Some(_)) => "  not determined".to_owned(),
                (None, None) => String::new(),
            };
            let bound = if !is_fixed && self.result.at_bound.contains(name) { "  at bound" } else { "" };
            writeln!(f, "  {name:<8} {value:>10.4} {unit}{known}{bound}")?;
        }
        Ok(())
    }
}
