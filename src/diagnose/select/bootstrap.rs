//! The threshold of evidence by parametric bootstrap: the fitted base drives the same leaders again, nothing else acts on it, and
//! the selection is repeated. What causes gain there is what they gain where there is none.
//!
//! A surrogate has everything random that the fit found: missing acceleration, noise of spacing and speed, and noise of the
//! leader, which is smoothed again, for errors in the leader are what makes false lags.

use super::adopt::Search;
use crate::diagnose::drive::Drive;
use crate::diagnose::drive::smoothing::rough;
use crate::diagnose::judge::decide::JUDGED;
use crate::diagnose::likelihood::fit::{Plan, Point};
use crate::diagnose::likelihood::model::LEAD;
use crate::diagnose::likelihood::observer::Noise;
use crate::diagnose::question::{DiagnoseError, Effort, Question};
use crate::diagnose::revision::PROGRAM;
use crate::diagnose::search::fitted_model::{Context, FittedModel};
use crate::diagnose::search::search_budget::SearchBudget;
use crate::diagnose::search::start::NEARLY_FREE;
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
/// With fewer drives nothing is said of one in a hundred.
const FEWEST: usize = 20;
/// As few as give a mean excess to extrapolate with.
const HANDFUL: usize = 5;
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
    /// Gain, per inflation \[nats\], from which on its causes were judged.
    #[serde(default)]
    judged_from: f64,
}

/// The evidence per inflation \[nats\] that one of a hundred drives without a cause exceeds; none if too few of them can be driven. `progress` is told how many
/// surrogates are done, and may stop. Finished surrogates are kept in the question's file, if it names one, and not computed again.
///
/// # Errors
/// As [`Search::round`]; [`DiagnoseError::Keep`] if the file cannot be written.
pub fn threshold(
    question: &Question<'_>,
    base: &FittedModel,
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
            .map(|&number| {
                let found = largest(question, base, number)?;
                let (largest, judged_from) = found.map_or((None, 0.0), |(largest, from)| (Some(largest), from));
                Ok(Kept { key: key.clone(), number, largest, judged_from })
            })
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
    let seen_from = found.iter().map(|kept| kept.judged_from).fold(JUDGED * LOW, f64::max);
    Ok(one_in_a_hundred(largest, seen_from).map(|found| found.max(LOW)))
}

/// What one of a hundred exceeds, by an exponential tail through the largest quarter, or through those above `seen_from`, where these are
/// fewer: below it evidence is not seen and counts as 0. `None` with fewer than 20. Where less than a handful are above, the tail is
/// drawn as if a handful were, and not below the highest, which errs to the high side; where none is, the answer is `seen_from`.
pub(crate) fn one_in_a_hundred(mut largest: Vec<f64>, seen_from: f64) -> Option<f64> {
    let all = largest.len();
    if all < FEWEST {
        return None;
    }
    largest.sort_by(|a, b| b.total_cmp(a));
    let from = largest[(TAIL * all as f64) as usize].max(seen_from);
    let above = largest.iter().filter(|x| **x > from).count();
    let excess = largest.iter().take(above).map(|x| x - from).sum::<f64>() / above.max(1) as f64;
    let share = above.max(HANDFUL) as f64 / all as f64;
    let found = from + excess * (share / ALPHA).ln().max(0.0);
    Some(if above < HANDFUL { found.max(largest[0]) } else { found })
}

