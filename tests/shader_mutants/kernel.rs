//! Tests whether a changed text still gives the same bits on the GPU: for the files that only a GPU runs unchanged.
//!
//! Other tests check that the unchanged text is right: they compare its bits with `lanes` and its scores with the reference.

use super::text::Mutant;
use crate::common::gpu::{case, job, population, vehicle};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::{BoundRule, Convention};
use leadlag::internal::evaluator::{BufferSet, Case, Differences, Evaluator, Job, Observer, Population, Score, Slopes};
use leadlag::internal::gpu::{AdapterChoice, Gpu, Limits};
use leadlag::internal::symbols::Symbol;
use leadlag::internal::trajectory::integrate;
use leadlag::internal::vehicle::{Mfc, Vehicle};
use leadlag::internal::wgsl::{Precision, read_extension};
use std::sync::Arc;

/// Samples of a submission, so that every longer run is interrupted, and never at the end of a block or of the ring.
const CHUNK: u32 = 13;

/// A run on the GPU, and its result without any change, as text (shortest round-trip form: every bit counts).
struct Scene {
    gpu: Gpu,
    /// Run one after the other, because data of the first in the buffers are wrong for the second.
    populations: [Population; 2],
    what: What,
    expected: String,
    name: String,
}

#[derive(Debug, Clone, Copy)]
enum What {
    /// Everything the measures need.
    Raw,
    /// Scores.
    Scores,
    /// Runs corrected towards the measurement.
    Observed,
    /// Scores with derivatives.
    Slopes,
}

/// An extension that reads every value and keeps all of them in its state.
const EVERYTHING: &str = "//! loop: look back by to
struct Parameters {
    /// how long ago [s], -1 to 1, neutral 0
    to: f32,
}
struct State {
    /// starts at s
    s: f32,
    /// starts at v_f
    v_f: f32,
    /// starts at v_l
    v_l: f32,
    /// starts at a_f
    a_f: f32,
    /// starts at 0.25
    count: f32,
}
struct Done {
    a: f32,
    state: State,
}
fn everything_command(state: State, w: World, x: Perceived, a_cmd: f32) -> Done {
    let known = 0.01 * w.t + 0.0001 * w.x_f + 0.1 * w.a_l + 0.02 * w.v_l2 + 0.003 * w.s_l2 + 0.02 * w.v_l_then;
    let more = 0.03 * w.v_l_half + 0.001 * state.s + 0.002 * state.v_f + 0.003 * state.v_l + 0.05 * state.a_f;
    let next = State(0.9 * state.s + 0.1 * x.s, 0.8 * state.v_f, state.v_l + 0.1, 0.5 * w.a_f, 0.9 * state.count);
    return Done(a_cmd + 0.1 * sin(known + more + state.count), next);
}
";

/// Variant (with two plus signs behind it: with the extension above), precision, request, goodness of fit, longest delay \[s\], clipping or rejecting: so that everything in the
/// kernel decides somewhere. Kernels that a driver compiles quickly come first, because the first scene that detects a mutant is the last.
const SCENES: [(&str, Precision, What, &str, f64, BoundRule); 14] = [
    ("idm+linear+constant", Precision::Plain, What::Scores, "nrmse-sva", 0.8, BoundRule::Reject),
    ("l-cth", Precision::Plain, What::Scores, "rmspe-sva", 0.8, BoundRule::Clip),
    ("l-cth", Precision::Plain, What::Scores, "rmse-sn-vn", 0.8, BoundRule::Clip),
    ("l-cth", Precision::Plain, What::Slopes, "nrmse-sva", 0.8, BoundRule::Clip),
    ("l-cth+delay", Precision::Plain, What::Slopes, "rmspe-sva", 2.0, BoundRule::Clip),
    ("l-cth", Precision::Compensated, What::Slopes, "rmse-sn-vn", 0.8, BoundRule::Clip),
    ("idm", Precision::Plain, What::Observed, "nrmse-sva", 0.8, BoundRule::Clip),
    ("idm+delay", Precision::Plain, What::Observed, "nrmse-sva", 0.8, BoundRule::Clip),
    // A ring that does not fit into the memory of an invocation.
    ("l-idm+delay+constant", Precision::Plain, What::Scores, "nrmse-sva", 7.0, BoundRule::Clip),
    ("l-gipps+nonlinear+mfc", Precision::Plain, What::Scores, "nrmse-sva", 0.8, BoundRule::Clip),
    ("l-cth++", Precision::Plain, What::Observed, "nrmse-sva", 0.8, BoundRule::Clip),
    ("idm+delay++", Precision::Plain, What::Raw, "nrmse-sva", 0.8, BoundRule::Clip),
    ("idm", Precision::Compensated, What::Scores, "u-sva", 0.8, BoundRule::Clip),
    ("gipps+delay+nonlinear+mfc", Precision::Compensated, What::Raw, "nrmse-sva", 0.8, BoundRule::Clip),
];

