//! Writes a result file from a finished calibration; the f64 reference computes every score again.

use super::ExtensionEntry;
use super::diagnosis::FindingEntry;
use super::{
    CorrelationEntry, DataEntry, DriveScore, DriverEntry, IdentifiabilityEntry, KnowledgeEntry, OwnEntry, OwnParameter,
    ReplicateEntry, ResultFile,
};
use super::{SCHEMA_VERSION, Scores, VehicleEntry};
use crate::calibrate::{Calibration, Replicate, SearchSpace, best, coefficient_of_variation};
use crate::catalog::Variant;
use crate::evaluator::{Case, Evaluator};
use crate::extension::Extensions;
use crate::identify::{CONFIDENCE, Identifiability};
use crate::pooling::{Own, Pooled};
use crate::reference::{Reference, Trace};
use crate::rescore;
use crate::score::{GoodnessOfFit, Measures};
use crate::symbols::Parameters;
use crate::symbols::Symbol;
use crate::trajectory::{Finding, Trajectory, Treatment, driver_id};
use crate::vehicle::Vehicle;
use indexmap::IndexMap;

/// The contents of a result file.
pub struct Calibrated<'a> {
    /// The evaluator that was used.
    pub evaluator: &'a dyn Evaluator,
    /// The reference on the same cases, for the scores.
    pub reference: &'a Reference,
    /// The trajectories, in the order of the cases.
    pub trajectories: &'a [&'a Trajectory],
    /// The vehicle, and the name or file that gives it again.
    pub vehicle: Option<(&'a Vehicle, &'a str)>,
    pub space: &'a SearchSpace,
    /// The source of the bounds and the reason for it, in words.
    pub bounds_from: String,
    /// The objective.
    pub gof: GoodnessOfFit,
    pub settings: &'a Calibration,
    /// The replicates found.
    pub replicates: Vec<Replicate>,
    /// Identifiability of the parameters of the best candidate; `None` if not requested.
    pub knowledge: Option<Identifiability>,
    /// Own parameters of the drivers, if requested.
    pub own: Option<OwnFit>,
}

/// A law with own parameters of the drivers.
#[derive(Debug, Clone)]
pub struct OwnFit {
    /// The fit.
    pub pooled: Pooled,
    /// Positions of the drives of each driver.
    pub drives: Vec<Vec<usize>>,
}

impl OwnFit {
    /// The parameters on a drive.
    fn on(&self, drive: usize) -> Option<&[f64]> {
        let driver = self.drives.iter().position(|own| own.contains(&drive))?;
        Some(&self.pooled.drivers[driver])
    }

    fn entry(&self, trajectories: &[&Trajectory], symbols: &[Symbol]) -> OwnEntry {
        let name = |own: &Own| symbols[own.position].name().to_owned();
        let parameter = |own: &Own| OwnParameter {
            logarithm: own.log,
            middle: own.middle,
            middle_interval: own.middle_interval,
            spread: own.spread,
            spread_interval: own.spread_interval,
        };
        let driver = |(drives, candidate): (&Vec<usize>, &Vec<f64>)| {
            let first = trajectories[drives[0]];
            DriverEntry {
                driver: driver_id(&first.name, first.id.as_deref()).unwrap_or(&first.label).to_owned(),
                data: drives.clone(),
                parameters: self.pooled.own.iter().map(|own| (name(own), candidate[own.position])).collect(),
            }
        };
        OwnEntry {
            parameters: self.pooled.own.iter().map(|own| (name(own), parameter(own))).collect(),
            drivers: self.drives.iter().zip(&self.pooled.drivers).map(driver).collect(),
        }
    }
}

/// Measures of each case; `None` of a run that failed or is rejected.
fn measures(reference: &Reference, parameters: &dyn Fn(usize) -> Parameters) -> Vec<Option<Measures>> {
    let mut trace = Trace::default();
    let one = |(k, case): (usize, &Case)| {
        let outcome = rescore::outcome(case, &parameters(k), &mut trace).ok()?;
        outcome.result.ok().filter(|_| !outcome.is_rejected(case.convention.bounds))
    };
    reference.cases().iter().enumerate().map(one).collect()
}

