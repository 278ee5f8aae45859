//! The ninety variants against Table 1, their bounds against Table 3, and the parameters they really read.

use crate::common;
use crate::common::made_up::{self, Way};
use leadlag::internal::catalog::{Constraint, Controller, Dynamics, Spacing, Variant};
use leadlag::internal::convention::{Convention, Radicand};
use leadlag::internal::evaluator::Case;
use leadlag::internal::reference::{Trace, simulate};
use leadlag::internal::symbols::{Bounds, Parameters, Symbol};
use leadlag::internal::trajectory::{Grade, Trajectory};
use leadlag::internal::vehicle::{Mfc, Vehicle};
use leadlag::internal::wgsl::{Precision, Recipe, Source as Shader, check, laws};
use std::path::Path;

/// Table 1: per base model its name here, controller, spacing policy, first id and calibration parameters.
const BASES: [(&str, &str, &str, u32, &str); 5] = [
    ("idm", "idm", "idm_desired", 1, "delta v_0 d_0 t_h a_max a_min"),
    ("gipps", "gipps", "inherent", 19, "theta v_0 d_0 t_h a_max a_min a_hat_min"),
    ("l-cth", "linear", "cth", 37, "k_s k_v k_0 v_0 d_0 t_h"),
    ("l-idm", "linear", "idm_desired", 55, "k_s k_v k_0 v_0 d_0 t_h a_max a_min"),
    ("l-gipps", "linear", "gipps_equilibrium", 73, "k_s k_v k_0 v_0 d_0 t_h theta a_min a_hat_min"),
];

/// Table 1: the 18 variants of a base, offset from its first id: delay, dynamics, constraint, further parameters.
const EXTENSIONS: [(bool, &str, &str, &str); 18] = [
    (false, "none", "none", ""),
    (false, "none", "constant", ""),
    (false, "none", "mfc", ""),
    (false, "linear", "none", "tau_a"),
    (false, "linear", "constant", "tau_a"),
    (false, "linear", "mfc", "tau_a"),
    (false, "nonlinear", "none", "tau_a m_load f_0 f_1 f_2"),
    (false, "nonlinear", "constant", "tau_a m_load f_0 f_1 f_2"),
    (false, "nonlinear", "mfc", "tau_a m_load f_0 f_1 f_2"),
    (true, "none", "none", "tau_p"),
    (true, "none", "constant", "tau_p"),
    (true, "none", "mfc", "tau_p"),
    (true, "linear", "none", "tau_p tau_a"),
    (true, "linear", "constant", "tau_p tau_a"),
    (true, "linear", "mfc", "tau_p tau_a"),
    (true, "nonlinear", "none", "tau_p tau_a m_load f_0 f_1 f_2"),
    (true, "nonlinear", "constant", "tau_p tau_a m_load f_0 f_1 f_2"),
    (true, "nonlinear", "mfc", "tau_p tau_a m_load f_0 f_1 f_2"),
];

fn sorted(mut names: Vec<&str>) -> Vec<&str> {
    names.sort_unstable();
    names
}

fn names(variant: &Variant) -> Vec<&'static str> {
    sorted(variant.parameters().into_iter().map(Symbol::name).collect())
}

#[test]
fn ids_parts_and_parameters_equal_table_1() {
    let mut ids = Vec::new();
    for (base, controller, spacing, first, of_base) in BASES {
        for (k, (delay, dynamics, constraint, further)) in EXTENSIONS.into_iter().enumerate() {
            let id = first + k as u32;
            let variant = Variant::from_id(id).expect("ids of Table 1");
            let parts = (variant.base.name, variant.base.controller.name(), variant.base.spacing.name());
            assert_eq!(parts, (base, controller, spacing), "base of variant {id}");
            let extensions = (variant.delay, variant.dynamics.name(), variant.constraint.name());
            assert_eq!(extensions, (delay, dynamics, constraint), "extensions of variant {id}");
            let expected = of_base.split_whitespace().chain(further.split_whitespace()).collect();
            assert_eq!(names(&variant), sorted(expected), "parameters of variant {id} {variant}");
            assert_eq!(variant.id(), id);
            ids.push(id);
        }
    }
    assert_eq!(ids, (1..=90).collect::<Vec<_>>());
    // A further base model comes after Table 1 and gets the ids from 91 on.
    assert!(Variant::COUNT >= 90 && Variant::all().count() == Variant::COUNT as usize);
    assert!(Variant::from_id(0).is_err() && Variant::from_id(Variant::COUNT + 1).is_err());
}

