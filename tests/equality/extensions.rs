//! Extensions: every built-in one alone and some together, on lanes and GPU, and a user's own. (tests/equality/causes.rs compares them with the
//! reference.)

use crate::common::extended::{BASES, bounds, case, spread, with};
use leadlag::internal::calibrate::{Overrides, SearchSpace};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{
    Case, CourseError, Evaluator, Job, Observed, Observer, Population, Raw, Residuals, Score,
};
use leadlag::internal::extension::Extension;
use leadlag::internal::gpu::{AdapterChoice, Gpu};
use leadlag::internal::lanes::{InstructionSet, Lanes, LanesPrecision};
use leadlag::internal::reference::{Reference, Trace, simulate};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::simulate::{Ahead, follow};
use leadlag::internal::synthetic::EffectKind;
use leadlag::internal::wgsl::{Precision, extension_named, laws, library, read_extension};
use strum::VariantArray;

fn lanes(case: &Case, precision: LanesPrecision) -> Lanes {
    Lanes::new(vec![case.clone()], GoodnessOfFit::default(), precision).expect("a valid text")
}

fn observers(count: usize) -> Vec<Observer> {
    let observer = |i: usize| {
        let share = i as f64 / count as f64;
        let gain = [0.2 * share, 0.02, -0.05, 0.1, -0.03 * share, 0.2];
        Observer { gain, whitening: [0.7, -0.3, 1.6 + share], decay: 0.95 - 0.1 * share }
    };
    (0..count).map(observer).collect()
}

#[test]
fn the_library_is_complete_and_documented() {
    let names: Vec<&str> = library().iter().map(|extension| extension.name.as_str()).collect();
    for kind in EffectKind::VARIANTS {
        let extension = extension_named(kind.into_str()).unwrap_or_else(|| panic!("{kind} is missing in {names:?}"));
        let own: Vec<(&str, &str)> = extension.parameters.iter().map(|p| (p.name(), p.unit())).collect();
        let planted: Vec<(&str, &str)> = kind.parameters().iter().map(|p| (p.name, p.unit)).collect();
        assert_eq!(own, planted, "{kind}");
        for (ours, theirs) in extension.parameters.iter().zip(kind.parameters()) {
            assert_eq!(bounds(*ours), [theirs.lower, theirs.upper], "{kind} {}", theirs.name);
        }
        let cause = extension.cause.as_ref().unwrap_or_else(|| panic!("{kind} is a cause"));
        assert!(!cause.looks_like.is_empty() && !extension.meaning.is_empty(), "{kind}");
    }
    let causes = library().iter().filter(|extension| extension.cause.is_some()).count();
    assert_eq!(causes, EffectKind::VARIANTS.len(), "every cause can be planted");
}

/// Largest difference of a score that a neutral extension may make, relative: one more rounding per step.
const NEUTRAL: f64 = 1e-9;