/// Lines of a file that the same scenes are likely to run.
const NEAR: usize = 2;

/// All scenes, run once unchanged.
pub struct Scenes {
    all: Vec<Scene>,
    /// File and line of the last detected mutant, and the scene that detected it.
    noticed: Option<(String, usize, usize)>,
}

impl Scenes {
    pub fn new() -> Scenes {
        Scenes { all: SCENES.into_iter().map(Scene::new).collect(), noticed: None }
    }

    /// The first difference that a scene detects: most kernels never run a given line.
    pub fn verdict(&mut self, mutant: &Mutant) -> Result<(), String> {
        let near =
            |(file, line, _): &&(String, usize, usize)| *file == mutant.file && line.abs_diff(mutant.line) <= NEAR;
        let first = self.noticed.as_ref().filter(near).map(|(_, _, scene)| *scene);
        let others = (0..self.all.len()).filter(|scene| Some(*scene) != first);
        for number in first.into_iter().chain(others) {
            let verdict = self.all[number].verdict(&mutant.file, &mutant.made);
            if verdict.is_err() {
                self.noticed = Some((mutant.file.clone(), mutant.line, number));
                return verdict;
            }
        }
        Ok(())
    }
}

/// Drives on which everything in the kernel matters somewhere.
fn cases(variant: Variant, convention: Convention, tau_p_upper: f64) -> Vec<Case> {
    let whole = |samples: usize, phase: f64| {
        let mut whole = case(variant, convention, samples, phase);
        whole.tau_p_upper = tau_p_upper;
        whole.vehicle = Some(Arc::new(weak_vehicle()));
        whole
    };
    let long = if tau_p_upper > 1.0 { 160 } else { 60 };
    // The drive passes the end of the closed track, 1200 m.
    let mut passing = whole(long, 0.3);
    passing.x_l = passing.x_l.iter().map(|x| x + 1120.0).collect();
    passing.x_f = passing.x_f.iter().map(|x| x + 1120.0).collect();
    let samples = if tau_p_upper > 1.0 { 90 } else { 25 };

    // A car ahead that stops and stays; steps longer than the shortest delay. The follower starts at a node of the MFC curve.
    let mut stopping = whole(samples, 0.0);
    stopping.dt = 0.3;
    let v_l = |i: usize| (12.0 - 0.9 * i as f64).max(0.0);
    drive(&mut stopping, 30.0, v_l, |i| if i == 0 { 7.5 } else { (9.0 - 0.5 * i as f64).max(0.0) });

    // A follower that stands while the car ahead rolls back onto it, to a spacing of exactly 0, or slightly more or less.
    let towards = |rest: f64| {
        let mut standing = whole(samples, 0.0);
        let n = standing.s.len();
        drive(&mut standing, 0.0, |_| 0.0, |_| 0.0);
        let s: Vec<f64> = (0..n).map(|i| (n.min(12) as f64 - i as f64).max(0.0) + rest).collect();
        standing.x_l = s.iter().map(|s| s + standing.len_l).collect();
        standing.s = s.into();
        standing
    };
    // A start that is a crash, or almost.
    let starting = |s: [f64; 2]| {
        let mut start = towards(0.5);
        let later = start.s[2..].to_vec();
        start.s = s.into_iter().chain(later).collect();
        start
    };
    let mut cases = vec![
        whole(samples, 1.0),
        passing,
        stopping,
        towards(0.0),
        towards(0.005),
        starting([0.0, 3.0]),
        starting([0.005, 0.005]),
        starting([-1.0, -1.0]),
    ];
    if tau_p_upper <= 1.0 {
        // Done before the first submission is.
        cases.push(whole(12, 0.5));
    }
    cases
}

/// Replaces speeds and the values derived from them.
fn drive(case: &mut Case, gap: f64, v_l: impl Fn(usize) -> f64, v_f: impl Fn(usize) -> f64) {
    let n = case.s.len();
    let (v_l, v_f): (Vec<f64>, Vec<f64>) = ((0..n).map(v_l).collect(), (0..n).map(v_f).collect());
    let (x_l, x_f) = (integrate(gap + case.len_l, &v_l, case.dt), integrate(0.0, &v_f, case.dt));
    case.s = x_l.iter().zip(&x_f).map(|(x_l, x_f)| x_l - x_f - case.len_l).collect();
    case.a_f = (0..n).map(|i| if i == 0 { 0.0 } else { (v_f[i] - v_f[i - 1]) / case.dt }).collect();
    (case.x_l, case.x_f) = (x_l.into(), x_f.into());
    (case.v_l, case.v_f) = (v_l.into(), v_f.into());
}

/// An MFC curve with unequal nodes, which cuts often and ends below the speeds of the drives.
fn weak_vehicle() -> Vehicle {
    let mfc = Mfc {
        v: vec![0.0, 3.0, 7.5, 12.0, 13.5],
        a_ap: vec![0.4, 0.9, 0.1, 0.7, 0.3],
        a_dp: vec![-0.2, -0.6, -1.5, -0.4, -1.0],
        source: None,
    };
    Vehicle { mfc: Some(mfc), ..vehicle() }
}

