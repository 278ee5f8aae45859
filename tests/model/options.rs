//! Conventions, goodness-of-fit functions, vehicles and bounds as users write them.

use crate::common;
use leadlag::internal::calibrate::{SearchSpace, read_bounds};
use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::{Convention, Delay, RoadLoad};
use leadlag::internal::score::{GoodnessOfFit, Measures};
use leadlag::internal::vehicle::{Vehicle, find, find_for, read_table};
use std::fs;
use std::path::{Path, PathBuf};

fn file(name: &str, content: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("options");
    fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    fs::write(&path, content).unwrap();
    path
}

#[test]
fn a_convention_prints_as_it_is_read() {
    for text in ["paper", "authors", "paper,delay=floor", "authors,road_load=si,step=nominal"] {
        assert_eq!(text.parse::<Convention>().unwrap().to_string(), text);
    }
    let mixed: Convention = "authors, road_load=si".parse().unwrap();
    assert_eq!((mixed.road_load, mixed.delay), (RoadLoad::Si, Delay::Floor));
    assert_eq!(Convention::default(), Convention::PAPER);
}

#[test]
fn every_row_of_a_convention_is_a_switch_of_its_own() {
    for row in Convention::ROWS {
        let departed: Convention = format!("paper,{}={}", row.name, row.authors.0).parse().unwrap();
        assert_ne!(departed, Convention::PAPER, "{}", row.name);
        assert_eq!(departed.to_string(), format!("paper,{}={}", row.name, row.authors.0));
        let back: Convention = format!("paper,{}={}", row.name, row.paper.0).parse().unwrap();
        assert_eq!(back, Convention::PAPER, "{}", row.name);
    }
}

#[test]
fn a_wrong_convention_says_what_is_expected() {
    for (text, expected) in [
        ("papers", "convention `papers`: expected `paper` or `authors`"),
        ("paper,tau=1", "convention row `tau`: expected one of acceleration, delay, road_load, mfc, bounds, radicand"),
        ("paper,mfc=cubic", "convention row `mfc`: expected `linear` or `bisection`, found `cubic`"),
        ("authors,delay=floor,delay=fractional", "convention row `delay`: expected once, found more than once"),
    ] {
        let message = text.parse::<Convention>().unwrap_err().to_string();
        assert!(message.starts_with(expected), "{message}");
    }
}

#[test]
fn a_goodness_of_fit_prints_as_it_is_read() {
    for text in ["nrmse-sva", "rmse-s", "u-sv", "rmspe-a", "rmse-sn-vn", "rmse-sn-vn-an", "nrmse-sva:1,2,0.5"] {
        assert_eq!(text.parse::<GoodnessOfFit>().unwrap().to_string(), text);
    }
    for name in Measures::NAMES {
        assert_eq!(name.parse::<GoodnessOfFit>().unwrap().to_string(), name.replace('_', "-"));
    }
    assert_eq!("NRMSE_SVA:1,1,1".parse::<GoodnessOfFit>().unwrap(), GoodnessOfFit::NRMSE_SVA);
    for text in [
        "",
        "nrmse",
        "nrmse-",
        "nrmse-x",
        "nrmse-vs",
        "nrmse-ss",
        "mse-s",
        "nrmse-sv:1",
        "nrmse-s:1,2",
        "nrmse-s:0",
        "nrmse-s:x",
        "rmse-s:nan",
    ] {
        let message = text.parse::<GoodnessOfFit>().unwrap_err().to_string();
        assert!(message.starts_with(&format!("goodness of fit `{text}`: expected KIND-SIGNALS")), "{message}");
    }
    let message = "nrsme-sv".parse::<GoodnessOfFit>().unwrap_err().to_string();
    assert!(message.ends_with("did you mean `nrmse-sv`?"), "{message}");
}

#[test]
fn vehicles_are_found_by_any_of_their_names() {
    for (name, slug) in [
        ("Tesla(Model3)", "tesla_model3"),
        ("BMW X5", "bmw_x5"),
        ("audi(a6)", "audi_a6"),
        ("Mercedes", "mercedes_a"),
        ("Audi(A8)", "audi_a8"),
    ] {
        assert_eq!(Vehicle::called(name).map(|v| v.slug).as_deref(), Some(slug), "{name}");
    }
    assert_eq!(Vehicle::called("Trabant"), None);
    assert_eq!(find("tesla").unwrap().m_0, 1980.0);
}