#[test]
fn neutral_values_change_nothing_and_others_do() {
    let mut acted = std::collections::BTreeMap::new();
    for base in BASES {
        let plain = case(base.parse().expect("a variant"));
        for extension in library() {
            let variant = with(base, &[extension]);
            let case = case(variant);
            let spread = spread(variant, 12);
            let width = plain.variant.parameters().len();
            let mut neutral = Population::new(&variant.parameters());
            let mut bare = Population::new(&plain.variant.parameters());
            for i in 0..spread.len() {
                let mut values = spread.values(i).to_vec();
                bare.push(&values[..width]);
                for (value, symbol) in values[width..].iter_mut().zip(&variant.parameters()[width..]) {
                    *value = symbol.neutral().unwrap_or(*value);
                }
                neutral.push(&values);
            }
            // Another delay bound is another window, so both start at the longer one.
            let mut bare_lanes =
                lanes(&Case { tau_p_upper: case.longest_delay(), ..plain.clone() }, LanesPrecision::F64);
            if case.longest_delay() > plain.longest_delay() && !plain.variant.delay {
                continue;
            }
            let mut extended = lanes(&case, LanesPrecision::F64);
            let raw = |lanes: &mut Lanes, population| lanes.raw(&[Job { case: 0, population }]).expect("short delays");
            let (a, b, c) = (raw(&mut bare_lanes, &bare), raw(&mut extended, &neutral), raw(&mut extended, &spread));
            for (i, (a, b)) in a.iter().zip(&b).enumerate() {
                // Caps at their neutral value still act beyond it.
                let acts = ["accel_cap", "decel_cap", "power_cap", "jerk_limit"].contains(&extension.name.as_str());
                if acts || a.status != 0 {
                    continue;
                }
                assert_eq!(a.status, b.status, "{base} + {}, candidate {i}", extension.name);
                let near = |x: f64, y: f64| (x - y).abs() <= NEUTRAL * x.abs().max(1e-9);
                let close = (0..3).all(|k| near(a.error2[k], b.error2[k]));
                assert!(close, "{base} + {}, candidate {i}: {:?} not {:?}", extension.name, b.error2, a.error2);
            }
            *acted.entry(&extension.name).or_insert(0) += usize::from(b != c);
        }
    }
    // A limit may be beyond the commands of a base model on this drive; a delay is compared where the base has one.
    let idle: Vec<_> =
        library().iter().map(|e| &e.name).filter(|name| acted.get(name).is_none_or(|n| *n == 0)).collect();
    assert!(idle.is_empty(), "extensions that change nothing on any base: {idle:?}");
}

/// A user's own limit of the command, with a round corner.
const SMOOTH: &str = "struct Parameters {
    /// limit [m/s2], 0.5 to 4, neutral 4
    top: f32,
}
fn smooth_command(own: Parameters, a_cmd: f32) -> f32 {
    return opaque(own.top - opaque(0.2 * logarithm(1.0 + exponential((own.top - a_cmd) * 5.0))));
}
";

fn bits(raw: &[Raw]) -> Vec<String> {
    // NaN is not equal to itself; its text is.
    raw.iter().map(|raw| format!("{raw:?}")).collect()
}

fn block_bits(observed: &[Observed]) -> Vec<String> {
    observed.iter().map(|observed| format!("{observed:?}")).collect()
}

fn gpu(case: &Case, precision: Precision) -> Option<Gpu> {
    match Gpu::new(vec![case.clone()], GoodnessOfFit::default(), precision, &AdapterChoice::default()) {
        Ok(gpu) => Some(gpu),
        Err(_) if std::env::var_os("LEADLAG_NO_GPU").is_some() => {
            eprintln!("SKIPPED lanes_and_gpu_give_the_same_bits: LEADLAG_NO_GPU says there is none");
            None
        }
        Err(error) => panic!("{error}"),
    }
}

