//! Lanes: the same bits for any instruction set, block size, thread or neighbouring candidate, and clear refusals.

use crate::common::cars;
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Evaluator, Failure, FailureKind, Job, Observer, Population, Raw, Score};
use leadlag::internal::lanes::{Function, InstructionSet, Lanes, LanesPrecision};
use leadlag::internal::reference::{Reference, Trace, simulate};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::wgsl::{Source, check};

const PRECISIONS: [LanesPrecision; 3] = [LanesPrecision::Plain, LanesPrecision::Compensated, LanesPrecision::F64];

/// Variants that together use every part, with and without delay.
const VARIANTS: [&str; 6] = [
    "idm",
    "gipps+delay+linear+constant",
    "l-cth+mfc",
    "l-gipps+delay+nonlinear+mfc",
    "l-idm+delay+nonlinear",
    "idm+delay+linear+mfc",
];

fn variant(name: &str) -> Variant {
    name.parse().expect("a variant of Table 1")
}

fn lanes(case: &Case, precision: LanesPrecision) -> Lanes {
    Lanes::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA, precision).expect("every variant runs")
}

fn raw(lanes: &mut Lanes, population: &Population) -> Vec<Raw> {
    lanes.raw(&[Job { case: 0, population }]).expect("delays are within bounds")
}

/// Everything that was computed, as bits.
fn bits(raw: &[Raw]) -> Vec<Vec<u64>> {
    let of = |r: &Raw| {
        let counts = [r.status, r.n_cut_acc, r.n_cut_dec].map(u64::from);
        let sums = r.error2.iter().chain(&r.simulated2).chain(&r.relative2).chain([&r.floored2_v]);
        counts.into_iter().chain(sums.map(|x| x.to_bits())).collect()
    };
    raw.iter().map(of).collect()
}

/// Runs `check` on each variant, convention and precision with its bits in the usual way.
fn each(count: usize, check: impl Fn(&Case, &Population, LanesPrecision, Vec<Vec<u64>>)) {
    let trajectory = cars::drive(60.0);
    for name in VARIANTS {
        for convention in [Convention::PAPER, Convention::AUTHORS] {
            let case = cars::case(&trajectory, variant(name), convention);
            let population = cars::population(variant(name), convention, count, 3);
            for precision in PRECISIONS {
                let usual = bits(&raw(&mut lanes(&case, precision), &population));
                check(&case, &population, precision, usual);
            }
        }
    }
}

#[test]
fn every_instruction_set_gives_the_same_bits() {
    println!("compared: {:?}", InstructionSet::available());
    each(150, |case, population, precision, usual| {
        for set in InstructionSet::available() {
            let other = bits(&raw(&mut lanes(case, precision).with_instructions(set), population));
            assert!(usual == other, "{} {}: {set:?} differs", case.variant, precision.into_str());
        }
    });
}

#[test]
fn every_block_size_gives_the_same_bits() {
    each(150, |case, population, precision, usual| {
        for size in [8, 16, 32, 64, 128] {
            let other = bits(&raw(&mut lanes(case, precision).with_lanes(size), population));
            assert!(usual == other, "{} {}: blocks of {size} differ", case.variant, precision.into_str());
        }
    });
}

#[test]
fn order_and_company_do_not_matter() {
    each(70, |case, population, precision, usual| {
        let mut evaluator = lanes(case, precision);
        let mut reversed = Population::new(population.symbols());
        for i in (0..population.len()).rev() {
            reversed.push(population.values(i));
        }
        let mut other = bits(&raw(&mut evaluator, &reversed));
        other.reverse();
        assert!(usual == other, "{} {}: reversed", case.variant, precision.into_str());
        for i in [0, population.len() / 2] {
            let mut one = Population::new(population.symbols());
            one.push(population.values(i));
            assert!(bits(&raw(&mut evaluator, &one)) == usual[i..=i], "{}: alone", case.variant);
        }
    });
}