#[test]
fn ids_and_parameters_equal_the_authors_list() {
    let Some(shared) = common::shared("ids_and_parameters_equal_the_authors_list") else { return };
    let path = shared.join("golden/inputs/models.csv");
    #[derive(serde::Deserialize)]
    struct Row {
        model_id: u32,
        base: String,
        delay: String,
        dynamics: String,
        constraint: String,
        n_params: usize,
        params: String,
    }
    let mut reader = csv::Reader::from_path(&path).expect("models.csv opens");
    let mut ids = Vec::new();
    for row in reader.deserialize() {
        let row: Row = row.expect("models.csv has the columns of its README");
        let variant = Variant::from_id(row.model_id).expect("ids of Table 1");
        let found = (variant.base.paper, variant.delay, variant.dynamics.name(), variant.constraint.name());
        let delay = row.delay == "constant";
        assert_eq!(found, (&*row.base, delay, &*row.dynamics, &*row.constraint), "variant {}", row.model_id);
        assert_eq!(names(&variant), sorted(row.params.split_whitespace().collect()), "variant {}", row.model_id);
        assert_eq!(variant.parameters().len(), row.n_params, "variant {}", row.model_id);
        ids.push(row.model_id);
    }
    assert_eq!(ids, (1..=90).collect::<Vec<_>>());
}

#[test]
fn names_and_ids_are_read_back() {
    let mut seen = std::collections::BTreeSet::new();
    for variant in Variant::all() {
        let name = variant.name();
        assert_eq!(name.parse(), Ok(variant));
        assert_eq!(name.to_uppercase().parse(), Ok(variant));
        assert_eq!(variant.id().to_string().parse(), Ok(variant));
        let mut words: Vec<&str> = name.split('+').collect();
        words[1..].reverse();
        assert_eq!(words.join("+").parse(), Ok(variant), "the order of extensions does not matter");
        assert!(seen.insert(name), "every name once");
    }
    assert_eq!("gipps+delay+linear+mfc".parse::<Variant>().map(|v| v.id()), Ok(33));
    let said = |name: &str| name.parse::<Variant>().expect_err("no variant").to_string();
    for part in ["linear", "nonlinear", "delay", "mfc+delay"] {
        let said = said(part);
        assert!(said.contains("the base model before it is missing") && !said.contains("did you mean"), "{said}");
    }
    assert!(said("cth").ends_with("did you mean `l-cth`?"), "{}", said("cth"));
    assert!(said("idm+dely").ends_with("did you mean `delay`?"), "{}", said("idm+dely"));
    // Two base models are invalid, in any order.
    assert!(!said("gipps+cth").contains("did you mean") && !said("l-cth+idm").contains("did you mean"));
    for name in
        ["", "idm+", "idm+delay+delay", "idm+linear+nonlinear", "idm+mfc+constant", "delay", "idm linear", "0", "1000"]
    {
        assert!(name.parse::<Variant>().is_err(), "{name:?}");
    }
}

#[test]
fn bounds_equal_table_3() {
    let table = [
        ("delta", 0.1, 10.0),
        ("v_0", 30.0, 35.0),
        ("d_0", 1.0, 5.0),
        ("t_h", 0.1, 3.0),
        ("a_max", 0.5, 5.0),
        ("a_min", -5.0, -0.5),
        ("a_hat_min", -5.0, -0.5),
        ("theta", 0.0, 3.0),
        ("tau_a", 0.3, 0.8),
        ("tau_p", 0.1, 0.8),
        ("m_load", 230.0, 300.0),
        ("k_s", 0.01, 5.0),
        ("k_v", 0.01, 5.0),
        ("k_0", 0.01, 5.0),
    ];
    for symbol in Symbol::ALL {
        let expected = match table.iter().find(|(name, ..)| *name == symbol.name()) {
            Some((_, lower, upper)) => Bounds::Fixed(*lower, *upper),
            None => Bounds::PerVehicle,
        };
        assert_eq!(symbol.bounds(), expected, "{}", symbol.name());
        assert_eq!(Symbol::from_name(symbol.name()), Some(*symbol));
        if let Bounds::Fixed(lower, upper) = expected {
            assert!(symbol.domain().contains(lower) && symbol.domain().contains(upper), "{}", symbol.name());
        }
    }
    let loads: Vec<_> = Symbol::ALL.iter().filter(|s| s.bounds() == Bounds::PerVehicle).map(|s| s.name()).collect();
    assert_eq!(loads, ["f_0", "f_1", "f_2"]);
    assert_eq!(Symbol::ALL.len(), table.len() + loads.len());
}

