//! The answer of the race for `diagnosis.json`, combined with that of the likelihood.

use super::fit::Entry;
use super::loss::{Losses, PartLoss, SIGNALS};
use super::{Answer, HORIZONS, Horizon, Named, OF_A_NAME, Policy, Request, is_same, lasts};
use crate::diagnose::answer::experiment;
use crate::diagnose::drive::ahead::{BRAKING, GENTLE_BRAKING};
use crate::diagnose::likelihood::model::{LEAD, is_lead};
use crate::diagnose::search::skipped::Untried;
use crate::diagnose::{DiagnoseError, Drive, Verdict};
use crate::extension::Extension;
use crate::judge::mean;
use crate::result::diagnosis::recommended::{ClosedLoopGain, Collisions, PerDrive, Recommended, RecommendedCause, Why};
use crate::result::diagnosis::{
    CauseEntry, ErrorsEntry, HeldBackEntry, NotTriedEntry, Outcome, ParameterEntry, ShareEntry,
};
use crate::symbols::Parameters;
use indexmap::IndexSet;

/// A model of the race for calibrations and simulations: without the nuisance lead, which is not a property of the car.
#[derive(Debug, Clone)]
pub struct Delivered {
    /// Its causes.
    pub causes: Vec<&'static Extension>,
    /// Fitted to all drives over their whole length.
    pub parameters: Parameters,
    /// Its parameters with their intervals.
    pub entries: Vec<ParameterEntry>,
}

impl Answer {
    /// The base; `None` if nothing could be judged.
    #[must_use]
    pub fn base(&self) -> Option<Delivered> {
        delivered(self.entries.first()?)
    }

    /// The recommended model, otherwise the one with the named causes; `None` if it was not judged, as with a cause of one drive.
    #[must_use]
    pub fn extended(&self) -> Option<Delivered> {
        delivered(self.winner.map(|k| &self.entries[k]).or_else(|| self.with_named())?)
    }

    /// The judged model with the named causes.
    fn with_named(&self) -> Option<&Entry> {
        let of_race = || self.named.as_ref().map_or(&[][..], |named| &named.causes);
        let causes = if self.likely.is_empty() { of_race() } else { &self.likely };
        let is_one = |entry: &&Entry| held(entry).is_some() && is_same(&entry.causes, causes);
        self.entries.iter().skip(1).find(is_one)
    }

    /// Number of recordings, or of drivers.
    #[must_use]
    pub fn units(&self) -> usize {
        self.field.parts.unit_count()
    }

    /// Causes of the request that did not run, and why.
    #[must_use]
    pub fn untried(&self, request: &Request<'_>) -> Vec<NotTriedEntry> {
        let why = |cause: &&'static Extension| {
            if !lasts(cause) {
                return Some(Untried::Once);
            }
            match request.base.with(cause).map(|variant| self.field.model(variant)) {
                Err(conflict) => Some(Untried::Conflict(conflict)),
                Ok(Err(DiagnoseError::Case(error))) => Some(Untried::Data(error)),
                Ok(_) => None,
            }
        };
        let of_car = request.causes.iter().filter(|cause| cause.name != LEAD);
        of_car.filter_map(|cause| Some(NotTriedEntry::new(&cause.name, &why(cause)?))).collect()
    }

    /// Begin and end of the parts of a drive in the race, in the file's time \[s\].
    #[must_use]
    pub fn parts_of(&self, drive: &Drive) -> Vec<[f64; 2]> {
        let recording = drive.recording();
        let own = self.field.parts.drives.iter().filter(|part| part.recording() == recording);
        own.map(|part| [part.trajectory.t[0], part.trajectory.t[part.trajectory.t.len() - 1]]).collect()
    }

    /// Errors of the base and of the recommended model on the parts that their fits left out, by file.
    #[must_use]
    pub fn left_out(&self) -> Vec<HeldBackEntry> {
        let Some(base) = self.entries.first() else { return Vec::new() };
        let recommended = self.winner.map(|k| &self.entries[k]);
        let entry = |file: &str| {
            let of =
                |entry: &Entry| Some(self.errors(held(entry)?, |part| self.field.parts.drives[part].file() == file));
            let base = of(base);
            HeldBackEntry {
                label: file.to_owned(),
                rms: base.map(|errors| errors.rms),
                nrmse_sva: base.map(|errors| errors.nrmse_sva),
                recommended: recommended.and_then(of),
            }
        };
        let files: IndexSet<&str> = self.field.parts.drives.iter().map(Drive::file).collect();
        files.into_iter().map(entry).collect()
    }

    /// Errors over some parts.
    fn errors(&self, losses: &Losses, is_one: impl Fn(usize) -> bool) -> ErrorsEntry {
        let scales = &self.field.scales;
        let mine = |(k, part): (usize, &Option<PartLoss>)| part.as_ref().filter(|_| is_one(k)).cloned();
        let own = Losses { parts: losses.parts.iter().enumerate().map(mine).collect() };
        let bins: Vec<&[f64; SIGNALS]> = own.parts.iter().flatten().flat_map(|part| &part.mse).collect();
        let rms = |k: usize| (bins.iter().map(|mse| mse[k]).sum::<f64>() / bins.len().max(1) as f64).sqrt();
        ErrorsEntry { rms: std::array::from_fn(rms), nrmse_sva: own.nrmse(scales) }
    }
}

