//! The threshold of evidence by parametric bootstrap: the fitted base drives the same leaders again, nothing else acts on it, and
//! the selection is repeated. What causes gain there is what they gain where there is none.
//!
//! A surrogate has everything random that the fit found: missing acceleration, noise of spacing and speed, and noise of the
//! leader, which is smoothed again, for errors in the leader are what makes false lags.

use super::PROGRAM;
use super::adopt::Search;
use super::candidate::{Candidate, Setting};
use super::drive::Drive;
use super::fit::{Plan, Point};
use super::observer::Noise;
use super::screen::Spending;
use super::start::{NEARLY_FREE, rough};
use super::verdict::{DiagnoseError, Effort, Question};
use crate::optimize::{normal, stream};
use crate::reference::{Trace, disturbed};
use crate::trajectory::Trajectory;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use std::fs::OpenOptions;
use std::io::Write;
use std::path::Path;

/// Surrogates.
pub const SURROGATES: usize = 40;
/// With fewer there is no threshold.
const FEWEST: usize = 20;
/// Probability of a false name in data without a cause, for which the threshold is made.
const ALPHA: f64 = 0.01;
/// Share of the surrogates that are the tail, from which the threshold is extrapolated.
const TAIL: f64 = 0.25;
/// Threshold under which causes of a surrogate are judged, per inflation \[nats\]: low, so that what they gain is seen.
const LOW: f64 = 4.0;
/// Draws of one surrogate, until one is driven to the end.
const DRAWS: u64 = 5;

/// A finished surrogate in the file that a bootstrap goes on from.
#[derive(Debug, Serialize, Deserialize)]
struct Kept {
    /// Everything that decides the result.
    key: String,
    number: u64,
    /// Largest evidence of a cause, per inflation \[nats\]; none where the base does not come to the end.
    largest: Option<f64>,
}

/// The evidence per inflation \[nats\] that one of a hundred drives without a cause exceeds; none if too few of them can be driven. `progress` is told how many
/// surrogates are done, and may stop. Finished surrogates are kept in the question's file, if it names one, and not computed again.
///
/// # Errors
/// As [`Search::round`]; [`DiagnoseError::Keep`] if the file cannot be written.
pub fn threshold(
    question: &Question<'_>,
    base: &Candidate,
    progress: &mut dyn FnMut(usize) -> Result<(), DiagnoseError>,
) -> Result<Option<f64>, DiagnoseError> {
    let key = key(question, base);
    let mut found = question.kept.map_or_else(Vec::new, |path| read(path, &key));
    let open = |number: &u64| !found.iter().any(|kept: &Kept| kept.number == *number);
    let left: Vec<u64> = (0..SURROGATES as u64).filter(open).collect();
    for numbers in left.chunks(rayon::current_num_threads().max(1)) {
        progress(found.len())?;
        let largest: Result<Vec<Kept>, DiagnoseError> = numbers
            .par_iter()
            .map(|&number| Ok(Kept { key: key.clone(), number, largest: largest(question, base, number)? }))
            .collect();
        for kept in largest? {
            if let Some(path) = question.kept {
                append(path, &kept)
                    .map_err(|source| DiagnoseError::Keep { path: path.display().to_string(), source })?;
            }
            found.push(kept);
        }
    }
    let largest: Vec<f64> = found.iter().filter_map(|kept| kept.largest).collect();
    // What gains less than the low threshold is not judged, so nothing is known below it.
    Ok((largest.len() >= FEWEST).then(|| one_in_a_hundred(largest).max(LOW)))
}

/// What one of a hundred exceeds, by an exponential tail through the largest quarter.
pub(crate) fn one_in_a_hundred(mut largest: Vec<f64>) -> f64 {
    largest.sort_by(|a, b| b.total_cmp(a));
    let count = ((TAIL * largest.len() as f64) as usize).max(1);
    let from = largest.get(count).copied().unwrap_or(0.0);
    let excess = largest.iter().take(count).map(|x| x - from).sum::<f64>() / count as f64;
    from + excess * (TAIL / ALPHA).ln()
}

/// The largest evidence of a cause, per inflation, that the selection finds in a surrogate.
fn largest(question: &Question<'_>, base: &Candidate, number: u64) -> Result<Option<f64>, DiagnoseError> {
    let mut drawn = None;
    for draw in 0..DRAWS {
        let mut rng = stream(question.seed, u64::MAX - 2, draw, number);
        drawn = question.train.iter().map(|drive| surrogate(drive, base, &mut rng)).collect::<Option<Vec<Drive>>>();
        if drawn.is_some() {
            break;
        }
    }
    // A base that cannot drive there says nothing of thresholds.
    let Some(train) = drawn else { return Ok(None) };
    // Without a hold-out: only the evidence is asked for, before the hold-out is.
    let question = Question { train: &train, holdout: &[], effort: Effort::Quick, kept: None, ..*question };
    let setting = Setting { least: Some(LOW), ..Setting::new(&question, base_lead(base)) };
    let spending = Spending::of(Effort::Quick);
    let noise = base.fit.point.noise;
    let free = Noise { sigma_d: NEARLY_FREE.0, tau_d: NEARLY_FREE.1, ..noise };
    let starts = [noise, free].map(|noise| Point { noise, ..base.fit.point.clone() });
    let model = setting.model(base.variant, &[])?;
    let plan = Plan { select: 2, kinds: 1, rough: 4, keep: 2, ..spending.base };
    let Some(fitted) = Candidate::fitted(&setting, base.variant, &[], model, &starts, plan)? else { return Ok(None) };
    let mut search = Search::begin(&setting, fitted)?;
    search.round(&setting, 1, &spending)?;
    let inflation = search.inflation;
    // As the decision would have it but for the threshold: both folds gain, and not in two blocks only.
    let sound = search.ladder.iter().filter(|row| row.folds.iter().all(|fold| *fold > 0.0) && row.trimmed > 0.0);
    Ok(Some(sound.map(|row| row.evidence / inflation).filter(|x| x.is_finite()).fold(0.0, f64::max)))
}

