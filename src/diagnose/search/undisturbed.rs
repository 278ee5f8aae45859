//! The model where nothing happens: what drives a car for a minute in place of its law spoils a calibration of everything.

use super::fitted_model::{Context, ELSEWHERE, FittedModel, scored};
use super::profile_grid::is_astray;
use super::scan::{likeliest, moved, walked};
use super::start::Hint;
use super::textbook::{fastest, with_textbook_values};
use crate::diagnose::likelihood::fit::{Plan, Point, fit};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::likelihood::robust::Mask;
use crate::diagnose::question::DiagnoseError;
use rayon::prelude::*;
use std::sync::atomic::Ordering;

/// Share of the blocks of 30 s by which parts are compared: the others may be what happens.
const USUAL: f64 = 0.8;
/// Turns on a part.
const PART: Plan = Plan { rough: 6, keep: 1, ..ELSEWHERE };

/// A model fitted where nothing happens.
#[derive(Debug)]
pub struct Undisturbed {
    model: Model,
    point: Point,
}

/// Kinds of starts of [`Undisturbed::starts`], which come in turn.
pub const UNDISTURBED_KINDS: usize = 2;

impl Undisturbed {
    /// The likeliest stretches on top of these values, walked to where they are likeliest, for a model that has a stretch more; and what
    /// they promised, as [`likeliest`] says.
    ///
    /// # Errors
    /// As [`likeliest`].
    pub fn walked(
        &self,
        setting: &Context<'_>,
        model: &Model,
        hints: Vec<Hint>,
        most: usize,
    ) -> Result<(Vec<Hint>, [f64; 2]), DiagnoseError> {
        let at = Point { values: model.adopt(&self.model, &self.point.values), noise: self.point.noise };
        let (hints, largest) = likeliest(&at, model, setting, hints, most)?;
        let hints: Result<_, _> = hints.into_iter().map(|hint| walked(setting, &at, model, hint)).collect();
        Ok((hints?, largest))
    }

    /// Starts of that model at stretches, under this observer and under a strong one.
    pub fn starts(&self, model: &Model, stretches: &[Hint]) -> Vec<Point> {
        let noise = self.point.noise;
        let values = model.adopt(&self.model, &self.point.values);
        let at = |stretch| {
            let values = moved(model, &values, stretch);
            [noise, noise.strong()].map(|noise| Point { values: values.clone(), noise })
        };
        stretches.iter().flat_map(at).collect()
    }
}

/// The model fitted to one half of one training drive, from textbook values and as it is: of all halves the one whose fit is likeliest in
/// most of the time. `None` where so little is missing that nothing can have spoilt it.
///
/// # Errors
/// As [`fit`].
pub fn undisturbed(setting: &Context<'_>, current: &FittedModel) -> Result<Option<Undisturbed>, DiagnoseError> {
    let noise = current.fit.point.noise;
    if !is_astray(&noise) {
        return Ok(None);
    }
    let halves: Vec<(usize, bool)> = (0..setting.whole.len()).flat_map(|k| [(k, false), (k, true)]).collect();
    let fitted = |half: &(usize, bool)| -> Result<Option<(f64, Model, Point)>, DiagnoseError> {
        let model = setting.model(current.variant, &current.model.events)?;
        let axes = model.axes.clone();
        let values = model.adopt(&current.model, &current.fit.point.values);
        let textbook = with_textbook_values(&model, &values, fastest(setting.question.train));
        let strong = noise.strong();
        let starts = [textbook, values].map(|values| Point { values, noise: strong });
        let found = fit(&model, &axes, &part(&setting.whole, *half), &starts, PART)?.into_iter().next();
        let Some(point) = found.map(|fit| fit.point) else { return Ok(None) };
        let mut blocks = scored(&model, &point, &setting.whole)?.concat();
        blocks.sort_by(|a, b| b.total_cmp(a));
        blocks.truncate((USUAL * blocks.len() as f64).ceil() as usize);
        setting.simulations.fetch_add(model.simulations(), Ordering::Relaxed);
        Ok(Some((blocks.iter().sum(), model, point)))
    };
    let found: Result<Vec<_>, _> = halves.par_iter().map(fitted).collect();
    let best = found?.into_iter().flatten().max_by(|a, b| a.0.total_cmp(&b.0));
    Ok(best.map(|(_, model, point)| Undisturbed { model, point }))
}

/// Of all samples that count those of the first or the second half of a drive.
fn part(whole: &[Mask], (drive, second): (usize, bool)) -> Vec<Mask> {
    let of = |(k, mask): (usize, &Mask)| -> Mask {
        mask.iter().enumerate().map(|(t, counts)| *counts && k == drive && (t >= mask.len() / 2) == second).collect()
    };
    whole.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_are_all_samples_that_count_once() {
        let whole = vec![vec![false, true, true, true], vec![true; 3]];
        let count = |half| part(&whole, half).concat().iter().map(|counts| usize::from(*counts)).collect::<Vec<_>>();
        let mut sum = vec![0; 7];
        for half in [(0, false), (0, true), (1, false), (1, true)] {
            sum.iter_mut().zip(count(half)).for_each(|(sum, counts)| *sum += counts);
        }
        assert_eq!(sum, [0, 1, 1, 1, 1, 1, 1]);
        assert_eq!(count((1, true)), [0, 0, 0, 0, 0, 1, 1]);
    }
}
