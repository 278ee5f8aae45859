//! The time loop: perception delay, the order of the parts, Eq. 1.

use super::extension::{Extended, Now};
use super::types::{Ego, Perceived, Road};
use super::{constraint, controller, dynamics, lookup, spacing};
use crate::catalog::{Constraint, Controller};
use crate::convention::Radicand;
use crate::evaluator::{Case, Failure, FailureKind};
use crate::symbols::Parameters;

/// The simulated follower, one value per sample.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Trace {
    /// Position \[m\].
    pub x: Vec<f64>,
    /// Speed \[m/s\].
    pub v: Vec<f64>,
    /// Acceleration \[m/s²\].
    pub a: Vec<f64>,
    /// Spacing \[m\].
    pub s: Vec<f64>,
}

/// How a run went.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Run {
    /// First simulated sample; those before are measured.
    pub first: usize,
    /// Why it ended early; `None` if it did not.
    pub failure: Option<Failure>,
    /// Perception delay in samples.
    pub delay_steps: f64,
    /// Steps clipped at the upper acceleration bound.
    pub n_cut_acc: u32,
    /// Steps clipped at the lower acceleration bound.
    pub n_cut_dec: u32,
}

/// Simulates one candidate. `trace` is overwritten and keeps its memory; it ends at the failing sample, if any.
pub fn simulate(case: &Case, p: &Parameters, trace: &mut Trace) -> Run {
    disturbed(case, p, &[], trace)
}

/// The same with an acceleration \[m/s²\] added to the model in the step to each sample, which is not part of its own
/// acceleration; nothing after the end of the list.
pub fn disturbed(case: &Case, p: &Parameters, disturbance: &[f64], trace: &mut Trace) -> Run {
    let variant = &case.variant;
    let desired_spacing = spacing::pick(variant.base.spacing);
    let commanded_acceleration = controller::pick(variant.base.controller);
    let vehicle_response = dynamics::pick(variant.dynamics);
    let constrained_acceleration = constraint::pick(variant.constraint);
    let mfc = case.vehicle.as_ref().and_then(|v| v.mfc.as_ref()).filter(|_| variant.constraint == Constraint::Mfc);
    let grade = case.grade.as_ref().filter(|_| variant.needs_grade());
    let (m_0, phi_f) = case.vehicle.as_ref().map_or((f64::NAN, f64::NAN), |v| (v.m_0, v.phi_f));

    let delay_steps = case.delay_steps(case.delay(p));
    let first = case.first_sample(case.delay(p));
    let mut run = Run { first, failure: None, delay_steps, n_cut_acc: 0, n_cut_dec: 0 };
    start(case, p, first, trace);
    if variant.parameters().iter().any(|symbol| !p.get(*symbol).is_finite()) {
        // Checked here, because a later minimum would hide NaN.
        run.failure = Some(Failure { kind: FailureKind::NotFinite, step: first });
        return run;
    }

    let mut extended = (!variant.extensions.is_empty()).then(|| Extended::new(case, p, first - 1));
    for i in 0..case.s.len() {
        if i >= first {
            let now = i - 1;
            let x = perceive(case, trace, now as f64 - delay_steps);
            let (v_f, a_f) = (trace.v[now], trace.a[now]);
            let ego = Ego { v_f, a_f, m_0, phi_f, dt: case.dt };
            let sin_grade = grade.map_or(f64::NAN, |g| lookup::sin_grade(g, trace.x[now], case.convention.grade));
            let (a_dp, a_ap) = mfc.map_or((f64::NAN, f64::NAN), |m| lookup::mfc_bounds(m, v_f, case.convention.mfc));
            let road = Road { sin_grade, a_dp, a_ap };

            let here = Now { sample: now, perceived: (now as f64 - delay_steps).max(0.0), sin_grade, v_f, a_f };
            let changed = extended.as_mut().map(|e| e.policy(p, &x, here));
            let p = changed.as_ref().unwrap_or(p);
            let x = extended.as_mut().map_or(x, |e| e.perception(p, x, here));
            let own = extended.as_mut().map_or(v_f, |e| e.speed(v_f, here));
            let command = commanded_acceleration(p, &x, desired_spacing(p, &x), own);
            let a_cmd = extended.as_mut().map_or(command.a_cmd, |e| e.law(p, x, command.a_cmd, here));
            let a_cmd = extended.as_mut().map_or(a_cmd, |e| e.command(&x, a_cmd, here));
            let a = vehicle_response(p, a_cmd, &ego, &road);
            let a = extended.as_mut().map_or(a, |e| e.response(a, here));
            if !a.is_finite() {
                // Checked before any clamp, because a maximum would hide NaN.
                run.failure = Some(Failure { kind: FailureKind::NotFinite, step: i });
                break;
            }
            let bounded = constrained_acceleration(a, &road);
            run.n_cut_acc += u32::from(bounded < a);
            run.n_cut_dec += u32::from(bounded > a);

            // Eq. 1; a car does not roll backwards, and its acceleration is then the one that stops it.
            let more = disturbance.get(i).copied().unwrap_or(0.0);
            let v_next = (v_f + (bounded + more) * case.dt).max(0.0);
            trace.v.push(v_next);
            trace.a.push((v_next - v_f) / case.dt - more);
            trace.x.push(trace.x[now] + (v_f + v_next) / 2.0 * case.dt);
            if !command.feasible {
                run.failure = Some(Failure { kind: FailureKind::Radicand, step: i });
            }
        }
        let s = case.x_l[i] - trace.x[i] - case.len_l;
        trace.s.push(s);
        if s <= 0.0 {
            run.failure = run.failure.or(Some(Failure { kind: FailureKind::Crash, step: i }));
        }
        if run.failure.is_some() {
            break;
        }
    }
    run
}

/// The measured state before the first simulated sample.
fn start(case: &Case, p: &Parameters, first: usize, trace: &mut Trace) {
    for (signal, measured) in
        [(&mut trace.x, &case.x_f), (&mut trace.v, &case.v_f), (&mut trace.a, &case.a_f), (&mut trace.s, &case.s)]
    {
        signal.clear();
        signal.extend_from_slice(&measured[..first]);
    }
    trace.s.clear();
    if case.variant.base.controller == Controller::Gipps && case.convention.radicand == Radicand::Shifted {
        for i in 0..first {
            // S - S' of the authors' program: back to where the radicand of Eq. 5 is zero.
            let h = p.t_h / 2.0 + p.theta;
            let brake = trace.v[i] * p.t_h + case.v_l[i] * case.v_l[i] / p.a_hat_min;
            let room = case.x_l[i] - trace.x[i] - case.len_l - p.d_0;
            if p.a_min * p.a_min * h * h - p.a_min * (2.0 * room - brake) < 0.0 {
                let shifted = (p.a_min * h * h + brake) / 2.0;
                trace.x[i] = case.x_l[i] - case.len_l - p.d_0 - shifted;
            }
        }
    }
}

/// The signals at a fractional sample index: linear between samples.
fn perceive(case: &Case, trace: &Trace, at: f64) -> Perceived {
    // Rounding may put the longest delay slightly before the first sample.
    let at = at.max(0.0);
    let k = at.floor();
    let fraction = at - k;
    let k = k as usize;
    if fraction == 0.0 {
        return Perceived { s: trace.s[k], v_f: trace.v[k], v_l: case.v_l[k] };
    }
    let between = |y: &[f64]| y[k] + (y[k + 1] - y[k]) * fraction;
    Perceived { s: between(&trace.s), v_f: between(&trace.v), v_l: between(&case.v_l) }
}
