//! Single steps from states that no drive would show in sequence, and the results of the reference.

use leadlag::internal::catalog::{Controller, Variant};
use leadlag::internal::convention::{Convention, Radicand};
use leadlag::internal::evaluator::{Case, FailureKind};
use leadlag::internal::optimize::stream;
use leadlag::internal::reference::{Trace, simulate};
use leadlag::internal::symbols::{Bounds, Parameters, Symbol};
use leadlag::internal::trajectory::Grade;
use leadlag::internal::vehicle::{Mfc, Vehicle};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use std::sync::Arc;

/// One step: arguments of the functions of the text, and the results of the reference.
#[derive(Debug, Clone)]
pub struct Shot {
    /// The parameters of the variant, in the order of `Params`.
    pub params: Vec<f64>,
    /// Perceived s, v_f, v_l before the start was decided.
    pub perceived: [f64; 3],
    /// Acceleration at the start.
    pub a_f: f64,
    pub m_0: f64,
    pub phi_f: f64,
    /// sin_grade, a_dp, a_ap.
    pub road: [f64; 3],
    pub dx_l: f64,
    pub dt: f64,
    /// Start of the run: `starting_spacing` \[m\].
    pub start: f64,
    /// The step itself is too badly conditioned to be compared.
    pub start_only: bool,
    /// s, v, a after the step.
    pub next: [f64; 3],
    /// Clipped at the upper bound, clipped at the lower bound, radicand not negative.
    pub flags: [bool; 3],
}

/// A bound itself in a third of the draws, otherwise uniform between them.
fn draw(random: &mut ChaCha8Rng, [lower, upper]: [f64; 2]) -> f64 {
    match random.random_range(0..6) {
        0 => lower,
        1 => upper,
        _ => lower + (upper - lower) * random.random::<f64>(),
    }
}

/// One of several edge cases in half of the draws, otherwise uniform between them.
fn edgy(random: &mut ChaCha8Rng, edges: &[f64], between: [f64; 2]) -> f64 {
    if random.random::<bool>() { edges[random.random_range(0..edges.len())] } else { draw(random, between) }
}

/// Steps of a variant; always the same.
pub fn shots(variant: Variant, radicand: Radicand, count: usize) -> Vec<Shot> {
    let convention = Convention { radicand, ..Convention::PAPER };
    let mut trace = Trace::default();
    (0..).filter_map(|number| shot(variant, convention, number, &mut trace)).take(count).collect()
}

fn shot(variant: Variant, convention: Convention, number: u64, trace: &mut Trace) -> Option<Shot> {
    let random = &mut stream(7, u64::from(variant.id()), 0, number);
    let mut p = Parameters::NONE;
    for symbol in variant.parameters() {
        let bounds = match (symbol.bounds(), symbol) {
            (Bounds::Fixed(lower, upper), _) => [lower, upper],
            (Bounds::PerVehicle, Symbol::f_0) => [100.0, 250.0],
            (Bounds::PerVehicle, Symbol::f_1) => [0.0, 5.0],
            (Bounds::PerVehicle, _) => [0.3, 0.6],
        };
        p.set(symbol, draw(random, bounds));
    }
    let dt = [0.1, 0.04, 0.5][random.random_range(0..3)];
    let mut s = edgy(random, &[0.02, 0.5, 3.0, 8.0, 30.0], [1.0, 120.0]);
    let v_f = edgy(random, &[0.0, -0.01, -0.6, 0.05, 20.0, 34.9, 40.0], [0.0, 36.0]);
    let v_l = if random.random_range(0..4) == 0 { v_f } else { edgy(random, &[0.0, 15.0], [0.0, 36.0]) };
    let h = p.t_h / 2.0 + p.theta;
    if variant.base.controller == Controller::Gipps && random.random_range(0..4) == 0 {
        // States with a radicand of Eq. 5 close to zero.
        let zero = p.d_0 + (p.a_min * h * h + v_f * p.t_h + v_l * v_l / p.a_hat_min) / 2.0;
        s = (zero + draw(random, [-0.005, 0.005])).max(0.02);
    }
    let a_f = edgy(random, &[0.0, -9.0, 6.0], [-4.0, 3.0]);
    let sin_grade = edgy(random, &[0.0, -0.5, 1.0], [-0.1, 0.1]);
    let (a_dp, a_ap) = (edgy(random, &[-0.05], [-8.0, -0.5]), edgy(random, &[0.05], [0.5, 4.0]));
    let (m_0, phi_f) = (draw(random, [900.0, 2500.0]), draw(random, [1.0, 1.1]));
    let dx_l = v_l * dt + draw(random, [-0.2, 0.2]);

    let vehicle = Vehicle {
        m_0,
        phi_f,
        mfc: Some(Mfc { v: vec![0.0, 50.0], a_ap: vec![a_ap; 2], a_dp: vec![a_dp; 2], source: None }),
        ..Vehicle::built_in().swap_remove(0)
    };
    // A vehicle length would cost digits of a small spacing.
    let len_l = 0.0;
    let two = |a: f64, b: f64| -> Arc<[f64]> { [a, b].into() };
    let case = Case {
        label: "step".into(),
        variant,
        convention,
        dt,
        x_l: two(s + len_l, s + len_l + dx_l),
        v_l: two(v_l, v_l),
        len_l,
        x_f: two(0.0, v_f * dt),
        v_f: two(v_f, v_f),
        a_f: two(a_f, a_f),
        s: two(s, s),
        vehicle: Some(Arc::new(vehicle)),
        grade: Some(Arc::new(Grade { x: vec![0.0], sin: vec![sin_grade], period: None, source: None })),
        t_0: 0.0,
        a_l: None,
        v_l2: None,
        s_l2: None,
        tau_p_upper: 0.0,
        extension_delay_upper: None,
        earliest: 1,
    };
    let run = simulate(&case, &p, trace);
    // A start that is already a crash, or a step of NaN, has no next state to compare.
    let [start, s_next] = trace.s[..] else { return None };
    if run.failure.is_some_and(|f| f.kind == FailureKind::NotFinite) {
        return None;
    }
    // Near zero the root of a radicand turns the last bit into a whole digit, so no tolerance suits the results. A shifted start
    // has a radicand of zero.
    let room = 2.0 * (start - p.d_0) - p.t_h * v_f - v_l * v_l / p.a_hat_min;
    let radicand = p.a_min * p.a_min * h * h - p.a_min * room;
    let start_only = variant.base.controller == Controller::Gipps && radicand.abs() < 1e-3;
    Some(Shot {
        params: variant.parameters().iter().map(|symbol| p.get(*symbol)).collect(),
        perceived: [s, v_f, v_l],
        a_f,
        m_0,
        phi_f,
        road: [sin_grade, a_dp, a_ap],
        dx_l,
        dt,
        start,
        start_only,
        next: [s_next, trace.v[1], trace.a[1]],
        flags: [
            run.n_cut_acc > 0,
            run.n_cut_dec > 0,
            run.failure.is_none_or(|failure| failure.kind != FailureKind::Radicand),
        ],
    })
}