#[test]
fn the_number_of_threads_does_not_matter() {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("threads");
    each(300, |case, population, precision, usual| {
        let other = pool.install(|| bits(&raw(&mut lanes(case, precision), population)));
        assert!(usual == other, "{} {}: three threads", case.variant, precision.into_str());
    });
}

#[test]
fn several_jobs_equal_single_ones() {
    let trajectory = cars::drive(60.0);
    let variant = variant("gipps+delay+linear+constant");
    let case = cars::case(&trajectory, variant, Convention::PAPER);
    let populations = [5, 130, 1].map(|n| cars::population(variant, Convention::PAPER, n, n as u64));
    let mut evaluator =
        Lanes::new(vec![case.clone(), case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain).expect("it runs");
    let jobs = [0, 1, 0].into_iter().zip(&populations).map(|(case, population)| Job { case, population });
    let jobs: Vec<Job> = jobs.collect();
    let together = bits(&evaluator.raw(&jobs).expect("delays are within bounds"));
    let single: Vec<_> = populations.iter().flat_map(|population| bits(&raw(&mut evaluator, population))).collect();
    assert!(together == single, "jobs run together differ from jobs run alone");
}

#[test]
fn nan_stays_with_its_candidate() {
    each(40, |case, population, precision, usual| {
        for column in 0..population.symbols().len() {
            for bad in [f64::NAN, f64::INFINITY] {
                let mut poisoned = Population::new(population.symbols());
                for i in 0..population.len() {
                    let mut values = population.values(i).to_vec();
                    if i % 3 == 1 {
                        values[column] = bad;
                    }
                    poisoned.push(&values);
                }
                let result = raw(&mut lanes(case, precision), &poisoned);
                for (i, (now, before)) in bits(&result).into_iter().zip(&usual).enumerate() {
                    if i % 3 == 1 {
                        let first = case.pace(&poisoned.parameters(i)).first;
                        let failure = Failure { kind: FailureKind::NotFinite, step: first };
                        assert_eq!(
                            result[i].failure(),
                            Some(failure),
                            "{} {:?}",
                            case.variant,
                            poisoned.symbols()[column]
                        );
                    } else {
                        assert!(now == *before, "{}: candidate {i} beside NaN", case.variant);
                    }
                }
            }
        }
    });
}

#[test]
fn an_observer_without_gain_changes_nothing() {
    each(70, |case, population, precision, usual| {
        let observers = vec![Observer::NONE; population.len()];
        let job = Job { case: 0, population };
        let observed = lanes(case, precision).observed(&job, &observers, 100).expect("delays are within bounds");
        let raws: Vec<Raw> = observed.iter().map(|o| o.raw).collect();
        assert!(bits(&raws) == usual, "{} {}: gain zero", case.variant, precision.into_str());
        for o in observed.iter().filter(|o| o.raw.status == 0) {
            for k in 0..2 {
                let sum: f64 = o.blocks.iter().map(|block| block[k]).sum();
                // One side adds up a run in a single f32 sum, the other in sums of blocks.
                assert!((sum - o.raw.error2[k]).abs() <= 1e-4 * o.raw.error2[k], "{sum} not {}", o.raw.error2[k]);
            }
        }
    });
}

#[test]
fn a_trace_restarts_from_any_state() {
    let trajectory = cars::drive(60.0);
    for name in VARIANTS {
        let case = cars::case(&trajectory, variant(name), Convention::PAPER);
        let parameters = cars::spread(variant(name), Convention::PAPER, 1, 11, 0.0).parameters(0);
        let mut reference = Trace::default();
        let run = simulate(&case, &parameters, &mut reference);
        let evaluator = lanes(&case, LanesPrecision::F64);
        for from in (run.first.max(10)..reference.s.len() - 50).step_by(50) {
            let history = [&reference.s[..], &reference.v, &reference.a];
            let states = evaluator.trace(0, &parameters, history, from, from + 50).expect("the delay is within bounds");
            for (k, [s, v, a]) in states.into_iter().enumerate() {
                let at = from + k;
                for (ours, theirs) in [(s, reference.s[at]), (v, reference.v[at]), (a, reference.a[at])] {
                    // 1e-9: positions of a kilometre and 50 steps.
                    assert!((ours - theirs).abs() <= 1e-9 * theirs.abs().max(1.0), "{name} {at}: {ours} not {theirs}");
                }
            }
        }
    }
}

/// Kicks that share blocks give the same bits as a kick after the same past.
#[test]
fn kicks_are_changes_of_the_past() {
    let trajectory = cars::drive(60.0);
    for name in VARIANTS {
        let case = cars::case(&trajectory, variant(name), Convention::PAPER);
        let parameters = cars::spread(variant(name), Convention::PAPER, 1, 11, 0.0).parameters(0);
        let mut reference = Trace::default();
        let run = simulate(&case, &parameters, &mut reference);
        let evaluator = lanes(&case, LanesPrecision::F64);
        let history = [&reference.s[..], &reference.v, &reference.a];
        let to = reference.s.len();
        // More than one block; the last run follows a kick so hard that it crashes.
        let begin = run.first.max(10);
        let from: Vec<usize> = (begin..to).step_by(((to - begin) / 20).max(1)).collect();
        let mut kicks: Vec<[f64; 3]> = (0..from.len()).map(|k| [0.01 * (k % 3) as f64, 0.02, 0.0]).collect();
        *kicks.last_mut().expect("some") = [-1e3, 0.0, 0.0];
        let together = evaluator.kicked(0, &parameters, history, (&from, &kicks), to).expect("within bounds");
        assert!(from.len() > Lanes::TRACES && together.len() == from.len());
        for ((from, kick), states) in from.iter().zip(&kicks).zip(together) {
            let past = [0, 1, 2].map(|k| {
                let mut past = history[k][..*from].to_vec();
                past[from - 1] += kick[k];
                past
            });
            let alone = evaluator.trace(0, &parameters, past.each_ref().map(|p| &p[..]), *from, to).expect("bounds");
            assert!(states == alone, "{name} from {from}");
            assert_eq!(states.is_empty(), kick[0] < 0.0, "{name} from {from}");
        }
    }
}

#[test]
fn scores_follow_from_outcomes() {
    let trajectory = cars::drive(60.0);
    for gof in ["nrmse-sva", "rmspe-sv", "u-sva", "rmse-sn-vn", "rmse-s"] {
        let gof: GoodnessOfFit = gof.parse().expect("a goodness of fit");
        for name in VARIANTS {
            let case = cars::case(&trajectory, variant(name), Convention::AUTHORS);
            let population = cars::population(variant(name), Convention::AUTHORS, 20, 5);
            for precision in PRECISIONS {
                let mut evaluator = Lanes::new(vec![case.clone()], gof, precision).expect("every variant runs");
                let mut scores = vec![Score::Rejected; population.len()];
                evaluator.evaluate(&population, &mut scores).expect("delays are within bounds");
                let outcomes = evaluator.outcomes(&[Job { case: 0, population: &population }]).expect("as before");
                let tolerance = if precision == LanesPrecision::F64 { 1e-12 } else { 1e-4 };
                for (score, outcome) in scores.iter().zip(&outcomes) {
                    match (score, outcome.score(&gof, case.convention.bounds)) {
                        (Score::Value(a), Score::Value(b)) => {
                            assert!((a - b).abs() <= tolerance * b.abs(), "{name} {gof}: {a} not {b}");
                        }
                        (a, b) => assert_eq!(*a, b, "{name} {gof}"),
                    }
                }
            }
        }
    }
}

#[test]
fn a_delay_beyond_the_memory_is_an_error() {
    let variant = variant("idm+delay");
    let case = cars::case(&cars::drive(60.0), variant, Convention::PAPER);
    let mut population = cars::population(variant, Convention::PAPER, 1, 1);
    let mut values = population.values(0).to_vec();
    *values.last_mut().expect("tau_p is the last") = 1.5;
    population.push(&values);
    let error = lanes(&case, LanesPrecision::Plain).raw(&[Job { case: 0, population: &population }]).unwrap_err();
    assert!(error.to_string().starts_with("tau_p: expected at most 0.8 s, found 1.5"), "{error}");
}

#[test]
fn the_subset_runs() {
    let text = "struct Pair { a: f32, b: f32 }
        const HALF = 0.5;
        fn power(x: f32, y: f32) -> f32 { return x + y; } // known by its name
        fn swap(p: Pair) -> Pair { return Pair(p.b, p.a); }
        fn f(x: f32, y: f32, flag: bool) -> Pair {
            var p = Pair(x, y);
            var k = HALF;
            if (x > 0.0 && !flag || y == 1.0) {
                p = swap(p);
                if (x >= 2.0) { k = 0.1; } else { p.a = -p.a; }
            } else {
                p.b = clamp(abs(p.b), 1.0, max(floor(x), 3.0)) + power(2.0, 3.0);
            }
            return Pair(p.a * k, select(p.b, sqrt(p.b), p.b > 0.0));
        }";
    let source = Source::single("pair.wgsl", text);
    let f = Function::compile(&source, &check(&source).unwrap(), "f").unwrap();
    assert_eq!(
        (f.inputs(), f.outputs()),
        (&["x", "y", "flag"].map(String::from)[..], &["a", "b"].map(String::from)[..])
    );
    let expected = |x: f64, y: f64, flag: bool| {
        let (mut a, mut b, mut k) = (x, y, 0.5);
        if x > 0.0 && !flag || y == 1.0 {
            (a, b) = (b, a);
            if x >= 2.0 { k = 0.1 } else { a = -a }
        } else {
            b = b.abs().clamp(1.0, x.floor().max(3.0)) + 8.0;
        }
        vec![a * k, if b > 0.0 { b.sqrt() } else { b }]
    };
    for x in [-1.5, 0.0, 1.0, 2.0, 7.25] {
        for y in [-4.0, 0.5, 1.0, 9.0] {
            for flag in [false, true] {
                let ours = f.call_f64(&[x, y, f64::from(u8::from(flag))]);
                assert_eq!(ours, expected(x, y, flag), "f({x}, {y}, {flag})");
            }
        }
    }
}

#[test]
fn refusals_say_what_and_where() {
    let cases = [
        ("if (x > 0.0) { return 1.0; } return x;", "`return` inside an `if`"),
        ("var y = x; loop { y = y * x; if (y > 3.0) { break; } } return y;", "a loop"),
        ("var y = x; switch 1 { case 1: { y = 2.0; } default: {} } return y;", "`switch`"),
        ("return f32(i32(x));", "a conversion to another type"),
        ("return bitcast<f32>(bitcast<u32>(x));", "`bitcast`"),
        ("return vec2<f32>(x, x).x;", "a vector"),
        ("return tan(x);", "`tan`"),
        ("return mix(x, 1.0, x);", "`mix`"),
        ("return sign(x);", "`sign`"),
        ("return fma(x, x, x);", "`fma`"),
        ("return pow(x, 2.0);", "`pow`"),
        ("return exp(x);", "`exp`"),
        ("return log(x);", "`log`"),
        ("return x % 2.0;", "the operator `%`"),
        ("let a = array<f32, 2>(x, x); return a[1];", "an array"),
        ("return state;", "a variable of the module"),
    ];
    for (body, construct) in cases {
        let text = format!("// one\n// two\nvar<private> state: f32;\nfn f(x: f32) -> f32 {{\n    {body}\n}}\n");
        let source = Source::single("mine.wgsl", &text);
        let checked = check(&source).unwrap_or_else(|e| panic!("{body}: {e}"));
        let message = Function::compile(&source, &checked, "f").expect_err(body).to_string();
        assert!(message.starts_with("mine.wgsl:5:") && message.contains(construct), "{body}: {message}");
        assert!(message.ends_with(body), "{message}");
        // Replacements of those of WGSL.
        assert!(message.contains("power exponential logarithm, and min max clamp abs sqrt sin cos floor"), "{message}");
    }
    let source = Source::single("mine.wgsl", "fn g() -> f32 { return 1.0; }");
    let message = Function::compile(&source, &check(&source).unwrap(), "f").unwrap_err().to_string();
    assert_eq!(message, "function `f` is missing; the text has g");
}

/// The last bit of a quotient such as 0.28 s / 0.04 s must not put a delay beyond the memory.
#[test]
fn a_delay_may_equal_its_bound() {
    let variant = variant("idm+delay");
    let drive = cars::case(&cars::drive(60.0), variant, Convention::PAPER);
    let mut values = cars::spread(variant, Convention::PAPER, 1, 11, 0.0).values(0).to_vec();
    for hundredths in [1, 2, 4] {
        let dt = f64::from(hundredths) / 100.0;
        let bound = |steps: u32| f64::from(steps * hundredths) / 100.0;
        let above: Vec<u32> = (1..60).filter(|steps| (bound(*steps) / dt).ceil() > f64::from(*steps)).collect();
        assert!(!above.is_empty(), "no quotient by {dt} is rounded up");
        for steps in above.into_iter().take(3) {
            let case = Case { dt, tau_p_upper: bound(steps), ..drive.clone() };
            *values.last_mut().expect("tau_p is the last") = bound(steps);
            let mut population = Population::new(&variant.parameters());
            population.push(&values);
            let score = |evaluator: &mut dyn Evaluator| {
                let mut scores = [Score::Rejected];
                evaluator.evaluate(&population, &mut scores).expect("the delay is within bounds");
                let Score::Value(score) = scores[0] else { panic!("{steps} steps of {dt} s: {scores:?}") };
                score
            };
            let expected = score(&mut Reference::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA));
            for precision in PRECISIONS {
                let found = score(&mut lanes(&case, precision));
                let tolerance = if precision == LanesPrecision::F64 { 1e-9 } else { 1e-3 };
                let near = (found - expected).abs() <= tolerance * expected;
                assert!(near, "{steps} steps of {dt} s, {}: {found} not {expected}", precision.into_str());
            }
        }
    }
}

