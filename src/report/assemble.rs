//! From a finished calibration to its result file; every score is computed again by the f64 reference.

use super::result::{DataEntry, ReplicateEntry, ResultFile, SCHEMA_VERSION, Treatment, VehicleEntry};
use crate::calibrate::{Calibration, Replicate, SearchSpace, best, coefficient_of_variation};
use crate::evaluator::Evaluator;
use crate::reference::{Reference, Trace};
use crate::score::{GoodnessOfFit, Measures};
use crate::symbols::Symbol;
use crate::trajectory::Trajectory;
use crate::vehicle::Vehicle;
use indexmap::IndexMap;

/// What a result file is made of.
pub struct Calibrated<'a> {
    /// The evaluator that was used.
    pub evaluator: &'a dyn Evaluator,
    /// The reference on the same cases, which scores again.
    pub reference: &'a Reference,
    /// The trajectories, in the order of the cases.
    pub trajectories: &'a [&'a Trajectory],
    /// The vehicle, and how it is found again.
    pub vehicle: Option<(&'a Vehicle, &'a str)>,
    /// What was searched.
    pub space: &'a SearchSpace,
    /// The objective.
    pub gof: GoodnessOfFit,
    /// The settings.
    pub settings: &'a Calibration,
    /// What was found.
    pub replicates: Vec<Replicate>,
}

impl Calibrated<'_> {
    /// Scores every replicate again, picks the best and describes it.
    ///
    /// # Panics
    /// Without a replicate.
    #[must_use]
    pub fn into_result(mut self) -> ResultFile {
        let rescored: Vec<_> = self.replicates.iter().map(|r| self.measures(&r.candidate)).collect();
        for (replicate, measures) in self.replicates.iter_mut().zip(rescored) {
            replicate.score = measures.map_or(replicate.score, |m| self.gof.of(&m));
        }
        let winner = best(&self.replicates).expect("a calibration has at least one replicate");
        let measures = self.measures(&winner.candidate);
        let variant = self.evaluator.variant();
        let needs_vehicle = variant.needs_vehicle();
        let symbols = &self.space.symbols;
        let names = || symbols.iter().map(|s| s.name().to_owned());
        let at_bound = self.space.at_bound(&winner.candidate);
        ResultFile {
            schema_version: SCHEMA_VERSION,
            program: concat!("leadlag ", env!("CARGO_PKG_VERSION")).to_owned(),
            model_id: variant.id(),
            variant: variant.name(),
            convention: self.reference.cases()[0].convention.to_string(),
            extensions: Vec::new(),
            evaluator: self.evaluator.name().to_owned(),
            precision: self.evaluator.precision().to_owned(),
            adapter: self.evaluator.adapter(),
            data: self.data(self.space.parameters(&winner.candidate).tau_p),
            vehicle: self.vehicle.filter(|_| needs_vehicle).map(|(vehicle, from)| VehicleEntry {
                slug: vehicle.slug.clone(),
                m_0: vehicle.m_0,
                phi_f: vehicle.phi_f,
                from: from.to_owned(),
                files: vehicle.files().into_iter().cloned().collect(),
            }),
            gof: self.gof.to_string(),
            optimizer: self.settings.optimizer.runs().to_owned(),
            seed: self.settings.seed,
            score: scores(measures.as_ref()),
            parameters: names().zip(winner.candidate.iter().copied()).collect(),
            units: names().zip(symbols.iter().map(|s| s.unit().to_owned())).collect(),
            bounds: names().zip(self.space.bounds.iter().copied()).collect(),
            at_bound: at_bound.into_iter().map(|s| s.name().to_owned()).collect(),
            intervals: IndexMap::new(),
            evaluations: self.replicates.iter().map(|r| r.evaluations).sum(),
            cv: coefficient_of_variation(&self.replicates),
            replicates: self.replicates.iter().map(|r| replicate_entry(r, symbols)).collect(),
        }
    }

    /// Measures of a candidate, the mean over the cases; none if a run failed.
    fn measures(&self, candidate: &[f64]) -> Option<Measures> {
        let parameters = self.space.parameters(candidate);
        let mut trace = Trace::default();
        let outcomes =
            self.reference.cases().iter().map(|c| Reference::outcome(c, &parameters, &mut trace).result.ok());
        Measures::mean(&outcomes.collect::<Option<Vec<_>>>()?)
    }

    fn data(&self, tau_p: f64) -> Vec<DataEntry> {
        let entry = |(trajectory, case): (&&Trajectory, &crate::evaluator::Case)| DataEntry {
            path: trajectory.source.path.clone(),
            sha256: trajectory.source.sha256.clone(),
            follower: trajectory.follower,
            name: trajectory.name.clone(),
            samples: trajectory.len(),
            window_s: [trajectory.t[0], trajectory.t[trajectory.len() - 1]],
            first_scored: case.first_sample(tau_p),
            preparation: trajectory.notes.iter().map(ToString::to_string).collect(),
            treatment: Treatment::of(trajectory),
            grade: trajectory.grade.as_ref().filter(|_| case.variant.needs_grade()).and_then(|g| g.source.clone()),
        };
        self.trajectories.iter().zip(self.reference.cases()).map(entry).collect()
    }
}

fn scores(measures: Option<&Measures>) -> IndexMap<String, Option<f64>> {
    let values = measures.map(Measures::values);
    let finite = |i: usize| values.map(|v| v[i]).filter(|x| x.is_finite());
    // NRMSE first: what nearly everybody looks for.
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
        score: replicate.score,
        evaluations: replicate.evaluations,
        stop: replicate.stop.to_string(),
        parameters: symbols.iter().map(|s| s.name().to_owned()).zip(replicate.candidate.iter().copied()).collect(),
        convergence: replicate.convergence.clone(),
    }
}
