//! The two transcriptions of the paper agree: the WGSL text in f64 and the reference.

use crate::common;
use crate::common::cars;
use crate::common::tolerance::{AMPLIFIED, NUDGE, PART, WHOLE_RUN};
use leadlag::internal::catalog::{Constraint, Controller, Dynamics, Spacing, Variant};
use leadlag::internal::convention::{Convention, Radicand};
use leadlag::internal::evaluator::{Case, Evaluator, Job, Outcome, Population};
use leadlag::internal::lanes::{Function, Lanes, LanesPrecision};
use leadlag::internal::reference::{Reference, Trace, parts};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::symbols::{Parameters, Symbol};
use leadlag::internal::trajectory::Trajectory;
use leadlag::internal::wgsl::{Precision, Recipe, Source, check};

/// Largest share of runs, one in this many, that may amplify rounding beyond the tolerance: a third of the values lie on a bound, so that
/// many linear controllers oscillate with the largest gains.
const SENSITIVE_ONE_IN: usize = 10;

/// Largest relative difference of the measures; 0 for runs that failed alike, `None` if they ended differently.
fn difference(ours: &Outcome, reference: &Outcome) -> Option<f64> {
    match (&ours.result, &reference.result) {
        (Ok(ours), Ok(reference)) => {
            let pairs = ours.values().into_iter().zip(reference.values());
            Some(
                pairs
                    .map(|(a, b)| if a.to_bits() == b.to_bits() { 0.0 } else { ((a - b) / b).abs() })
                    .fold(0.0, f64::max),
            )
        }
        (Err(ours), Err(reference)) => (ours == reference).then_some(0.0),
        _ => None,
    }
}

/// Change of the reference itself if its parameters move by almost nothing; `None` if it then ends differently.
fn amplification(case: &Case, population: &Population, candidate: usize, reference: &Outcome) -> Option<f64> {
    let mut trace = Trace::default();
    let symbols = population.symbols();
    let mut largest = 0.0_f64;
    for pattern in 0..4_usize {
        let mut parameters = population.parameters(candidate);
        // The delay stays fixed, because it must not leave its bounds.
        for (k, symbol) in symbols.iter().enumerate().filter(|(_, s)| **s != Symbol::tau_p) {
            let sign = if (k + pattern).is_multiple_of(pattern + 1) { 1.0 } else { -1.0 };
            parameters.set(*symbol, parameters.get(*symbol) * (1.0 + sign * NUDGE));
        }
        largest = largest.max(difference(&Reference::outcome(case, &parameters, &mut trace), reference)?);
    }
    Some(largest)
}

/// Both evaluators on all variants; returns the numbers of compared runs and of runs that were only close.
fn compare(trajectory: &Trajectory, convention: Convention, count: usize) -> (usize, usize) {
    let (mut compared, mut sensitive) = (0, 0);
    let mut wrong = Vec::new();
    for variant in Variant::all() {
        let case = cars::case(trajectory, variant, convention);
        let population = cars::population(variant, convention, count, u64::from(variant.id()));
        let jobs = [Job { case: 0, population: &population }];
        let gof = GoodnessOfFit::NRMSE_SVA;
        let ours =
            Lanes::new(vec![case.clone()], gof, LanesPrecision::F64).expect("every variant runs").outcomes(&jobs);
        let reference = Reference::new(vec![case.clone()], gof).outcomes(&jobs).expect("the reference runs");
        for (i, (ours, reference)) in ours.expect("delays are within bounds").iter().zip(&reference).enumerate() {
            compared += 1;
            let values = population.values(i);
            if ours.delay_steps != reference.delay_steps {
                wrong.push(format!("{variant} {values:?}: delay {} not {}", ours.delay_steps, reference.delay_steps));
            }
            match difference(ours, reference) {
                Some(d) if d <= WHOLE_RUN => {
                    let cuts = |o: &Outcome| (o.n_cut_acc, o.n_cut_dec);
                    sensitive += usize::from(cuts(ours) != cuts(reference));
                }
                d if amplification(&case, &population, i, reference)
                    .is_none_or(|change| d.is_some_and(|d| d <= AMPLIFIED * change)) =>
                {
                    sensitive += 1;
                }
                d => wrong.push(format!("{variant} {values:?}: {d:?}: {ours:?} not {reference:?}")),
            }
        }
    }
    assert!(wrong.is_empty(), "{} of {compared} runs:\n{}", wrong.len(), wrong[..wrong.len().min(5)].join("\n"));
    (compared, sensitive)
}

