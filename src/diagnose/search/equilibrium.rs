//! The spacing at which a model neither accelerates nor brakes, fitted to what was measured.

use crate::convention::Radicand;
use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::model::Model;
use crate::lanes::{Function, LanesError};
use crate::wgsl::{Precision, Recipe, Source, check, member};
use nalgebra::{DMatrix, DVector};

/// Samples looked at, at most.
const SAMPLES: usize = 600;
/// Least speed of a sample \[m/s\].
const MOVING_MPS: f64 = 2.0;
/// Turns of Gauss and Newton.
const TURNS: usize = 12;
/// Share of the information that is added to it: parameters that do the same share a change.
const RIDGE: f64 = 1e-3;
/// Longest step of a coordinate in a turn.
const LONGEST: f64 = 0.3;

/// Values of a model whose equilibrium spacing is as near to the measured spacing as its parameters allow (least squares), the
/// rest as it was. Something that brings the mean spacing to the equilibrium shows it: a model without that has its equilibrium elsewhere,
/// and from there the something only makes things worse.
#[must_use]
pub fn at_equilibrium(model: &Model, values: &[f64], drives: &[Drive]) -> Vec<f64> {
    let samples = steady(drives);
    let moved: Vec<usize> = (0..values.len())
        .filter(|&k| model.variant.is_of_base(model.symbols[k]) && !model.axes[k].is_fixed())
        .collect();
    if samples.is_empty() || moved.is_empty() {
        return values.to_vec();
    }
    let Ok(equilibrium) = Equilibrium::of(model) else { return values.to_vec() };
    let residuals = |values: &[f64]| {
        let residual = |(v, s): &(f64, f64)| equilibrium.spacing(values, *v) - s;
        DVector::from_iterator(samples.len(), samples.iter().map(residual))
    };
    let mut best = values.to_vec();
    let mut at = residuals(&best);
    for _ in 0..TURNS {
        let column = |&k: &usize| {
            // Into the range, where a derivative would be one-sided.
            let u = model.axes[k].coordinate(best[k]);
            let step = if u < 0.5 { 1e-5 } else { -1e-5 };
            let mut next = best.clone();
            next[k] = model.axes[k].value(u + step);
            (residuals(&next) - &at) / step
        };
        let jacobian = DMatrix::from_columns(&moved.iter().map(column).collect::<Vec<_>>());
        let mut information = jacobian.transpose() * &jacobian;
        let largest = information.diagonal().max();
        (0..moved.len()).for_each(|j| information[(j, j)] += RIDGE * information[(j, j)] + 1e-9 * largest);
        let Some(cholesky) = information.cholesky() else { break };
        let step = cholesky.solve(&(-jacobian.transpose() * &at));
        let ratio = (step.amax() / LONGEST).max(1.0);
        let mut next = best.clone();
        for (j, &k) in moved.iter().enumerate() {
            next[k] = model.axes[k].value(model.axes[k].coordinate(best[k]) + step[j] / ratio);
        }
        let there = residuals(&next);
        // Not by what is no number, either.
        if there.norm_squared() < (1.0 - 1e-6) * at.norm_squared() {
            (best, at) = (next, there);
        } else {
            break;
        }
    }
    best
}

/// The spacing at which a model keeps a constant speed, as its text says.
struct Equilibrium {
    function: Function,
    /// Where among a model's values each input of the function is; `None` for the speed.
    inputs: Vec<Option<usize>>,
}

impl Equilibrium {
    fn of(model: &Model) -> Result<Equilibrium, LanesError> {
        // With an observer, for which every text has the function.
        let (precision, radicand) = (Precision::Plain, Radicand::Measured);
        let source = Source::model(&Recipe { variant: model.variant, precision, radicand, observed: true });
        let function = Function::compile(&source, &check(&source)?, "equilibrium_spacing")?;
        let place = |path: &String| {
            let name = path.strip_prefix("p.")?;
            model.symbols.iter().position(|symbol| member(*symbol) == name)
        };
        let inputs = function.inputs().iter().map(place).collect();
        Ok(Equilibrium { function, inputs })
    }

    /// At a speed \[m/s\]; in m.
    fn spacing(&self, values: &[f64], v: f64) -> f64 {
        let speed = self.function.inputs().iter().map(|path| if path == "v" { v } else { 0.0 });
        let arguments: Vec<f64> =
            self.inputs.iter().zip(speed).map(|(place, speed)| place.map_or(speed, |k| values[k])).collect();
        self.function.call_f64(&arguments)[0]
    }
}

/// Speed \[m/s\] and spacing \[m\] of samples in which the speeds of both cars differ less than in half of all.
fn steady(drives: &[Drive]) -> Vec<(f64, f64)> {
    let moving = drives.iter().flat_map(|drive| {
        let data = &drive.trajectory;
        (0..data.len()).map(|t| (data.v_f[t], data.s[t], (data.v_l[t] - data.v_f[t]).abs()))
    });
    let mut samples: Vec<(f64, f64, f64)> = moving.filter(|(v, s, _)| *v > MOVING_MPS && s.is_finite()).collect();
    samples.sort_by(|a, b| a.2.total_cmp(&b.2));
    samples.truncate(samples.len().div_ceil(2));
    let stride = samples.len().div_ceil(SAMPLES).max(1);
    samples.into_iter().step_by(stride).map(|(v, s, _)| (v, s)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;

    #[test]
    fn the_equilibrium_of_each_base_comes_to_what_was_measured() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        for base in ["l-cth", "gipps", "idm", "krauss", "w99"] {
            let variant = base.parse().expect("a base");
            let model = Model::new(variant, &drives, &Overrides::new(), &[]).expect("a model");
            let values: Vec<f64> = model.axes.iter().map(|axis| axis.value(0.4)).collect();
            let off = |values: &[f64]| {
                let equilibrium = Equilibrium::of(&model).expect("a valid text");
                let gaps = [8.0, 15.0, 22.0].map(|v| equilibrium.spacing(values, v) - (3.0 + 1.5 * v));
                gaps.iter().fold(0.0_f64, |most, gap| most.max(gap.abs()))
            };
            let found = at_equilibrium(&model, &values, &drives);
            assert!(off(&values) > 3.0 && off(&found) < 0.5, "{base}: {} and {}", off(&values), off(&found));
        }
    }
}
