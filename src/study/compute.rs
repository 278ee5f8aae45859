//! Tasks: calibrate, score again in f64, validate on the other trajectories.

use super::part::{CalibrationRow, Part, RunRow, ValidationRow};
use super::task::{Study, Task};
use super::{PROGRAM, SCHEMA_VERSION, StudyError};
use crate::calibrate::{
    self, CalibrateError, Calibration, Progress, Replicate, SearchSpace, StopReason, calibrate_each,
};
use crate::catalog::Variant;
use crate::evaluator::{Case, Evaluator, Outcome, Score};
use crate::rescore;
use crate::score::GoodnessOfFit;
use crate::symbols::Parameters;
use indexmap::IndexMap;
use rayon::prelude::*;
use std::ops::ControlFlow;

/// Shared by all tasks of one variant and goodness of fit.
pub struct Round<'a> {
    pub study: &'a Study,
    pub variant: Variant,
    /// The measure to minimise.
    pub gof: GoodnessOfFit,
    /// Every drive of the study in the form of this variant.
    pub cases: Vec<Case>,
}

impl Round<'_> {
    /// Computes tasks, all at a time, on an evaluator of these drives; `finish` receives the parts, from any thread, and `None` for an
    /// interrupted task. `progress` receives the evaluations of each generation, and may stop.
    pub fn compute(
        &self,
        tasks: &[&Task],
        evaluator: &mut dyn Evaluator,
        drives: &[usize],
        progress: &(dyn Fn(u64) -> ControlFlow<()> + Sync),
        finish: &(dyn Fn(usize, Option<Part>) -> Result<(), StudyError> + Sync),
    ) -> Result<(), StudyError> {
        let indices: Vec<usize> = tasks.iter().map(|task| self.study.drive_of(task)).collect();
        let spaces: Vec<SearchSpace> =
            indices.iter().map(|&index| self.study.space(index, &self.variant)).collect::<Result<_, _>>()?;
        let search = |(k, task): (usize, &&Task)| {
            let case = drives.iter().position(|drive| *drive == indices[k]).expect("the evaluator has each drive");
            calibrate::Task { space: &spaces[k], cases: case..case + 1, number: task.replicate }
        };
        let searches: Vec<calibrate::Task> = tasks.iter().enumerate().map(search).collect();
        let plan = &self.study.plan.calibration;
        let settings =
            Calibration { optimizer: plan.optimizer, seed: plan.seed, stop: plan.stop, ..Calibration::default() };
        let mut spent = vec![0; tasks.len()];
        let mut tell = |k: usize, told: Progress| {
            let before = std::mem::replace(&mut spent[k], told.evaluations);
            progress(told.evaluations - before)
        };
        let found = match calibrate_each(evaluator, &searches, &settings, &mut tell) {
            Err(CalibrateError::Evaluate(error)) => return Err(error.into()),
            found => found.map_err(|source| StudyError::Calibrate { id: tasks[0].id.clone(), source })?,
        };
        let by = (evaluator.name(), evaluator.precision(), evaluator.adapter());
        found.into_par_iter().enumerate().try_for_each(|(k, found)| {
            let (task, index) = (tasks[k], indices[k]);
            let mut row = self.row(task, index, by.clone());
            let mut validations = Vec::new();
            match found {
                Ok(Replicate { stop: StopReason::Interrupted, .. }) | Err(CalibrateError::Interrupted) => {
                    return finish(k, None);
                }
                Ok(replicate) => validations = self.found(&mut row, index, &spaces[k], &replicate)?,
                Err(CalibrateError::Infeasible { evaluations, tally, .. }) => {
                    row.evaluations = evaluations;
                    row.reason = Some(format!("none of {evaluations} candidates is feasible: {tally}"));
                }
                Err(source) => return Err(StudyError::Calibrate { id: task.id.clone(), source }),
            }
            let id = task.id.clone();
            finish(k, Some(Part { schema_version: SCHEMA_VERSION, id, calibration: row, validations }))
        })
    }

    /// A row without a result yet.
    fn row(
        &self,
        task: &Task,
        index: usize,
        (evaluator, precision, adapter): (&str, &str, Option<String>),
    ) -> CalibrationRow {
        let (plan, drive) = (&self.study.plan.calibration, &self.study.drives[index].entry);
        CalibrationRow {
            program: PROGRAM.clone(),
            platoon: drive.platoon.clone(),
            follower: drive.follower,
            vehicle: drive.vehicle.clone(),
            data_sha256: drive.sha256.clone(),
            samples: drive.samples,
            dt_s: drive.dt_s,
            model_id: self.variant.id(),
            variant: self.variant.name(),
            gof: self.gof.to_string(),
            convention: plan.convention.to_string(),
            optimizer: plan.optimizer.runs().to_owned(),
            seed: plan.seed,
            replicate: task.replicate,
            evaluator: evaluator.to_owned(),
            precision: precision.to_owned(),
            adapter,
            success: false,
            reason: None,
            evaluations: 0,
            stop: None,
            score: None,
            parameters: IndexMap::new(),
            at_bound: Vec::new(),
            run: None,
        }
    }

    /// Fills in the result, and validates it on the other trajectories.
    fn found(
        &self,
        row: &mut CalibrationRow,
        index: usize,
        space: &SearchSpace,
        replicate: &Replicate,
    ) -> Result<Vec<ValidationRow>, StudyError> {
        let parameters = space.parameters(&replicate.candidate);
        let on = self.study.validated_on(index);
        let cases: Vec<Case> = std::iter::once(&index).chain(&on).map(|&i| self.cases[i].clone()).collect();
        let mut outcomes = rescore::outcomes(&cases, &parameters)?.into_iter();
        let own = outcomes.next().expect("one outcome per case");
        row.evaluations = replicate.evaluations;
        row.stop = Some(replicate.stop.to_string());
        let names = space.symbols.iter().map(|symbol| symbol.name().to_owned());
        row.parameters = names.zip(replicate.candidate.iter().copied()).collect();
        row.at_bound = space.at_bound(&replicate.candidate).iter().map(|s| s.name().to_owned()).collect();
        let score = own.score(&self.gof, self.study.plan.calibration.convention.bounds);
        row.score = match score {
            Score::Value(score) => Some(score).filter(|score| score.is_finite()),
            _ => None,
        };
        row.success = row.score.is_some();
        if !row.success {
            let reason = match score {
                Score::Rejected => "the f64 reference touches an acceleration bound, which rejects a candidate",
                _ => "the f64 reference does not run to the end, or has no such measure",
            };
            row.reason = Some(reason.to_owned());
        }
        row.run = Some(self.run_row(index, &own, &parameters));
        let validation = |(&other, outcome): (&usize, Outcome)| {
            let drive = &self.study.drives[other].entry;
            ValidationRow {
                platoon: drive.platoon.clone(),
                follower: drive.follower,
                data_sha256: drive.sha256.clone(),
                samples: drive.samples,
                run: self.run_row(other, &outcome, &parameters),
            }
        };
        Ok(on.iter().zip(outcomes).map(validation).collect())
    }

    fn run_row(&self, drive: usize, outcome: &Outcome, parameters: &Parameters) -> RunRow {
        let failure = outcome.result.err();
        let (t, case) = (&self.study.drives[drive].trajectory.t, &self.cases[drive]);
        let finite = |x: f64| x.is_finite().then_some(x);
        RunRow {
            fail_reason: failure.map(|f| f.kind.into_str().to_owned()),
            fail_step: failure.map(|f| f.step),
            fail_time_s: failure.and_then(|f| t.get(f.step).copied()),
            first_scored: case.first_sample(case.delay(parameters)),
            n_cut_acc: outcome.n_cut_acc,
            n_cut_dec: outcome.n_cut_dec,
            measures: outcome.result.ok().map_or(Vec::new(), |m| m.values().map(finite).to_vec()),
        }
    }
}