/// Approaching, following, opening, cruising near v_0, on a hilly road: both branches of every equation decide somewhere.
fn drive() -> Trajectory {
    let samples = 1200;
    let dt = 0.1;
    let t: Vec<f64> = (0..samples).map(|i| i as f64 * dt).collect();
    let v_l: Vec<f64> = t.iter().map(|t| if *t < 40.0 { 18.0 + 4.0 * (t / 3.0).sin() } else { 34.0 }).collect();
    let v_f: Vec<f64> = v_l.iter().map(|v| v + 0.5).collect();
    let integrate = |x_0, v: &[f64]| leadlag::internal::trajectory::integrate(x_0, v, dt);
    let (x_l, x_f) = (integrate(65.0, &v_l), integrate(0.0, &v_f));
    let grade = Grade { x: vec![0.0, 250.0, 500.0], sin: vec![0.0, 0.03, -0.02], period: Some(700.0), source: None };
    Trajectory {
        grade: Some(grade),
        ..made_up::trajectory("drive", dt, Way { x: x_l, v: v_l }, Way { x: x_f, v: v_f })
    }
}

fn declared(variant: &Variant) -> Parameters {
    let values = [
        (Symbol::delta, 4.0),
        (Symbol::k_s, 0.2),
        (Symbol::k_v, 0.6),
        (Symbol::k_0, 0.3),
        (Symbol::theta, 0.4),
        (Symbol::v_0, 31.0),
        (Symbol::d_0, 2.5),
        (Symbol::t_h, 1.1),
        (Symbol::a_max, 1.5),
        (Symbol::a_min, -2.0),
        (Symbol::a_hat_min, -2.5),
        (Symbol::tau_p, 0.25),
        (Symbol::tau_a, 0.35),
        (Symbol::m_load, 250.0),
        (Symbol::f_0, 180.0),
        (Symbol::f_1, 1.5),
        (Symbol::f_2, 0.4),
    ];
    let mut parameters = Parameters::NONE;
    for (symbol, value) in values {
        if variant.parameters().contains(&symbol) {
            parameters.set(symbol, value);
        }
    }
    parameters
}

#[test]
fn every_declared_parameter_is_read_and_no_other() {
    let data = drive();
    let vehicle = Vehicle {
        mfc: Some(Mfc {
            v: vec![0.0, 20.0, 50.0],
            a_ap: vec![4.0, 3.0, 1.0],
            a_dp: vec![-6.0, -7.0, -8.0],
            source: None,
        }),
        ..Vehicle::called("BMW").expect("built in")
    };
    for convention in [Convention::PAPER, Convention::AUTHORS] {
        for variant in Variant::all() {
            let given = if variant.needs_vehicle() { Some(&vehicle) } else { None };
            let case = Case::new(&data, variant, given, convention, 0.8).expect("the drive has what a variant needs");
            let p = declared(&variant);
            let (mut base, mut changed) = (Trace::default(), Trace::default());
            // Undeclared parameters are NaN, so that reading one would be visible.
            assert_eq!(case.check(&p), Ok(()), "{variant}, {convention}");
            let run = simulate(&case, &p, &mut base);
            assert_eq!(run.failure, None, "{variant}, {convention}: declared parameters suffice");
            assert_eq!(base.s.len(), data.len());
            let all = base.x.iter().chain(&base.v).chain(&base.a).chain(&base.s);
            assert!(all.into_iter().all(|x| x.is_finite()), "{variant}, {convention}: finite throughout");
            for symbol in variant.parameters() {
                // NaN: min and max drop it, so that the run may change instead of failing. A value that is larger by half: the parameter
                // itself has an effect, not only its validity.
                for value in [f64::NAN, p.get(symbol) * 1.5] {
                    let mut other = p;
                    other.set(symbol, value);
                    assert_eq!(
                        case.check(&other).is_err(),
                        value.is_nan(),
                        "{variant}, {convention}: {}",
                        symbol.name()
                    );
                    if value.is_nan() && symbol == Symbol::tau_p {
                        continue; // refused by the check above; the loop may count on a delay that is a number
                    }
                    let other_run = simulate(&case, &other, &mut changed);
                    assert!(
                        other_run.failure.is_some() || changed != base,
                        "{variant}, {convention}: {} = {value} {} instead of {} changes nothing",
                        symbol.name(),
                        symbol.unit(),
                        p.get(symbol)
                    );
                }
            }
        }
    }
}

#[test]
fn only_variants_that_need_it_ask_for_vehicle_and_road() {
    for variant in Variant::all() {
        let nonlinear = variant.dynamics == Dynamics::Nonlinear;
        assert_eq!(variant.needs_grade(), nonlinear, "{variant}");
        assert_eq!(variant.needs_vehicle(), nonlinear || variant.constraint == Constraint::Mfc, "{variant}");
    }
}