#[test]
fn lanes_and_gpu_give_the_same_bits() {
    let all: Vec<&'static Extension> = library().to_vec();
    let mut combinations: Vec<Variant> =
        all.iter().enumerate().map(|(k, extension)| with(BASES[k % BASES.len()], &[extension])).collect();
    let pick = |names: &[&str]| -> Vec<&'static Extension> {
        names.iter().map(|name| extension_named(name).expect("built in")).collect()
    };
    combinations.push(with("l-cth", &pick(&["perception_delay", "time_offset", "grade", "lead"])));
    combinations
        .push(with("idm", &pick(&["sensor_lowpass", "integral_action", "actuation_lag", "multi_anticipation"])));
    combinations.push(with("gipps+delay", &pick(&["dead_zone", "leader_accel_ff", "jerk_limit", "probe_road"])));
    combinations.push(with("l-idm+linear+constant", &pick(&["asym_lag", "aero_drag", "periodic"])));
    for (k, law) in laws().iter().enumerate() {
        let parts = ["", "+delay", "+linear+constant"][k % 3];
        combinations
            .push(with(&format!("{}{parts}", law.name), &pick(&[["grade"], ["dead_zone"], ["range_bias"]][k % 3])));
        combinations.push(law.name.parse().expect("a law"));
    }
    let smooth = read_extension("smooth.wgsl", SMOOTH).expect("a valid extension");
    combinations.push("idm".parse::<Variant>().expect("a variant").with(smooth).expect("no conflict"));
    let (mut exact, mut differences) = (0, Vec::new());
    for (k, variant) in combinations.into_iter().enumerate() {
        let case = case(variant);
        let population = spread(variant, 40);
        let job = Job { case: 0, population: &population };
        let compensated = k % 3 == 0;
        let (on_gpu, on_lanes) = match compensated {
            true => (Precision::Compensated, LanesPrecision::Compensated),
            false => (Precision::Plain, LanesPrecision::Plain),
        };
        let on_precision = on_lanes;
        let Some(mut gpu) = gpu(&case, on_gpu) else { return };
        let mut lanes = lanes(&case, on_lanes);
        let (a, b) = (gpu.raw(&[job]).expect("a device"), lanes.raw(&[job]).expect("short delays"));
        assert!(b.iter().any(|raw| raw.status == 0), "{variant}: some candidate runs to the end");
        let observers = observers(population.len());
        let c = gpu.observed(&job, &observers, 100).expect("a device");
        let d = lanes.observed(&job, &observers, 100).expect("short delays");
        if gpu.adapter().is_some_and(|name| name.contains("llvmpipe")) {
            exact += 1;
            let mut compare = |what: &str, on_gpu: Vec<String>, on_lanes: Vec<String>| {
                let differing: Vec<usize> = (0..on_gpu.len()).filter(|i| on_gpu[*i] != on_lanes[*i]).collect();
                if let Some(&i) = differing.first() {
                    differences.push(format!(
                        "{variant} {what}, {on_precision:?}: {} of {}, the first candidate {i} {:?}\n  GPU   {}\n  lanes {}",
                        differing.len(),
                        on_gpu.len(),
                        population.values(i),
                        on_gpu[i],
                        on_lanes[i]
                    ));
                }
            };
            compare("free", bits(&a), bits(&b));
            compare("observed", block_bits(&c), block_bits(&d));
        } else {
            let alike = a.iter().zip(&b).filter(|(a, b)| a.status == b.status).count();
            assert!(alike * 10 >= 9 * a.len(), "{variant}: {alike} of {} runs end alike", a.len());
        }
    }
    eprintln!("{exact} models with extensions compared bit by bit");
    assert!(differences.is_empty(), "{} differences:\n{}", differences.len(), differences.join("\n"));
}

/// Names that would clash with the time loop if they were shared: all of them in one text, on the device.
#[test]
fn an_extension_may_use_the_names_of_the_kernel_on_the_gpu() {
    let text = "const main = 0.5;\nconst sample = 1.0;\nconst RING = 2.0;\nalias Real = f32;\nalias Job = bool;\nstruct Memory {\n    opaque_zero: f32,\n}\n\
                struct Parameters {\n    /// share [-], 0 to 1, neutral 0\n    observer_decay: f32,\n}\n\
                struct State {\n    /// starts at v_f\n    states: f32,\n}\nstruct Step {\n    a: f32,\n    state: State,\n}\n\
                fn step(candidate: Real) -> Real {\n    return candidate * main * sample * RING;\n}\n\
                fn power(score: Memory) -> f32 {\n    return score.opaque_zero;\n}\n\
                fn d_command(own: Parameters, state: State, a: f32) -> Step {\n    let even: Job = a > state.states;\n    \
                return Step(select(step(a), power(Memory(a)), even) * (1.0 - own.observer_decay), State(state.states + a));\n}\n";
    let own = read_extension("d.wgsl", text).expect("valid");
    for base in BASES {
        let variant = with(base, &[own]);
        let case = case(variant);
        let mut cpu = lanes(&case, LanesPrecision::Plain);
        let Some(mut gpu) = gpu(&case, Precision::Plain) else { return };
        let population = spread(variant, 40);
        let job = Job { case: 0, population: &population };
        assert_eq!(bits(&gpu.raw(&[job]).expect("it runs")), bits(&cpu.raw(&[job]).expect("it runs")), "{base}");
        let observers = observers(40);
        let job = Job { case: 0, population: &population };
        let ours = block_bits(&cpu.observed(&job, &observers, 100).expect("it runs"));
        assert_eq!(block_bits(&gpu.observed(&job, &observers, 100).expect("it runs")), ours, "{base}, observed");
    }
}