const CAR: &str = "[my_car]\nmass_unladen_kg = 1500.0\nphi = 1.04\nf_0_N = [150.0, 160.0]\n\
                   f_1_N_per_kmh = [0.5, 0.6]\nf_2_N_per_kmh2 = [0.03, 0.04]\n";

#[test]
fn a_vehicle_file_may_name_a_curve_or_have_it_beside() {
    file("curve.csv", "speed_mps,a_ap,a_dp\n0,4,-5\n20,2,-4\n");
    let named = file("named.toml", &format!("{CAR}mfc = \"curve.csv\"\n"));
    let vehicle = find(&format!("{}#my_car", named.display())).unwrap();
    assert_eq!(vehicle.mfc.expect("a curve").a_ap, [4.0, 2.0]);
    let plain = file("plain.toml", CAR);
    assert_eq!(find(&format!("{}#my_car", plain.display())).unwrap().mfc, None);
}

#[test]
fn a_curve_that_is_not_there_matters_only_where_it_is_needed() {
    let other = CAR.replace("my_car", "his_car");
    let table = file("absent.toml", &format!("{CAR}mfc = \"nowhere.csv\"\n{other}"));
    let named = |name: &str| format!("{}#{name}", table.display());
    let error = find(&named("my_car")).unwrap_err();
    let curve = table.with_file_name("nowhere.csv");
    let expected = format!("{}: vehicle my_car: its MFC curve {} cannot be used", table.display(), curve.display());
    assert_eq!(error.to_string(), expected);
    assert_eq!(find_for(&named("my_car"), false).unwrap().mfc, None);
    assert_eq!(find(&named("his_car")).unwrap().m_0, 1500.0);
    let error = find(&named("my_cat")).unwrap_err().to_string();
    assert!(error.contains("it has his_car, my_car; did you mean `my_car`?"), "{error}");
}

#[test]
fn a_broken_vehicle_says_where_and_what() {
    let broken = |content: &str| {
        let path = file("broken.toml", content);
        let error = find(&format!("{}#my_car", path.display())).unwrap_err();
        let cause = std::error::Error::source(&error).map(|e| format!(": {e}")).unwrap_or_default();
        format!("{error}{cause}").replace(&path.display().to_string(), "broken.toml")
    };
    let curve = |content: &str| {
        file("bad_curve.csv", content);
        broken(&format!("{CAR}mfc = \"bad_curve.csv\"\n"))
    };
    for (message, expected) in [
        (broken("[your_car]\n"), "missing field"),
        (
            broken(&CAR.replace("1500.0", "-1.0")),
            "vehicle my_car: mass_unladen_kg: expected a mass of 50 to 200000 kg, found -1",
        ),
        (
            broken(&CAR.replace("[150.0, 160.0]", "[170.0, 160.0]")),
            "f_0_N: expected [lower, upper] with lower <= upper, found [170, 160]",
        ),
        (broken(&CAR.replace("my_car", "his_car")), "vehicle `my_car` is not in broken.toml; it has his_car"),
        (broken(&CAR.replace("phi", "fie")), "unknown field `fie`"),
        (
            curve("speed_mps,a_ap\n0,1\n"),
            "bad_curve.csv:1: expected the columns speed_mps, a_ap, a_dp, found `speed_mps,a_ap`",
        ),
        (curve("speed_mps,a_ap,a_dp\n0,4,-5\n1,x,-5\n"), "bad_curve.csv:3: expected a finite number, found `x`"),
        (
            curve("speed_mps,a_ap,a_dp\n0,4,-5\n0,4,-5\n"),
            "bad_curve.csv:3: expected a speed_mps above that of the row before",
        ),
        (
            curve("speed_mps,a_ap,a_dp\n0,4,-5\n20,-1,1\n"),
            "bad_curve.csv:3: expected a_dp below a_ap, so that the curves do not cross, found `a_dp 1 beside a_ap -1`",
        ),
        (curve("speed_mps,a_ap,a_dp\n0,4,-5\n"), "bad_curve.csv:1: expected at least two rows, found `1 rows`"),
    ] {
        assert!(message.contains(expected), "expected {expected:?} in:\n{message}");
    }
}