fn delivered(entry: &Entry) -> Option<Delivered> {
    let fit = entry.whole_drives()?;
    let own = of_car(entry);
    Some(Delivered {
        causes: entry.causes.clone(),
        parameters: entry.model.parameters(&fit.whole),
        entries: parameters(entry, &own, Horizon::Drive),
    })
}

/// Positions of all parameters except the lead.
fn of_car(entry: &Entry) -> Vec<usize> {
    (0..entry.model.symbols.len()).filter(|&k| !is_lead(entry.model.symbols[k])).collect()
}

/// Adds the answer of the race to a diagnosis. Names from the likelihood take precedence over those of the race. If the base cannot be
/// trusted, the reason becomes a note.
pub fn combine(outcome: &mut Outcome, answer: &Answer) {
    outcome.base_notes = notes(answer);
    if outcome.verdict == Verdict::BadBase {
        outcome.base_notes.insert(0, std::mem::take(&mut outcome.reason));
        outcome.verdict = Verdict::Unexplained;
        outcome.reason = "the base model is unsuitable for finding causes; see the notes on it".to_owned();
    }
    if let Some(why) = answer.tried.not_testable.as_ref().filter(|_| !answer.reacts) {
        outcome.verdict = Verdict::NotTestable;
        outcome.reason.clone_from(why);
    }
    let is_named = |outcome: &Outcome| matches!(outcome.verdict, Verdict::Named | Verdict::Ambiguous);
    if let Some(named) = answer.named.as_ref().filter(|_| !is_named(outcome)) {
        add_names(outcome, answer, named);
    }
    if let Some(lasts) = answer.sensor_noise.filter(|_| !is_named(outcome)) {
        outcome.reason += &format!("; the missing acceleration lasts {lasts:.1} s, as sensor noise does");
    }
    // A cause that the race judges is not absorbed by a calibration.
    let is_judged = |name: &String| answer.tried.trials.iter().any(|trial| trial.causes.contains(name));
    outcome.not_testable.retain(|entry| !is_judged(&entry.name));
    outcome.power = answer.power.clone().filter(|_| !is_named(outcome));
    let named: Vec<String> =
        outcome.causes.iter().chain(&outcome.confounded_with).map(|cause| cause.family.clone()).collect();
    outcome.recommended = answer.winner.and_then(|k| recommended_entry(answer, &answer.entries[k], &named));
    outcome.gain = answer.with_named().filter(|_| outcome.recommended.is_none()).and_then(|entry| gain(answer, entry));
    outcome.base_laws.clone_from(&answer.laws);
    outcome.closed_loop = answer.tried.clone();
    outcome.simulations += answer.simulations;
}

/// Gives an outcome the names of the race.
fn add_names(outcome: &mut Outcome, answer: &Answer, named: &Named) {
    let entry = &answer.entries[named.entry];
    outcome.causes = named.causes.iter().map(|cause| cause_entry(entry, named, cause, None)).collect();
    let rivals = named.rivals.iter();
    outcome.confounded_with =
        rivals.map(|rival| cause_entry(&answer.entries[rival.entry], named, rival.cause, Some(rival.of))).collect();
    outcome.verdict = if named.rivals.is_empty() { Verdict::Named } else { Verdict::Ambiguous };
    outcome.reason = format!(
        "{:.1} standard errors better than the base on left-out data, p {}",
        named.evidence[0],
        at_most(named.evidence[1])
    );
    if let Some(rival) = named.rivals.first() {
        outcome.reason += &format!(". Drives that would distinguish them: {}", experiment(rival.of, rival.cause));
    }
}