#[test]
fn every_instruction_set_gives_the_same_innovations() {
    let variant = with(
        "l-cth",
        &[extension_named("time_offset").expect("built in"), extension_named("grade").expect("built in")],
    );
    let case = case(variant);
    let population = spread(variant, 37);
    let job = Job { case: 0, population: &population };
    let observers = observers(population.len());
    let text = |set| {
        let lanes = lanes(&case, LanesPrecision::F64).with_instructions(set);
        format!("{:?}", lanes.innovations(&job, &observers).expect("short delays"))
    };
    let first = text(InstructionSet::Baseline);
    for set in InstructionSet::available() {
        assert!(text(set) == first, "{set:?}");
    }
}

#[test]
fn innovations_agree_with_the_sums() {
    let variant = with("idm", &[extension_named("actuation_lag").expect("built in")]);
    let case = case(variant);
    // More than one block of lanes, the last of which is not full.
    let population = spread(variant, 37);
    let job = Job { case: 0, population: &population };
    let observers = observers(population.len());
    let lanes = lanes(&case, LanesPrecision::F64);
    let sums = lanes.observed(&job, &observers, 1_000_000).expect("short delays");
    let series = lanes.innovations(&job, &observers).expect("short delays");
    let mut stretches = Vec::new();
    let mut residuals = vec![Vec::new(); population.len()];
    let each = &mut |stretch: &Residuals| {
        stretches.push(stretch.from..stretch.from + stretch.samples);
        residuals.iter_mut().enumerate().for_each(|(i, run)| run.extend(stretch.of(i)));
    };
    let failed = lanes.residuals(&job, &observers, each).expect("short delays");
    assert!(stretches.len() > 2 && stretches.windows(2).all(|w| w[0].end == w[1].start), "{stretches:?}");
    assert_eq!([stretches[0].start, stretches[stretches.len() - 1].end], [0, case.s.len()]);
    for ((series, residuals), failed) in series.iter().zip(residuals).zip(failed) {
        assert_eq!(failed, series.failed);
        assert!(failed.is_some() || residuals == series.residual);
    }
    for ((sums, series), observer) in sums.iter().zip(&series).zip(&observers) {
        assert_eq!(sums.raw.failure(), series.failed);
        if series.failed.is_some() {
            continue;
        }
        let [a, b, c] = observer.whitening;
        let z = |[r_s, r_v]: [f64; 2]| [a * r_s, b * r_s + c * r_v];
        for k in 0..2 {
            let total: f64 = series.residual.iter().map(|r| z(*r)[k].powi(2)).sum();
            assert!((total - sums.blocks[0][k]).abs() <= 1e-9 * total, "{total} not {}", sums.blocks[0][k]);
        }
        // d follows from the residuals alone.
        let mut d = 0.0;
        for (t, [r_s, r_v]) in series.residual.iter().enumerate().skip(series.first) {
            d = d * observer.decay - (observer.gain[4] * r_s + observer.gain[5] * r_v);
            assert!((d - series.state[t][2]).abs() <= 1e-9, "sample {t}: {d} not {}", series.state[t][2]);
        }
    }
}

#[test]
fn a_users_own_extension_runs() {
    let text = "//! Sluggish when it is cold.
struct Parameters {
    /// share that is lost [-], 0 to 1, neutral 0
    lost: f32,
}
struct State {
    /// last command [m/s2], starts at a_f
    last: f32,
}
struct Done {
    a: f32,
    state: State,
}
const HALF: f32 = 0.5;
fn mean(a: f32, b: f32) -> f32 {
    return HALF * (a + b);
}
fn cold_command(own: Parameters, state: State, a_cmd: f32) -> Done {
    let a = (1.0 - own.lost) * mean(a_cmd, state.last);
    return Done(a, State(a_cmd));
}
";
    let cold = read_extension("somewhere/cold.wgsl", text).expect("valid");
    assert!(std::ptr::eq(cold, read_extension("somewhere/cold.wgsl", text).expect("valid")), "read once");
    let lag = extension_named("actuation_lag").expect("built in");
    for base in BASES {
        // Names of its own are also those of the built-in one.
        let case = case(with(base, &[lag, cold]));
        let population = spread(case.variant, 4);
        let raw = lanes(&case, LanesPrecision::F64).raw(&[Job { case: 0, population: &population }]);
        assert!(raw.expect("short delays").iter().any(|raw| raw.status == 0), "{base}");
    }
}

