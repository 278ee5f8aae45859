//! The best short formula for the missing acceleration: a description, not a cause.
//!
//! Forward selection among s, v, dv, a_l, grade and their products, on means over a second, with a penalty per term, and judged
//! on stretches that took no part.

use super::missing::Missing;
use nalgebra::{DMatrix, DVector};
use std::fmt::Write;

/// Samples are averaged over this time \[s\]: d is correlated over longer.
const MEAN_S: f64 = 1.0;
/// Stretches that alternate between fitting and judging \[s\].
const STRETCH_S: f64 = 60.0;
/// Terms at most.
const TERMS: usize = 4;
/// A term must raise the share that is explained on the judging stretches by so much.
const WORTH: f64 = 0.01;
/// Lags of the autocorrelation that makes few independent samples of many.
const LAGS: usize = 30;

/// One term of a formula.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Term {
    /// Product of quantities, such as `v` or `v*sin_grade`; `1` for the constant.
    pub name: String,
    /// Factor, in SI units.
    pub factor: f64,
    /// Its standard error, allowing for autocorrelation.
    pub error: f64,
}

/// A formula for d.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Formula {
    /// The constant first.
    pub terms: Vec<Term>,
    /// Share of the variance of d that it explains on the stretches that it was fitted on ...
    pub explained: f64,
    /// ... and on those that it was not: this one counts.
    pub explained_held_out: f64,
}

impl Formula {
    /// As an equation.
    #[must_use]
    pub fn equation(&self) -> String {
        let mut text = "d =".to_owned();
        for (i, term) in self.terms.iter().enumerate() {
            let sign = if term.factor < 0.0 { "-" } else { "+" };
            let lead = if i == 0 && term.factor >= 0.0 { String::new() } else { format!("{sign} ") };
            let what = if term.name == "1" { String::new() } else { format!(" {}", term.name) };
            // Writing to a String cannot fail.
            let _ = write!(text, " {lead}{}{what}", significant(term.factor.abs()));
        }
        text
    }
}

/// Three significant digits.
fn significant(x: f64) -> String {
    let rounded: f64 = format!("{x:.2e}").parse().unwrap_or(x);
    rounded.to_string()
}

struct Table {
    names: Vec<String>,
    /// One column per name, over all one-second means.
    columns: Vec<Vec<f64>>,
    d: Vec<f64>,
    judging: Vec<bool>,
}

/// Finds a formula; `None` if no term is worth having.
#[must_use]
pub fn formula(drives: &[Missing]) -> Option<Formula> {
    let table = table(drives)?;
    let fitting: Vec<usize> = (0..table.d.len()).filter(|i| !table.judging[*i]).collect();
    let judging: Vec<usize> = (0..table.d.len()).filter(|i| table.judging[*i]).collect();
    if fitting.len() < 60 || judging.len() < 60 {
        return None;
    }
    let mut chosen: Vec<usize> = Vec::new();
    let mut held_out = 0.0;
    while chosen.len() < TERMS {
        // Chosen by the fitting stretches alone.
        let with = |k: usize| chosen.iter().copied().chain([k]).collect::<Vec<_>>();
        let candidates = (0..table.names.len()).filter(|k| !chosen.contains(k));
        let best = candidates
            .filter_map(|k| {
                let terms = with(k);
                let factors = solve(&table, &terms, &fitting)?;
                Some((k, misfit(&table, &terms, &factors, &fitting)))
            })
            .min_by(|a, b| a.1.total_cmp(&b.1));
        let Some((k, left)) = best else { break };
        let before = solve(&table, &chosen, &fitting).map(|f| misfit(&table, &chosen, &f, &fitting))?;
        let residuals = residuals(&table, &with(k), &solve(&table, &with(k), &fitting)?, &fitting);
        let independent = fitting.len() as f64 / inflation(&residuals);
        // Schwarz's criterion with as many samples as there are independent ones; the choice among all terms costs as well.
        let price = independent.ln() + 2.0 * (table.names.len() as f64).ln();
        if independent * (before / left).ln() < price {
            break;
        }
        let terms = with(k);
        let factors = solve(&table, &terms, &fitting)?;
        let now = 1.0 - misfit(&table, &terms, &factors, &judging) / spread(&table.d, &fitting, &judging);
        if now < held_out + WORTH {
            break;
        }
        held_out = now;
        chosen = terms;
    }
    if chosen.is_empty() {
        return None;
    }
    let factors = solve(&table, &chosen, &fitting)?;
    let explained = 1.0 - misfit(&table, &chosen, &factors, &fitting) / spread(&table.d, &fitting, &fitting);
    // The factors that are told are those of all the data.
    let all: Vec<usize> = (0..table.d.len()).collect();
    let factors = solve(&table, &chosen, &all)?;
    let errors = errors(&table, &chosen, &factors, &all)?;
    let names = std::iter::once("1").chain(chosen.iter().map(|k| table.names[*k].as_str()));
    let terms = names.zip(factors.iter().zip(&errors));
    Some(Formula {
        terms: terms.map(|(name, (f, e))| Term { name: name.to_owned(), factor: *f, error: *e }).collect(),
        explained,
        explained_held_out: held_out,
    })
}