#[test]
fn instructions_and_block_size_are_kept_together() {
    let variant = variant("idm");
    let case = cars::case(&cars::drive(60.0), variant, Convention::PAPER);
    let population = cars::population(variant, Convention::PAPER, 1000, 3);
    let observers = vec![Observer::NONE; population.len()];
    let block = |lanes: Lanes| {
        let job = Job { case: 0, population: &population };
        let mut found = 0;
        lanes.residuals(&job, &observers, &mut |stretch| found = stretch.lanes).expect("there is no delay");
        found
    };
    let lanes = || lanes(&case, LanesPrecision::F64);
    // Blocks have 64 lanes or 16; the baseline has no large ones.
    assert_eq!(block(lanes().with_lanes(16).with_instructions(InstructionSet::best())), 16);
    assert_eq!(block(lanes().with_instructions(InstructionSet::Baseline).with_lanes(64)), 16);
}

#[test]
fn nothing_behind_a_return_is_computed() {
    for (body, expected) in [
        ("{ return x; } return 2.0 * x;", 3.0),
        ("var y = x; { y = 5.0; { return y; } y = 7.0; } return y;", 5.0),
        ("{ let y = 2.0 * x; } return x;", 3.0),
    ] {
        let source = Source::single("mine.wgsl", &format!("fn f(x: f32) -> f32 {{ {body} }}"));
        let checked = check(&source).unwrap_or_else(|e| panic!("{body}: {e}"));
        let f = Function::compile(&source, &checked, "f").unwrap_or_else(|e| panic!("{body}: {e}"));
        assert_eq!(f.call_f64(&[3.0]), [expected], "{body}");
    }
}