fn at_most(p: f64) -> String {
    if p < 0.001 { "< 0.001".to_owned() } else { format!("= {p:.3}") }
}

/// A named cause, with its sizes in a model that contains it.
fn cause_entry(entry: &Entry, named: &Named, cause: &'static Extension, of: Option<&'static Extension>) -> CauseEntry {
    CauseEntry {
        name: cause.name.clone(),
        meaning: Some(cause.in_short().to_owned()).filter(|meaning| !meaning.is_empty()),
        equation: cause.cause.as_ref().and_then(|cause| cause.equation.clone()),
        instead_of: of.map(|of| of.name.clone()),
        family: cause.family().to_owned(),
        parameters: of_cause(entry, cause, Horizon::ALL[OF_A_NAME]),
        evidence: named.evidence[0],
        threshold: Policy::DEFAULT.chance_of_a_name,
        threshold_kind: "bootstrap".to_owned(),
        recording: None,
    }
}

fn recommended_entry(answer: &Answer, entry: &Entry, named: &[String]) -> Option<Recommended> {
    let (own, base_held) = (held(entry)?, held(&answer.entries[0])?);
    let [[base_gentle, base_stops], [own_gentle, own_stops]] = [&answer.entries[0], entry].map(stops);
    let [base_collisions, own_collisions] = [base_held, own].map(Losses::collisions);
    let confirmed = entry.causes.iter().all(|cause| named.iter().any(|name| name == cause.family()));
    let cause = |cause: &&'static Extension| RecommendedCause {
        name: cause.name.clone(),
        meaning: cause.in_short().to_owned(),
        parameters: of_cause(entry, cause, Horizon::Drive),
    };
    let own_positions = of_car(entry);
    let bound = |&k: &usize| {
        let axis = &entry.model.axes[k];
        (entry.model.symbols[k].name().to_owned(), [axis.lower, axis.upper])
    };
    Some(Recommended {
        parameters: parameters(entry, &own_positions, Horizon::Drive).into_iter().map(|p| (p.name, p.value)).collect(),
        safe: own_collisions + own_gentle + own_stops == 0,
        safe_reason: format!(
            "on left-out data it comes closer than 0.1 m to the car ahead in {own_collisions} of {} parts, the base in {base_collisions}; if the \
             car ahead brakes to a standstill at {GENTLE_BRAKING} m/s², in {own_gentle} and {base_gentle}; at {BRAKING} m/s², in {own_stops} and \
             {base_stops}",
            own.parts.len()
        ),
        bounds: own_positions.iter().map(bound).collect(),
        causes: entry.causes.iter().map(cause).collect(),
        why: if confirmed { Why::Confirmed } else { Why::Helps },
        gain: gain(answer, entry)?,
        per_drive: per_drive(answer, base_held, own),
        confidence_set: answer.set.clone(),
        collisions: Collisions { base: base_collisions, extended: own_collisions },
    })
}

/// The gain over the base on parts left out of the fits.
fn gain(answer: &Answer, entry: &Entry) -> Option<ClosedLoopGain> {
    let base = answer.entries.first()?;
    let (before, after) = (held(base)?.roots(&base.scales), held(entry)?.roots(&entry.scales));
    let differences: Vec<f64> = before.iter().zip(&after).map(|(a, b)| a - b).collect();
    Some(ClosedLoopGain {
        measure: "nrmse_sva_10s".to_owned(),
        base: mean(&before),
        extended: mean(&after),
        interval: answer.resamples.interval(&differences, Policy::DEFAULT.interval),
    })
}

/// Number of parts in which a model collides when the car ahead stops gently, and in an ordinary stop.
fn stops(entry: &Entry) -> [usize; 2] {
    let judged = entry.whole_drives().and_then(|fit| fit.judged.as_ref());
    judged.map_or([0; 2], |judged| [judged.gentle_stops, judged.stops])
}

