//! The test bench: hand-built trajectories, and runs of which one sample is checked.

use crate::common::tolerance::HAND_WORKED;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::Case;
use leadlag::internal::reference::{Run, Trace, simulate};
use leadlag::internal::symbols::Parameters;
use leadlag::internal::trajectory::{Grade, Source, Trajectory};
use leadlag::internal::vehicle::{Mfc, Vehicle};

/// All parameters at 0: the start of every parameter list below.
pub const NONE: Parameters = Parameters::NONE;

/// Length of the preceding vehicle \[m\].
pub const LEN_L: f64 = 5.0;

/// Position of the follower at sample 0 \[m\].
pub const X_0: f64 = 100.0;

/// One measured sample: spacing \[m\], speed of the follower, speed of the preceding vehicle \[m/s\].
pub type Sample = [f64; 3];

/// A trajectory from samples 0.1 s apart. The follower's position starts at [`X_0`] and follows from its speed (Eq. 1);
/// the preceding vehicle is put at the spacing, whatever its speed: only the sample under test matters.
pub fn trajectory(samples: &[Sample]) -> Trajectory {
    let mut x_f = vec![X_0];
    for pair in samples.windows(2) {
        x_f.push(x_f[x_f.len() - 1] + (pair[0][1] + pair[1][1]) / 2.0 * 0.1);
    }
    let column = |k: usize| samples.iter().map(|sample| sample[k]).collect::<Vec<f64>>();
    Trajectory {
        label: "hand-built".to_owned(),
        source: Source { path: String::new(), sha256: String::new() },
        follower: 1,
        name: "ego".to_owned(),
        dt: 0.1,
        id: None,
        dt_raw: 0.1,
        t: (0..samples.len()).map(|i| i as f64 / 10.0).collect(),
        x_l: x_f.iter().zip(samples).map(|(x, sample)| x + LEN_L + sample[0]).collect(),
        v_l: column(2),
        len_l: LEN_L,
        x_f,
        is_placed: false,
        v_f: column(1),
        s: column(0),
        v_l2: None,
        s_l2: None,
        grade: Some(Grade::level()),
        notes: Vec::new(),
    }
}

/// The same state at every sample, 13 samples: enough for every variant.
pub fn steady(sample: Sample) -> Trajectory {
    trajectory(&[sample; 13])
}

/// A car of 1500 kg and phi = 1.05 with an MFC curve so wide that it never binds.
pub fn vehicle() -> Vehicle {
    Vehicle {
        slug: "bench".to_owned(),
        name: "Bench".to_owned(),
        aliases: Vec::new(),
        m_0: 1500.0,
        phi_f: 1.05,
        length: None,
        f_0: [0.0; 2],
        f_1_printed: [0.0; 2],
        f_2_printed: [0.0; 2],
        table: None,
        mfc: Some(Mfc { v: vec![0.0, 100.0], a_ap: vec![500.0; 2], a_dp: vec![-500.0; 2], source: None }),
    }
}

/// The variant of that name.
pub fn variant(name: &str) -> Variant {
    name.parse().expect("a variant of Table 1")
}

/// A case under a convention; the upper bound of tau_p is that of Table 3, 0.8 s.
pub fn case(name: &str, trajectory: &Trajectory, convention: Convention) -> Case {
    Case::new(trajectory, variant(name), Some(&vehicle()), convention, 0.8)
        .expect("the bench has all that a variant needs")
}

/// Simulates one candidate.
pub fn run(case: &Case, p: &Parameters) -> (Run, Trace) {
    let mut trace = Trace::default();
    let run = simulate(case, p, &mut trace);
    (run, trace)
}

/// Compares a number of a run with the hand-worked one.
#[track_caller]
pub fn close(what: &str, unit: &str, step: usize, found: f64, expected: f64) {
    let allowed = HAND_WORKED * expected.abs().max(1.0);
    assert!(
        (found - expected).abs() <= allowed,
        "{what} at step {step}: found {found:?} {unit}, by hand {expected:?} {unit} (allowed difference {allowed:e})"
    );
}

/// The base model commands `a_cmd` in a state. Checked at the first simulated sample of every variant of this base without dynamics (the
/// command is then the acceleration, Eq. 9), with and without delay (the state is constant), with every constraint that does not change
/// `a_cmd`, in both conventions.
#[track_caller]
pub fn commands(base: &str, state: Sample, p: &Parameters, a_cmd: f64) {
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        for suffix in ["", "+constant", "+mfc", "+delay", "+delay+constant", "+delay+mfc"] {
            if suffix.ends_with("constant") && !(-6.9..=4.9).contains(&a_cmd) {
                continue;
            }
            let name = format!("{base}{suffix}");
            let p = if suffix.contains("delay") { Parameters { tau_p: 0.25, ..*p } } else { *p };
            let (run, trace) = run(&case(&name, &steady(state), convention), &p);
            let what = format!("{name}, {convention}: a_f, state s, v_f, v_l = {state:?} ({run:?})");
            assert!(trace.a.len() > run.first, "{what}: the run ends before its first simulated sample");
            let now = run.first - 1;
            close(&what, "m/s²", run.first, trace.a[run.first], a_cmd);
            // Eq. 1
            let v = state[1] + 0.1 * a_cmd;
            close(&format!("{what}: v_f"), "m/s", run.first, trace.v[run.first], v);
            close(&format!("{what}: x_f"), "m", run.first, trace.x[run.first], trace.x[now] + 0.05 * (state[1] + v));
        }
    }
}