/// Candidates from the whole search space, and some beyond it: NaN, overflow, a power that is too large, no reaction.
fn population_of(variant: Variant, convention: Convention, seed: u64) -> Population {
    let mut all = population(variant, convention, 150, seed);
    let mut changed = |symbol: Symbol, value: f64| {
        let mut values = all.values(0).to_vec();
        if let Some(k) = all.symbols().iter().position(|s| *s == symbol) {
            values[k] = value;
            all.push(&values);
        }
    };
    changed(Symbol::d_0, f64::NAN);
    changed(Symbol::a_max, 3e38);
    changed(Symbol::v_0, 1e-4);
    changed(Symbol::v_0, 5e3);
    changed(Symbol::k_s, 0.0);
    changed(Symbol::t_h, 1e30);
    all
}

/// The numbers of a failed run may be any.
fn finite(mut all: Vec<Slopes>) -> String {
    all.retain(|slopes| slopes.cost.is_finite());
    format!("{all:?}")
}

impl Scene {
    fn new(row: (&str, Precision, What, &str, f64, BoundRule)) -> Scene {
        let (variant, precision, what, gof, tau_p_upper, bounds) = row;
        let base: Variant = variant.trim_end_matches("++").parse().expect("a variant");
        let variant = if variant.ends_with("++") {
            base.with(read_extension("everything.wgsl", EVERYTHING).expect("valid")).expect("no conflict")
        } else {
            base
        };
        // The authors' look-up jumps at the nodes of an MFC curve, and their denominators have a floor.
        let Convention { mfc, denominators, .. } = Convention::AUTHORS;
        let convention = Convention { bounds, mfc, denominators, ..Convention::PAPER };
        // Rows of workgroups; full buffers, so that no word has room beside its place.
        let limits = Limits { chunk: Some(CHUNK), workgroups: 3, binding: 1 << 15, ..Limits::NONE };
        let gof = gof.parse().expect("a goodness of fit");
        let cases = cases(variant, convention, tau_p_upper);
        let gpu =
            Gpu::with_limits(cases, gof, precision, &AdapterChoice::Best, limits).unwrap_or_else(|e| panic!("{e}"));
        let populations = [4, 3].map(|seed| population_of(variant, convention, seed));
        let name = format!("{} in {}, {what:?}", row.0, precision.into_str());
        let mut scene = Scene { gpu, populations, what, expected: String::new(), name };
        scene.expected = scene.run().unwrap_or_else(|e| panic!("{variant}: {e}"));
        scene
    }

    fn run(&mut self) -> Result<String, String> {
        let Scene { gpu, populations, what, .. } = self;
        let cases = gpu.cases().len();
        let mut text = String::new();
        for population in populations {
            let jobs: Vec<Job> = (0..cases).map(|case| job(case, population)).collect();
            text += &match what {
                What::Raw => gpu.raw(&jobs).map(|raw| format!("{raw:?}")),
                What::Scores => {
                    let mut scores = vec![Score::Rejected; Job::candidates(&jobs)];
                    gpu.submit(BufferSet::A, &jobs)
                        .and_then(|()| gpu.collect(BufferSet::A, &mut scores))
                        .map(|()| format!("{scores:?}"))
                }
                What::Observed => {
                    let gain = [0.1, 0.02, 0.03, 0.2, -0.05, 0.3];
                    let observer = Observer { gain, whitening: [1.0, 0.3, 2.0], decay: 0.9 };
                    let observed = |job: &Job| gpu.observed(job, &vec![observer; job.population.len()], 8);
                    let observed: Result<Vec<_>, _> = jobs.iter().map(observed).collect();
                    observed.map(|observed| format!("{observed:?}"))
                }
                What::Slopes => {
                    // Of three sizes; some have candidates in common, and several do not fit into one row of workgroups.
                    let group = |k: usize| Differences { first: 5 * k, steps: vec![1e-3; 2 + 3 * (k % 3)] };
                    let groups: Vec<Differences> = (0..25).map(group).collect();
                    let slopes: Result<Vec<_>, _> = jobs.iter().map(|job| gpu.slopes(job, &groups)).collect();
                    slopes.map(|slopes| finite(slopes.into_iter().flatten().flatten().collect()))
                }
            }
            .map_err(|e| e.to_string())?;
        }
        Ok(text)
    }

    /// Differences that are detected with another text in place of a file.
    fn verdict(&mut self, file: &str, text: &str) -> Result<(), String> {
        self.gpu.replace_shader(file, text).map_err(|e| e.to_string())?;
        let found = self.run()?;
        if found == self.expected { Ok(()) } else { Err(format!("other bits: {}", self.name)) }
    }
}