#[test]
fn broken_bounds_say_where_and_what() {
    let variant: Variant = "l-cth+nonlinear".parse().unwrap();
    let space = |content: &str, vehicle: Option<&Vehicle>| {
        let overrides = read_bounds(&file("bounds.toml", content), &variant)?;
        SearchSpace::new(&variant, vehicle, Convention::PAPER, &overrides)
    };
    let bmw = Vehicle::called("bmw_x5").unwrap();
    for (content, vehicle, expected) in [
        (
            "v_0 = [40, 25]",
            Some(&bmw),
            "v_0: expected a number above 0 and below 1e9 as both bounds, the lower one not above the upper one; found [40, 25]",
        ),
        ("v_0 = [-1, 25]", Some(&bmw), "found [-1, 25]"),
        ("v_0 = 'fast'", Some(&bmw), "v_0: expected [lower, upper], or one number to fix it; found \"fast\""),
        ("v_0 = [1, 2, 3]", Some(&bmw), "v_0: expected [lower, upper]"),
        ("v_O = [1, 2]", Some(&bmw), "bounds.toml: v_O is not a parameter of any variant"),
        (
            "delta = [1, 2]",
            Some(&bmw),
            "delta is not a parameter of variant l-cth+nonlinear, which has k_s, k_v, k_0, v_0",
        ),
        ("v_0 = [1,", Some(&bmw), "expected bounds as TOML, such as v_0 = [25, 40]: TOML parse error at line 1"),
        ("", None, "f_0: Table 3 gives its bounds per vehicle"),
    ] {
        let message = space(content, vehicle).unwrap_err().to_string();
        assert!(message.contains(expected), "expected {expected:?} in:\n{message}");
    }
    let good = space("tau_a = 0.5\nv_0 = [20, 60]", Some(&bmw)).unwrap();
    let tau_a = good.symbols.iter().position(|s| s.name() == "tau_a").unwrap();
    assert_eq!(good.bounds[tau_a], [0.5, 0.5]);
}

#[test]
fn the_built_in_vehicles_are_those_of_the_data() {
    let Some(shared) = common::shared("the_built_in_vehicles_are_those_of_the_data") else { return };
    let measured = read_table(&shared.join("data/vehicles/vehicles.csv")).expect("vehicles.csv");
    assert_eq!(measured.len(), 5);
    for ours in Vehicle::built_in() {
        let theirs = measured.iter().find(|v| v.slug == ours.slug).unwrap_or_else(|| panic!("{}", ours.slug));
        assert_eq!(ours.name, theirs.name);
        assert_eq!((ours.m_0, ours.phi_f, ours.length), (theirs.m_0, theirs.phi_f, theirs.length), "{}", ours.slug);
        let loads = |v: &Vehicle| [v.f_0, v.f_1_printed, v.f_2_printed];
        assert_eq!(loads(&ours), loads(theirs), "{}", ours.slug);
        assert!(theirs.aliases.iter().all(|name| ours.is_called(name)), "{:?}", theirs.aliases);
    }
    // 0 to the top speed in steps of 0.1 m/s: data README, section 5.
    for (slug, nodes) in
        [("tesla_model3", 691), ("bmw_x5", 631), ("audi_a6", 671), ("mercedes_a", 661), ("audi_a8", 691)]
    {
        let mfc = measured.iter().find(|v| v.slug == slug).and_then(|v| v.mfc.as_ref()).expect("a curve");
        assert_eq!(mfc.v.len(), nodes, "{slug}");
        for (v, a_dp) in mfc.v.iter().zip(&mfc.a_dp) {
            let parabola = (0.0045 * v * v - 0.171 * v - 1.8835).min(-1.0);
            assert!((a_dp - parabola).abs() < 1e-5, "{slug}: a_dp({v} m/s) = {a_dp} m/s², not {parabola}");
        }
    }
}