/// Whole runs of so many candidates on a drive.
fn whole_runs(trajectory: &Trajectory, candidates: usize) {
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        let (compared, sensitive) = compare(trajectory, convention, candidates);
        println!("{compared} runs, {sensitive} of them sensitive");
        assert!(
            sensitive * SENSITIVE_ONE_IN <= compared,
            "{sensitive} of {compared} runs differ by more than {WHOLE_RUN:e}"
        );
    }
}

#[test]
fn whole_runs_of_every_variant() {
    whole_runs(&cars::drive(200.0), 24);
}

#[test]
fn whole_runs_on_measured_data() {
    let Some(shared) = common::shared("whole_runs_on_measured_data") else { return };
    whole_runs(&cars::measured(&shared), 4);
}

/// Values of all arguments, by path.
struct Draw {
    parameters: Parameters,
    /// Perceived spacing, speed, speed of the preceding vehicle; then the undelayed speed and acceleration.
    x: [f64; 3],
    v_f: f64,
    a_f: f64,
    s_des: f64,
    a: f64,
    /// sin_grade, a_dp, a_ap.
    road: [f64; 3],
    /// m_0, phi_f, dt.
    job: [f64; 3],
}

impl Draw {
    /// Edge cases in a third of the draws: bounds, standstill, tiny and negative gaps, speeds slightly below 0 and above v_0, both signs of
    /// the arguments of minima and maxima.
    fn new(random: &mut cars::Random) -> Draw {
        let mut pick = |edges: &[f64], low: f64, high: f64| {
            if random.next() < 1.0 / 3.0 {
                edges[(random.next() * edges.len() as f64) as usize]
            } else {
                low + (high - low) * random.next()
            }
        };
        let mut parameters = Parameters::NONE;
        for symbol in Symbol::ALL {
            let [low, high] =
                Case::bounds(*symbol, Some(&cars::vehicle()), Convention::PAPER).expect("the vehicle has road loads");
            parameters.set(*symbol, pick(&[low, high], low, high));
        }
        let v_0 = parameters.v_0;
        let speeds = [0.0, -1e-9, -1e-4, 1e-6, 0.01, v_0, v_0 * 1.01, v_0 * 1.2];
        let gaps = [1e-3, 0.1, -0.1, -5.0, 1.0, parameters.d_0, 500.0];
        Draw {
            x: [pick(&gaps, 0.5, 120.0), pick(&speeds, 0.0, 36.0), pick(&speeds, 0.0, 36.0)],
            v_f: pick(&speeds, 0.0, 36.0),
            a_f: pick(&[0.0, -7.0, 5.0], -8.0, 6.0),
            s_des: pick(&gaps, 0.5, 120.0),
            a: pick(&[-7.0, 5.0, -7.000001, 5.000001, 0.0, -6.0, 3.5], -9.0, 7.0),
            road: [pick(&[0.0, 0.03, -0.03], -0.1, 0.1), pick(&[-6.0, -3.0], -8.0, -1.0), pick(&[3.5, 0.5], 0.2, 5.0)],
            job: [pick(&[1500.0], 900.0, 2500.0), pick(&[1.0, 1.05], 1.0, 1.2), pick(&[0.1], 0.02, 1.0)],
            parameters,
        }
    }

    fn get(&mut self, path: &str) -> f64 {
        match path.strip_prefix("p.") {
            Some(name) => self.parameters.get(Symbol::from_name(name).expect("a symbol")),
            None => *self.place(path),
        }
    }

    fn set(&mut self, path: &str, value: f64) {
        match path.strip_prefix("p.") {
            Some(name) => self.parameters.set(Symbol::from_name(name).expect("a symbol"), value),
            None => *self.place(path) = value,
        }
    }

