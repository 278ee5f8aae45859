//! Tests whether a text computes the results of the reference, in f64 and without a GPU.

use super::exact;
use super::shots::{Shot, shots};
use crate::common::tolerance::HAND_WORKED;
use leadlag::internal::convention::Radicand;
use leadlag::internal::lanes::Function;
use leadlag::internal::wgsl::{Checked, Precision, Recipe, Source, check};

/// Steps per recipe.
const SHOTS: usize = 1000;

/// Recipes that contain every file, with steps for each: variant, precision, start.
const RECIPES: [(&str, Precision, Radicand); 11] = [
    ("idm", Precision::Plain, Radicand::Measured),
    ("gipps", Precision::Plain, Radicand::Measured),
    ("gipps", Precision::Plain, Radicand::Shifted),
    ("l-cth", Precision::Plain, Radicand::Measured),
    ("l-idm", Precision::Plain, Radicand::Measured),
    ("l-gipps", Precision::Plain, Radicand::Measured),
    ("idm+linear", Precision::Plain, Radicand::Measured),
    ("l-cth+nonlinear", Precision::Plain, Radicand::Measured),
    ("l-cth+constant", Precision::Plain, Radicand::Measured),
    ("l-cth+mfc", Precision::Plain, Radicand::Measured),
    ("idm+linear", Precision::Compensated, Radicand::Measured),
];

/// A recipe with the steps that judge it.
pub struct Judge {
    recipe: Recipe,
    original: Source,
    shots: Vec<Shot>,
}

/// Everything that judges.
pub fn judges() -> Vec<Judge> {
    let judge = |(variant, precision, radicand): (&str, Precision, Radicand)| {
        let variant = variant.parse().expect("a variant");
        let recipe = Recipe { variant, precision, radicand, observed: false };
        Judge { recipe, original: Source::model(&recipe), shots: shots(variant, radicand, SHOTS) }
    };
    RECIPES.into_iter().map(judge).collect()
}

impl Judge {
    /// True if the text composed for this recipe contains a file.
    pub fn contains(&self, file: &str) -> bool {
        (1..=self.original.text().lines().count()).any(|line| self.original.locate(line).0 == file)
    }

    /// The first detected fault of a text, if any.
    pub fn verdict(&self, replace: &dyn Fn(&str, &str) -> Option<String>) -> Result<(), String> {
        let source = Source::model_with(&self.recipe, replace);
        let checked = check(&source).map_err(|e| e.to_string())?;
        self.steps(&source, &checked)?;
        if self.recipe.precision == Precision::Compensated {
            exact::moves(&compile(&source, &checked, "moved")?)?;
        }
        Ok(())
    }

    fn steps(&self, source: &Source, checked: &Checked) -> Result<(), String> {
        let [step, starting, rest] =
            ["step", "starting_spacing", "at_rest_in"].map(|name| compile(source, checked, name));
        let (step, starting, rest) = (step?, starting?, rest?);
        for (number, shot) in self.shots.iter().enumerate() {
            let [s, v_f, v_l] = shot.perceived;
            let start = starting.call_f64(&[&shot.params[..], &[s, v_f, v_l]].concat())[0];
            close(start, shot.start, number, "spacing at the start")?;
            let now = rest.call_f64(&[start, v_f, shot.a_f]);
            let arguments = [
                &shot.params[..],
                &[start, v_f, v_l],
                &now,
                &[shot.m_0, shot.phi_f],
                &shot.road,
                &[shot.dx_l, shot.dt],
            ];
            let done = step.call_f64(&arguments.concat());
            let [a_free, a, feasible] = done[now.len()..] else { panic!("Step is the next state and three values") };
            let compared = if shot.start_only { &[][..] } else { &["spacing", "speed", "acceleration"] };
            for (k, name) in compared.iter().enumerate() {
                // The second word of a compensated value belongs to the value; the acceleration has none.
                let low = if now.len() > 3 && k < 2 { done[3 + k] } else { 0.0 };
                close(done[k] + low, shot.next[k], number, name)?;
            }
            let flags = [a < a_free, a > a_free, feasible != 0.0];
            if flags != shot.flags {
                return Err(format!(
                    "step {number}: clipped above, clipped below, feasible: {flags:?}, expected {:?}",
                    shot.flags
                ));
            }
        }
        Ok(())
    }
}

fn compile(source: &Source, checked: &Checked, name: &str) -> Result<Function, String> {
    Function::compile(source, checked, name).map_err(|e| e.to_string())
}

fn close(found: f64, expected: f64, number: usize, name: &str) -> Result<(), String> {
    // Not written as a comparison with the bound: NaN must fail.
    if (found - expected).abs() <= HAND_WORKED * expected.abs().max(1.0) {
        return Ok(());
    }
    Err(format!("step {number}: {name} {found}, expected {expected}"))
}