fn held(entry: &Entry) -> Option<&Losses> {
    Some(&entry.whole_drives()?.judged.as_ref()?.held)
}

/// The parameters of a cause at a horizon.
fn of_cause(entry: &Entry, cause: &'static Extension, horizon: Horizon) -> Vec<ParameterEntry> {
    parameters(entry, &entry.model.positions(cause), horizon)
}

/// Parameters at a horizon, with their intervals.
fn parameters(entry: &Entry, positions: &[usize], horizon: Horizon) -> Vec<ParameterEntry> {
    let at = Horizon::ALL.iter().position(|own| *own == horizon).unwrap_or(HORIZONS - 1);
    let Some(fit) = &entry.fits[at] else { return Vec::new() };
    let model = &entry.model;
    let parameter = |k: usize| {
        let (symbol, axis, value) = (model.symbols[k], &model.axes[k], fit.whole[k]);
        ParameterEntry {
            name: symbol.name().to_owned(),
            value,
            unit: symbol.unit().to_owned(),
            interval: entry.interval(k, at),
            at_bound: axis.at_bound(value),
        }
    };
    positions.iter().map(|&k| parameter(k)).collect()
}

impl ShareEntry {
    /// The share of the drivers with the named causes, with its 95 % interval, and the sizes of their causes; `None` without a name, or
    /// without a fleet.
    #[must_use]
    pub fn of(answer: &Answer, seed: u64) -> Option<ShareEntry> {
        let named = answer.named.as_ref()?;
        let entry = &answer.entries[named.entry];
        let mixture = entry.mixture()?;
        let parameters = named.causes.iter().flat_map(|cause| {
            let positions = entry.model.positions(cause);
            let own = parameters(entry, &positions, Horizon::ALL[OF_A_NAME]);
            own.into_iter().zip(positions).map(move |(parameter, k)| {
                let axis = &entry.model.axes[k];
                let [value, neutral] = [parameter.value, entry.neutral(k)].map(|value| axis.coordinate(value));
                let value = axis.value((neutral + mixture.size() * (value - neutral)).clamp(0.0, 1.0));
                ParameterEntry { value, interval: None, at_bound: axis.at_bound(value), ..parameter }
            })
        });
        let interval = entry.share_interval(seed)?;
        Some(ShareEntry { share: mixture.share, interval, parameters: parameters.collect() })
    }
}

/// NRMSE(s,v,a) by file or driver, over the parts that the fits left out.
fn per_drive(answer: &Answer, base: &Losses, own: &Losses) -> Vec<PerDrive> {
    let labels = &answer.field.parts.labels;
    let of = |losses: &Losses, label: &str| answer.errors(losses, |part| labels[part] == label).nrmse_sva;
    let entry = |label: &str| PerDrive { path: label.to_owned(), base: of(base, label), extended: of(own, label) };
    labels.iter().map(String::as_str).collect::<IndexSet<&str>>().into_iter().map(entry).collect()
}

/// Notes on the base: collisions, and a better law.
fn notes(answer: &Answer) -> Vec<String> {
    let mut notes = Vec::new();
    let Some(fit) = answer.entries.first().and_then(Entry::whole_drives) else {
        return notes;
    };
    if let Some(judged) = &fit.judged {
        let [failures, stops, all] = [judged.held.collisions(), judged.stops, judged.held.parts.len()];
        if failures > 0 {
            notes.push(format!("it collides with the car ahead on {failures} of {all} unseen drives"));
        }
        let [_, own] = answer.winner.map_or([0; 2], |k| self::stops(&answer.entries[k]));
        if stops + own > 0 {
            let too = if own > 0 { format!(", the recommended model on {own}") } else { String::new() };
            notes.push(format!(
                "it collides on {stops} of {all} drives if the car ahead brakes to a standstill at {BRAKING} m/s²{too}"
            ));
        }
    }
    if let Some(best) = answer.laws.first().filter(|law| law.gain >= LEAST_GAIN) {
        notes.push(format!(
            "{} without extensions has {:.0} % less error on unseen drives",
            best.name,
            100.0 * best.gain
        ));
    }
    notes
}

/// Smallest gain of another law that deserves a note \[-\].
const LEAST_GAIN: f64 = 0.02;