fn base_lead(base: &Candidate) -> Option<&'static crate::extension::Extension> {
    base.model.variant.extensions.get(super::candidate::LEAD)
}

/// The base behind the leader of a drive, measured as the drive was; `None` if it does not come to the end.
fn surrogate(drive: &Drive, base: &Candidate, rng: &mut ChaCha8Rng) -> Option<Drive> {
    let noise = base.fit.point.noise;
    let old = &drive.trajectory;
    let case = drive.case(base.model.variant).ok()?;
    let decay = (-old.dt / noise.tau_d).exp();
    let mut missing = noise.sigma_d * normal(rng);
    let series: Vec<f64> = (0..old.len())
        .map(|_| {
            missing = decay * missing + (1.0 - decay * decay).sqrt() * noise.sigma_d * normal(rng);
            missing
        })
        .collect();
    let mut trace = Trace::default();
    let run = disturbed(&case, &base.model.parameters(&base.fit.point.values), &series, &mut trace);
    if run.failure.is_some() {
        return None;
    }
    let mut measured =
        |y: &[f64], size: f64| -> Vec<f64> { y.iter().map(|y| (y + size * normal(rng)).max(0.0)).collect() };
    let v_f = measured(&trace.v, noise.r_v);
    let s = measured(&trace.s, noise.r_s);
    let v_l = measured(&old.v_l, rough(&drive.v_l_measured));
    let x_f = old.x_l.iter().zip(&s).map(|(x_l, s)| x_l - s - old.len_l).collect();
    let trajectory = Trajectory { v_l, x_f, v_f, s, ..old.clone() };
    let (mut drives, _) = Drive::of(&trajectory, drive.vehicle.as_deref()).ok()?;
    (drives.len() == 1).then(|| drives.remove(0))
}

/// Data, model, causes and seed: what was found for others is not taken.
fn key(question: &Question<'_>, base: &Candidate) -> String {
    let mut hash = Sha256::new();
    hash.update(PROGRAM.as_bytes());
    hash.update(question.seed.to_le_bytes());
    hash.update(base.variant.to_string());
    for cause in question.causes {
        hash.update(format!("{}\n{}\n", cause.name, cause.text));
    }
    hash.update(format!("{:?}", question.bounds));
    let noise = base.fit.point.noise.logs();
    for x in base.fit.point.values.iter().chain(&noise) {
        hash.update(x.to_bits().to_le_bytes());
    }
    for drive in question.train {
        let Trajectory { s, v_f, v_l2, s_l2, dt, .. } = &drive.trajectory;
        let (grade, further) = (drive.sin_grade(), [v_l2, s_l2].into_iter().flatten().flatten());
        for x in s.iter().chain(v_f).chain(&drive.v_l_measured).chain(further).chain(grade.iter().flatten()).chain([dt])
        {
            hash.update(x.to_bits().to_le_bytes());
        }
        hash.update(format!("{:?}", drive.vehicle.as_ref().map(|vehicle| &vehicle.slug)));
    }
    crate::trajectory::hexadecimal(&hash.finalize())
}

/// Lines of other questions, and one that a killed run left half-written, are passed over.
fn read(path: &Path, key: &str) -> Vec<Kept> {
    let text = std::fs::read_to_string(path).unwrap_or_default();
    let mut kept: Vec<Kept> = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
    kept.retain(|kept| kept.key == key && kept.number < SURROGATES as u64);
    kept.sort_by_key(|kept| kept.number);
    kept.dedup_by_key(|kept| kept.number);
    kept
}

fn append(path: &Path, kept: &Kept) -> std::io::Result<()> {
    let mut file = OpenOptions::new().create(true).append(true).open(path)?;
    // A newline before and after: whatever a killed run left, this line is whole.
    file.write_all(format!("\n{}\n", serde_json::to_string(kept).expect("numbers can be written")).as_bytes())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tail_of_an_exponential_is_found() {
        // Of 400 numbers at the quantiles of an exponential of mean 5, one in a hundred exceeds 5 ln 100 = 23.0.
        let numbers: Vec<f64> = (0..400).map(|i| -5.0 * ((i as f64 + 0.5) / 400.0).ln()).collect();
        let found = one_in_a_hundred(numbers);
        assert!((found - 23.03).abs() < 0.3, "{found}");
        assert_eq!(one_in_a_hundred(vec![0.0; 40]), 0.0);
    }
}