/// The largest evidence of a cause, per inflation, that the selection finds in a surrogate, and from what gain on causes are judged there.
fn largest(question: &Question<'_>, base: &FittedModel, number: u64) -> Result<Option<(f64, f64)>, DiagnoseError> {
    let mut drawn = None;
    for draw in 0..DRAWS {
        let mut rng = stream(question.seed, crate::diagnose::likelihood::streams::SURROGATES, draw, number);
        drawn = question.train.iter().map(|drive| surrogate(drive, base, &mut rng)).collect::<Option<Vec<Drive>>>();
        if drawn.is_some() {
            break;
        }
    }
    // A base that cannot drive there says nothing of thresholds.
    let Some(train) = drawn else { return Ok(None) };
    // Without a hold-out: only the evidence is asked for, before the hold-out is.
    let question = Question { train: &train, holdout: &[], effort: Effort::Quick, kept: None, ..*question };
    let setting = Context { least: Some(LOW), ..Context::new(&question, base_lead(base)) };
    let spending = SearchBudget::of(Effort::Quick);
    let noise = base.fit.point.noise;
    let free = Noise { sigma_d: NEARLY_FREE.0, tau_d: NEARLY_FREE.1, ..noise };
    let starts = [noise, free].map(|noise| Point { noise, ..base.fit.point.clone() });
    let model = setting.model(base.variant, &[])?;
    let plan = Plan { select: 2, kinds: 1, rough: 4, keep: 2, ..spending.base };
    let Some(fitted) = FittedModel::fitted(&setting, base.variant, &[], model, &starts, plan)? else { return Ok(None) };
    let mut search = Search::begin(&setting, fitted)?;
    search.round(&setting, 1, &spending)?;
    let inflation = search.inflation;
    // As the decision would have it but for the threshold: both folds gain, and not in two blocks only.
    let sound = search.ladder.iter().filter(|row| row.folds.iter().all(|fold| *fold > 0.0) && row.trimmed > 0.0);
    let largest = sound.map(|row| row.evidence / inflation).filter(|x| x.is_finite()).fold(0.0, f64::max);
    // More than half of the low threshold where that is raised.
    Ok(Some((largest, JUDGED * search.need / inflation)))
}

fn base_lead(base: &FittedModel) -> Option<&'static crate::extension::Extension> {
    base.model.variant.extensions.get(LEAD)
}

/// The base behind the leader of a drive, measured as the drive was; `None` if it does not come to the end.
fn surrogate(drive: &Drive, base: &FittedModel, rng: &mut ChaCha8Rng) -> Option<Drive> {
    let noise = base.fit.point.noise;
    let old = &drive.trajectory;
    let case = base.model.case(drive).ok()?;
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
fn key(question: &Question<'_>, base: &FittedModel) -> String {
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

    /// Of `all` numbers those that `above` of an exponential of mean 5 begin at `from`; the others are 0, as what is not judged.
    fn censored(all: usize, above: usize, from: f64) -> Vec<f64> {
        let tail = (0..above).map(|i| from - 5.0 * ((i as f64 + 0.5) / above as f64).ln());
        tail.chain(std::iter::repeat_n(0.0, all - above)).collect()
    }

    fn near(found: Option<f64>, expected: f64, within: f64) {
        assert!(found.is_some_and(|found| (found - expected).abs() < within), "{found:?}, {expected}");
    }

    #[test]
    fn the_tail_of_an_exponential_is_found() {
        // Of 400 numbers at the quantiles of an exponential of mean 5, one in a hundred exceeds 5 ln 100 = 23.0.
        near(one_in_a_hundred(censored(400, 400, 0.0), 0.0), 23.03, 0.3);
        near(one_in_a_hundred(censored(400, 400, 0.0), 2.0), 23.03, 0.3);
    }

    /// One of eight exceeds 2, by 5 in the mean: one in a hundred exceeds 2 + 5 ln 12.5 = 14.6.
    #[test]
    fn what_is_not_judged_is_no_part_of_the_tail() {
        near(one_in_a_hundred(censored(400, 50, 2.0), 2.0), 14.63, 0.3);
        // The mean excess of five quantiles is 4.66.
        near(one_in_a_hundred(censored(40, 5, 2.0), 2.0), 13.77, 0.01);
    }

    #[test]
    fn few_above_what_is_seen_err_to_the_high_side() {
        assert_eq!(one_in_a_hundred(vec![0.0; 40], 2.0), Some(2.0));
        // 2 + 7 ln 12.5, as if five of forty did.
        let two = [vec![9.0; 2], vec![0.0; 38]].concat();
        near(one_in_a_hundred(two, 2.0), 19.68, 0.01);
        let four = [vec![30.0], vec![2.1; 3], vec![0.0; 36]].concat();
        assert_eq!(one_in_a_hundred(four, 2.0), Some(30.0));
        // So many that one in a hundred is not seen.
        let rare = [vec![9.0; 6], vec![0.0; 994]].concat();
        assert_eq!(one_in_a_hundred(rare, 2.0), Some(2.0));
        assert_eq!(one_in_a_hundred(vec![9.0; 19], 2.0), None);
    }
}