    fn place(&mut self, path: &str) -> &mut f64 {
        match path {
            "x.s" => &mut self.x[0],
            "x.v_f" => &mut self.x[1],
            "x.v_l" => &mut self.x[2],
            "s_des" => &mut self.s_des,
            "v_f" | "ego.v_f" => &mut self.v_f,
            "ego.a_f" => &mut self.a_f,
            "a" | "a_cmd" => &mut self.a,
            "road.sin_grade" => &mut self.road[0],
            "road.a_dp" => &mut self.road[1],
            "road.a_ap" => &mut self.road[2],
            "ego.m_0" => &mut self.job[0],
            "ego.phi_f" => &mut self.job[1],
            "ego.dt" => &mut self.job[2],
            _ => panic!("no value for {path}"),
        }
    }
}

/// Compares a function of a variant's text with its transcription: numbers within the tolerance, truth values unless the
/// arguments are on the edge.
fn compare_part(variant: &Variant, function: &str, reference: &dyn Fn(&Draw) -> Vec<f64>) {
    let recipe =
        Recipe { variant: *variant, precision: Precision::Plain, radicand: Radicand::Measured, observed: false };
    let source = Source::model(&recipe);
    let part = Function::compile(&source, &check(&source).expect("valid"), function).expect("runs on the CPU");
    let mut random = cars::Random(42);
    for draw in 0..3_000 {
        let mut at = Draw::new(&mut random);
        let arguments: Vec<f64> = part.inputs().iter().map(|path| at.get(path)).collect();
        let (ours, theirs) = (part.call_f64(&arguments), reference(&at));
        for (k, (a, b)) in ours.iter().zip(&theirs).enumerate() {
            let mut tolerance = PART * b.abs();
            if a.to_bits() != b.to_bits() && (a - b).abs() > tolerance {
                for (path, value) in part.inputs().iter().zip(&arguments) {
                    for nudge in [1.0 - PART, 1.0 + PART] {
                        at.set(path, value * nudge);
                        tolerance += (reference(&at)[k] - b).abs();
                    }
                    at.set(path, *value);
                }
            }
            let values: Vec<_> = part.inputs().iter().zip(&arguments).collect();
            assert!(
                (a.is_nan() && b.is_nan()) || a == b || (a - b).abs() <= tolerance,
                "{variant} {function}[{k}], draw {draw}: {a:?} not {b:?} (tolerance {tolerance:e})\n{values:?}"
            );
        }
    }
}

#[test]
fn spacing_policies() {
    for &part in Spacing::ALL.iter().filter(|part| **part != Spacing::Inherent) {
        let variant = Variant::all().find(|v| v.base.spacing == part).expect("every part is in a variant");
        compare_part(&variant, "desired_spacing", &|at| vec![parts::desired_spacing(part, &at.parameters, at.x)]);
    }
}

#[test]
fn controllers() {
    // The stage before a law passes the present speed on; laws are compared in tests/equality/causes.rs.
    for &part in Controller::ALL.iter().filter(|part| **part != Controller::Law) {
        let variant = Variant::all().find(|v| v.base.controller == part).expect("every part is in a variant");
        compare_part(&variant, "commanded_acceleration", &|at| {
            let (a, feasible) = parts::commanded_acceleration(part, &at.parameters, at.x, at.s_des, at.v_f);
            // The text clamps the root of Eq. 4 if a speed is far below 0, which never happens in a simulation.
            vec![a, f64::from(u8::from(feasible))]
        });
    }
}

#[test]
fn vehicle_dynamics() {
    for &part in Dynamics::ALL {
        let variant = Variant::all().find(|v| v.dynamics == part).expect("every part is in a variant");
        compare_part(&variant, "vehicle_response", &|at| {
            let ego = [at.v_f, at.a_f, at.job[0], at.job[1], at.job[2]];
            vec![parts::vehicle_response(part, &at.parameters, at.a, ego, at.road[0])]
        });
    }
}

#[test]
fn constraints() {
    for &part in Constraint::ALL {
        let variant = Variant::all().find(|v| v.constraint == part).expect("every part is in a variant");
        compare_part(&variant, "constrained_acceleration", &|at| {
            vec![parts::constrained_acceleration(part, at.a, [at.road[1], at.road[2]])]
        });
    }
}