/// The scores on the cases of a reference, which are those of these trajectories.
#[must_use]
pub fn scores_on(
    reference: &Reference,
    parameters: &Parameters,
    trajectories: &[&Trajectory],
    gof: &GoodnessOfFit,
) -> Scores {
    scores_of(&measures(reference, &|_| *parameters), reference.cases(), trajectories, gof)
}

fn scores_of(
    measures: &[Option<Measures>],
    cases: &[Case],
    trajectories: &[&Trajectory],
    gof: &GoodnessOfFit,
) -> Scores {
    let finite = |x: f64| x.is_finite().then_some(x);
    let one = |((trajectory, measures), case): ((&&Trajectory, &Option<Measures>), &Case)| DriveScore {
        path: trajectory.source.path.clone(),
        trajectory: trajectory.id.clone(),
        follower: trajectory.follower,
        name: trajectory.name.clone(),
        score: measures.as_ref().and_then(|measures| finite(gof.of(measures))),
        weight: case.share(gof).weight,
        rmse: measures.as_ref().map(|measures| measures.0.map(|signal| signal.rmse)),
    };
    Scores::new(trajectories.iter().zip(measures).zip(cases).map(one).collect())
}

impl Calibrated<'_> {
    /// Picks the best replicate, measures it and describes it.
    ///
    /// # Panics
    /// Without a replicate.
    #[must_use]
    pub fn into_result(self) -> ResultFile {
        let winner = best(&self.replicates).expect("a calibration has at least one replicate");
        let candidate = self.own.as_ref().map_or(&winner.candidate, |own| &own.pooled.middle);
        let on =
            |drive: usize| self.space.parameters(self.own.as_ref().and_then(|own| own.on(drive)).unwrap_or(candidate));
        let by_drive = measures(self.reference, &on);
        let measures = by_drive.iter().copied().collect::<Option<Vec<_>>>().and_then(|all| Measures::mean(&all));
        let several = self.trajectories.len() > 1;
        let variant = self.evaluator.variant();
        let needs_vehicle = variant.needs_vehicle();
        let symbols = &self.space.symbols;
        let known = || self.knowledge.iter().flat_map(|knowledge| &knowledge.parameters);
        let names = || symbols.iter().map(|s| s.name().to_owned());
        let at_bound = self.space.at_bound(candidate);
        ResultFile {
            schema_version: SCHEMA_VERSION,
            program: concat!("leadlag ", env!("CARGO_PKG_VERSION")).to_owned(),
            model_id: variant.id(),
            variant: Variant { extensions: Extensions::NONE, ..*variant }.name(),
            law: variant.law().map(ExtensionEntry::of),
            convention: self.reference.cases()[0].convention.to_string(),
            extensions: variant.causes().map(ExtensionEntry::of).collect(),
            evaluator: self.evaluator.name().to_owned(),
            precision: self.evaluator.precision().to_owned(),
            adapter: self.evaluator.adapter(),
            data: self.data(&on),
            vehicle: self.vehicle.filter(|_| needs_vehicle).map(|(vehicle, from)| VehicleEntry {
                slug: vehicle.slug.clone(),
                m_0: vehicle.m_0,
                phi_f: vehicle.phi_f,
                from: from.to_owned(),
                files: vehicle.files().into_iter().cloned().collect(),
            }),
            gof: self.gof.to_string(),
            optimizer: self.settings.optimizer.runs().to_owned(),
            population: self.settings.population.map(|size| size as u64),
            seed: self.settings.seed,
            history_s: None,
            score: scores(measures.as_ref()),
            parameters: names().zip(candidate.iter().copied()).collect(),
            units: names().zip(symbols.iter().map(|s| s.unit().to_owned())).collect(),
            bounds: names().zip(self.space.bounds.iter().copied()).collect(),
            bounds_from: Some(self.bounds_from.clone()),
            own: self.own.as_ref().map(|own| own.entry(self.trajectories, symbols)),
            drivers: None,
            compared: None,
            per_drive: several.then(|| scores_of(&by_drive, self.reference.cases(), self.trajectories, &self.gof)),
            held_back: None,
            at_bound: at_bound.into_iter().map(|s| s.name().to_owned()).collect(),
            intervals: known().filter(|k| k.determined).map(|k| (k.symbol.name().to_owned(), k.interval)).collect(),
            identifiability: self.knowledge.as_ref().map(|knowledge| self.identifiability(knowledge, winner)),
            evaluations: self.replicates.iter().map(|r| r.evaluations).sum(),
            cv: coefficient_of_variation(self.replicates.iter().map(|r| r.score)),
            replicates: self.replicates.iter().map(|r| replicate_entry(r, symbols)).collect(),
        }
    }

    fn identifiability(&self, knowledge: &Identifiability, winner: &Replicate) -> IdentifiabilityEntry {
        let free = self.space.free();
        let name = |i: usize| self.space.symbols[i].name().to_owned();
        let range = |i: usize| {
            let values = self.replicates.iter().filter(|r| r.score.is_finite()).map(|r| r.candidate[i]);
            values.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], x| [low.min(x), high.max(x)])
        };
        let several = self.replicates.len() > 1 && winner.score.is_finite();
        IdentifiabilityEntry {
            confidence: CONFIDENCE,
            parameters: knowledge
                .parameters
                .iter()
                .map(|k| (k.symbol.name().to_owned(), KnowledgeEntry::of(k)))
                .collect(),
            correlation: (!knowledge.correlation.is_empty()).then(|| CorrelationEntry {
                parameters: free.iter().map(|&i| name(i)).collect(),
                matrix: knowledge.correlation.clone(),
            }),
            replicate_range: free.iter().filter(|_| several).map(|&i| (name(i), range(i))).collect(),
            evaluations: knowledge.evaluations,
            note: knowledge.note.map(str::to_owned),
        }
    }

    fn data(&self, parameters: &dyn Fn(usize) -> Parameters) -> Vec<DataEntry> {
        let entry = |(k, (trajectory, case)): (usize, (&&Trajectory, &Case))| DataEntry {
            path: trajectory.source.path.clone(),
            sha256: trajectory.source.sha256.clone(),
            follower: trajectory.follower,
            name: trajectory.name.clone(),
            samples: trajectory.len(),
            window_s: [trajectory.t[0], trajectory.t[trajectory.len() - 1]],
            first_scored: case.first_sample(case.delay(&parameters(k))),
            preparation: trajectory.preparation().map(ToString::to_string).collect(),
            findings: trajectory
                .findings()
                .map(|finding| {
                    let matters = finding.matters && self.gof.minds(finding.kind);
                    FindingEntry::new(trajectory, &Finding { matters, ..finding.clone() })
                })
                .collect(),
            treatment: Treatment::of(trajectory),
            grade: trajectory.grade.as_ref().filter(|_| case.variant.needs_grade()).and_then(|g| g.source.clone()),
        };
        self.trajectories.iter().zip(self.reference.cases()).enumerate().map(entry).collect()
    }
}

fn scores(measures: Option<&Measures>) -> IndexMap<String, Option<f64>> {
    let values = measures.map(Measures::values);
    let finite = |i: usize| values.map(|v| v[i]).filter(|x| x.is_finite());
    // NRMSE first, because most readers look for it.
    let mut order: Vec<usize> = (0..Measures::NAMES.len()).collect();
    order.sort_by_key(|&i| match Measures::NAMES[i] {
        "nrmse_sva" => 0,
        name if name.starts_with("nrmse") => 1,
        _ => 2,
    });
    order.into_iter().map(|i| (Measures::NAMES[i].to_owned(), finite(i))).collect()
}

fn replicate_entry(replicate: &Replicate, symbols: &[Symbol]) -> ReplicateEntry {
    ReplicateEntry {
        replicate: replicate.number,
        score: Some(replicate.score).filter(|score| score.is_finite()),
        evaluations: replicate.evaluations,
        stop: replicate.stop.to_string(),
        parameters: symbols.iter().map(|s| s.name().to_owned()).zip(replicate.candidate.iter().copied()).collect(),
        convergence: replicate.convergence.clone(),
    }
}