/// A copy of the world has the same known members.
#[test]
fn members_of_a_copied_world_are_read() {
    let text = |name: &str, body: &str| {
        format!(
            "//! loop: look back by ago
struct Parameters {{
    /// how long ago [s], 0 to 1, neutral 0
    ago: f32,
}}
fn {name}_command(w: World, a_cmd: f32) -> f32 {{
    {body}
}}
"
        )
    };
    for member in ["t", "dt", "x_f", "sin_grade", "s", "v_f", "a_f", "a_l", "v_l2", "s_l2", "v_l_then", "v_l_half"] {
        let raw = |name: &str, body: String| {
            let extension = read_extension(&format!("{name}.wgsl"), &text(name, &body)).expect("valid");
            assert!(extension.reads(member), "{body}");
            let case = case(with("l-cth", &[extension]));
            let population = spread(case.variant, 4);
            bits(&lanes(&case, LanesPrecision::F64).raw(&[Job { case: 0, population: &population }]).expect("no delay"))
        };
        let direct = raw("direct", format!("return a_cmd + 0.0001 * w.{member};"));
        let copied = raw("copied", format!("var here = w; return a_cmd + 0.0001 * here.{member};"));
        assert_eq!(copied, direct, "{member}");
    }
}

/// Candidates whose last parameter has this value.
fn ending_in(variant: Variant, count: usize, last: f64) -> Population {
    let (all, mut changed) = (spread(variant, count), Population::new(&variant.parameters()));
    for i in 0..count {
        let mut values = all.values(i).to_vec();
        *values.last_mut().expect("a parameter") = last;
        changed.push(&values);
    }
    changed
}

#[test]
fn bounds_of_a_delay_are_those_of_the_search() {
    let delay = extension_named("perception_delay").expect("built in");
    let variant = with("l-cth", &[delay]);
    let space = |tp: [f64; 2]| {
        let overrides = Overrides::from([("tp".to_owned(), tp)]);
        SearchSpace::new(&variant, None, Convention::PAPER, &overrides)
    };
    let own = case(variant);
    for (upper, first) in [(1.6, 17), (0.4, 5)] {
        let bound = space([0.0, upper]).expect("bounds").extension_delay_upper();
        assert_eq!(bound, Some(upper));
        let case = own.clone().with_extension_delay(bound).expect("long enough");
        let population = ending_in(variant, 12, upper);
        let parameters = population.parameters(0);
        assert_eq!((case.check(&parameters), case.pace(&parameters).first), (Ok(()), first));
        let (mut expected, mut found) = ([Score::Rejected; 12], [Score::Rejected; 12]);
        let mut reference = Reference::new(vec![case.clone()], GoodnessOfFit::default());
        reference.evaluate(&population, &mut expected).expect("it runs");
        lanes(&case, LanesPrecision::F64).evaluate(&population, &mut found).expect("within bounds");
        for (a, b) in found.iter().zip(&expected) {
            match (a, b) {
                (Score::Value(a), Score::Value(b)) => assert!((a - b).abs() <= 1e-9 * b, "tp = {upper}: {a} not {b}"),
                (a, b) => assert_eq!(a, b, "tp = {upper}"),
            }
        }
        assert!(expected.iter().any(|score| matches!(score, Score::Value(_))), "tp = {upper}: some run ends");
    }
    // The message about a long delay names its parameter.
    let at = |variant: Variant, tp: f64| {
        let case = case(variant);
        let population = ending_in(variant, 1, tp);
        let refused = case.check(&population.parameters(0)).expect_err("too long").to_string();
        let error = lanes(&case, LanesPrecision::F64).raw(&[Job { case: 0, population: &population }]);
        (refused, error.map(|_| ()).map_err(|error| error.to_string()))
    };
    let (refused, error) = at(variant, 4.0);
    assert!(refused.starts_with("tp: expected at most 3 s, found 4; the upper bound of tp limits"), "{refused}");
    assert_eq!(error, Err(refused));
    let (refused, _) = at(with("l-gipps+delay", &[delay]), 4.0);
    assert!(refused.starts_with("tau_p + tp: expected at most 3.8 s, found 4."), "{refused}");
    // A delay cannot be negative.
    let (refused, _) = at(variant, -0.2);
    assert_eq!(refused, "tp: expected a number of at least 0 and below 1e9, found -0.2");
    assert!(space([-0.2, -0.2]).is_err());
    let negative = own.clone().with_extension_delay(Some(-0.2)).expect_err("no bound").to_string();
    assert!(negative.ends_with("upper bound of tp: expected a number of at least 0, found -0.2"), "{negative}");
}