/// One row of the part table: folder, file name, parameters, a variant that has it.
struct Part {
    folder: &'static str,
    name: &'static str,
    parameters: &'static [Symbol],
    variant: Variant,
}

fn parts() -> Vec<Part> {
    let law = || laws().iter().map(|law| Variant::of_law(law));
    let with = |is: &dyn Fn(&Variant) -> bool| {
        Variant::all().chain(law()).find(|v| is(v)).expect("every part is in some variant")
    };
    let part = |folder, name, parameters, variant| Part { folder, name, parameters, variant };
    let controllers = Controller::ALL
        .iter()
        .map(|p| part("controller", p.name(), p.parameters(), with(&|v| v.base.controller == *p)));
    let spacings =
        Spacing::ALL.iter().map(|p| part("spacing", p.name(), p.parameters(), with(&|v| v.base.spacing == *p)));
    let dynamics =
        Dynamics::ALL.iter().map(|p| part("dynamics", p.name(), p.parameters(), with(&|v| v.dynamics == *p)));
    let constraints =
        Constraint::ALL.iter().map(|p| part("constraint", p.name(), p.parameters(), with(&|v| v.constraint == *p)));
    controllers.chain(spacings).chain(dynamics).chain(constraints).collect()
}

/// The function that all files of a folder define.
const FUNCTIONS: [(&str, &str); 4] = [
    ("spacing", "desired_spacing"),
    ("controller", "commanded_acceleration"),
    ("dynamics", "vehicle_response"),
    ("constraint", "constrained_acceleration"),
];

#[test]
fn every_part_has_a_shader_and_a_reference_and_no_file_is_without_a_row() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    for (folder, function) in FUNCTIONS {
        let rows: Vec<String> = parts().iter().filter(|p| p.folder == folder).map(|p| p.name.to_owned()).collect();
        for (place, extension, opening) in [
            ("shaders", "wgsl", format!("fn {function}(")),
            ("src/models/reference", "rs", format!("pub fn {function}(")),
        ] {
            let folder = root.join(place).join(folder);
            let mut files: Vec<String> = std::fs::read_dir(&folder)
                .expect("the folder of the parts is readable")
                .filter_map(|e| {
                    let name = e.expect("readable").file_name().to_string_lossy().into_owned();
                    name.strip_suffix(&format!(".{extension}")).map(str::to_owned)
                })
                .filter(|name| name != "mod")
                .collect();
            files.sort();
            let mut expected = rows.clone();
            expected.sort();
            assert_eq!(files, expected, "files in {} against rows in src/models/catalog.rs", folder.display());
            for name in &files {
                let path = folder.join(format!("{name}.{extension}"));
                let text = std::fs::read_to_string(&path).expect("a part is readable");
                let found = text.lines().filter(|line| line.starts_with(&opening)).count();
                assert_eq!(found, 1, "{} defines {function} once", path.display());
            }
        }
    }
}

/// The fields of `Params` that a function reads, by name.
fn params_read(module: &naga::Module, function: &naga::Function) -> Vec<String> {
    let mut read = Vec::new();
    for (_, expression) in function.expressions.iter() {
        let naga::Expression::AccessIndex { base, index } = expression else { continue };
        let naga::Expression::FunctionArgument(argument) = function.expressions[*base] else { continue };
        let ty = &module.types[function.arguments[argument as usize].ty];
        let naga::TypeInner::Struct { members, .. } = &ty.inner else { continue };
        if ty.name.as_deref() == Some("Params") {
            read.push(members[*index as usize].name.clone().expect("members have names"));
        }
    }
    read.sort();
    read.dedup();
    read
}

#[test]
fn every_shader_reads_the_parameters_of_its_row_and_no_other() {
    for part in parts() {
        let (_, function) =
            FUNCTIONS.into_iter().find(|(folder, _)| *folder == part.folder).expect("a folder of parts");
        let recipe = Recipe {
            variant: part.variant,
            precision: Precision::Plain,
            radicand: Radicand::Measured,
            observed: false,
        };
        let checked = check(&Shader::model(&recipe)).expect("every variant composes");
        let (_, found) = checked
            .module
            .functions
            .iter()
            .find(|(_, f)| f.name.as_deref() == Some(function))
            .expect("every folder defines its function");
        let declared = sorted(part.parameters.iter().map(|s| s.name()).collect());
        assert_eq!(params_read(&checked.module, found), declared, "shaders/{}/{}.wgsl", part.folder, part.name);
    }
}