/// One-second means of d and of every quantity and product.
fn table(drives: &[Missing]) -> Option<Table> {
    let graded = drives.iter().all(|m| m.scene.sin_grade.is_some());
    let mut names: Vec<String> = ["s", "v", "dv", "a_l"].map(str::to_owned).to_vec();
    names.extend(graded.then(|| "sin_grade".to_owned()));
    let single = names.len();
    for i in 0..single {
        for j in i..single {
            names.push(if i == j { format!("{}^2", names[i]) } else { format!("{}*{}", names[i], names[j]) });
        }
    }
    let mut table = Table { columns: vec![Vec::new(); names.len()], names, d: Vec::new(), judging: Vec::new() };
    for missing in drives {
        let scene = missing.scene;
        let width = ((MEAN_S / scene.dt).round() as usize).max(1);
        let signals: Vec<&[f64]> = [&scene.s, &scene.v, &scene.dv, &scene.a_l]
            .into_iter()
            .map(Vec::as_slice)
            .chain(scene.sin_grade.as_deref().filter(|_| graded))
            .collect();
        for start in (0..(scene.len() + 1).saturating_sub(width)).step_by(width) {
            let mean = |y: &[f64]| y[start..start + width].iter().sum::<f64>() / width as f64;
            let d = mean(missing.d);
            let values: Vec<f64> = signals.iter().map(|y| mean(y)).collect();
            if !d.is_finite() || values.iter().any(|v| !v.is_finite()) {
                continue;
            }
            let mut column = 0;
            let mut push = |value: f64| {
                table.columns[column].push(value);
                column += 1;
            };
            values.iter().for_each(|v| push(*v));
            for i in 0..single {
                (i..single).for_each(|j| push(values[i] * values[j]));
            }
            table.d.push(d);
            table.judging.push(((start as f64 * scene.dt / STRETCH_S) as usize) % 2 == 1);
        }
    }
    (!table.d.is_empty()).then_some(table)
}

/// Least squares with a constant; `None` if the terms depend on each other.
fn solve(table: &Table, terms: &[usize], rows: &[usize]) -> Option<Vec<f64>> {
    let x = design(table, terms, rows);
    let y = DVector::from_iterator(rows.len(), rows.iter().map(|i| table.d[*i]));
    let scale: Vec<f64> = x.column_iter().map(|c| c.norm()).collect();
    if scale.iter().any(|s| *s < 1e-9) {
        return None;
    }
    let scaled = DMatrix::from_fn(x.nrows(), x.ncols(), |i, j| x[(i, j)] / scale[j]);
    let normal = scaled.tr_mul(&scaled);
    let inverse = normal.cholesky()?;
    let factors = inverse.solve(&scaled.tr_mul(&y));
    Some(factors.iter().zip(&scale).map(|(f, s)| f / s).collect())
}

fn design(table: &Table, terms: &[usize], rows: &[usize]) -> DMatrix<f64> {
    DMatrix::from_fn(
        rows.len(),
        terms.len() + 1,
        |i, j| if j == 0 { 1.0 } else { table.columns[terms[j - 1]][rows[i]] },
    )
}

fn residuals(table: &Table, terms: &[usize], factors: &[f64], rows: &[usize]) -> Vec<f64> {
    let value =
        |i: usize| factors[0] + terms.iter().zip(&factors[1..]).map(|(k, f)| f * table.columns[*k][i]).sum::<f64>();
    rows.iter().map(|i| table.d[*i] - value(*i)).collect()
}

/// Mean squared residual.
fn misfit(table: &Table, terms: &[usize], factors: &[f64], rows: &[usize]) -> f64 {
    residuals(table, terms, factors, rows).iter().map(|r| r * r).sum::<f64>() / rows.len() as f64
}

/// Mean square of d around the mean of the fitting stretches.
fn spread(d: &[f64], fitting: &[usize], rows: &[usize]) -> f64 {
    let mean = fitting.iter().map(|i| d[*i]).sum::<f64>() / fitting.len() as f64;
    (rows.iter().map(|i| (d[*i] - mean).powi(2)).sum::<f64>() / rows.len() as f64).max(1e-300)
}

/// 1 + 2 Σ of Bartlett-weighted autocorrelations, at least 1.
fn inflation(r: &[f64]) -> f64 {
    let variance = r.iter().map(|r| r * r).sum::<f64>();
    let sum: f64 = (1..=LAGS.min(r.len() / 4))
        .map(|lag| {
            let weight = 1.0 - lag as f64 / (LAGS as f64 + 1.0);
            2.0 * weight * r.iter().zip(&r[lag..]).map(|(a, b)| a * b).sum::<f64>() / variance
        })
        .sum();
    (1.0 + sum).max(1.0)
}

/// Standard errors of the factors.
fn errors(table: &Table, terms: &[usize], factors: &[f64], rows: &[usize]) -> Option<Vec<f64>> {
    let x = design(table, terms, rows);
    let r = residuals(table, terms, factors, rows);
    let variance = r.iter().map(|r| r * r).sum::<f64>() / r.len() as f64 * inflation(&r);
    let inverse = x.tr_mul(&x).try_inverse()?;
    Some((0..=terms.len()).map(|j| (inverse[(j, j)] * variance).sqrt()).collect())
}