/// Seconds since 1970 are further apart in f32 than the samples.
#[test]
fn a_clock_that_single_precision_cannot_tell_is_refused_where_it_is_read() {
    let late = |names: &[&str]| {
        let extensions: Vec<_> = names.iter().map(|name| extension_named(name).expect("built in")).collect();
        Case { t_0: 1.1e9, ..case(with("idm", &extensions)) }
    };
    let new = |case: &Case, precision| Lanes::new(vec![case.clone()], GoodnessOfFit::NRMSE_SVA, precision);
    for name in ["headway_mode_change", "set_speed_change", "periodic"] {
        let case = late(&[name]);
        assert!(matches!(case.check_clock(), Err(CourseError::Clock { .. })), "{name}");
        for precision in [LanesPrecision::Plain, LanesPrecision::Compensated] {
            let message = new(&case, precision).map(|_| ()).expect_err(name).to_string();
            assert!(message.contains("count the time from the beginning of the recording"), "{message}");
        }
        assert!(new(&case, LanesPrecision::F64).is_ok(), "{name}");
        assert_eq!(Case { t_0: 86_400.0, ..case }.check_clock(), Ok(()), "{name}: seconds of a day");
    }
    for names in [&["actuation_lag"][..], &[]] {
        assert!(new(&late(names), LanesPrecision::Plain).is_ok(), "{names:?}");
    }
}

/// The third car sees two simulated ones, the second one simulated and one measured.
#[test]
fn cars_further_ahead_are_simulated_ones_in_a_platoon() {
    let multi = with("idm", &[extension_named("multi_anticipation").expect("built in")]);
    let (measured, extended) = (case(with("idm", &[])), case(multi));
    let t: Vec<f64> = (0..measured.s.len()).map(|i| measured.t_0 + i as f64 * measured.dt).collect();
    let run = |case: &Case| {
        let (mut trace, candidates) = (Trace::default(), spread(case.variant, 12));
        let ends = |i: &usize| simulate(case, &candidates.parameters(*i), &mut trace).failure.is_none();
        (0..candidates.len()).find(ends).expect("some candidate comes to its end");
        trace
    };
    let first = run(&measured);
    let second_case = follow(&extended, &t, Ahead { case: &measured, t: &t, trace: &first }).expect("one time axis");
    assert_eq!(second_case.v_l[..], first.v);
    assert_eq!(second_case.v_l2.as_deref(), Some(&measured.v_l[..]));
    assert_eq!(second_case.s_l2.as_deref(), Some(&first.s[..]));
    let second = run(&second_case);
    let third = follow(&extended, &t, Ahead { case: &second_case, t: &t, trace: &second }).expect("one time axis");
    assert_eq!(third.v_l[..], second.v);
    assert_eq!(third.v_l2.as_deref(), Some(&first.v[..]));
    assert_eq!(third.s_l2.as_deref(), Some(&second.s[..]));
}
