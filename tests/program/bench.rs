//! `leadlag bench`: the schema of its JSON, and its exports can be computed again elsewhere.
//! No speed is asserted: it depends more on the machine than on the program.

use serde_json::Value;
use std::process::{Command, Output};

fn bench(arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_leadlag"));
    command.arg("bench").args(arguments).output().expect("the program starts")
}

#[test]
fn the_json_has_the_fields_that_are_documented() {
    let output = bench(&["--quick", "--json"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let report: Value = serde_json::from_slice(&output.stdout).expect("stdout is JSON and nothing else");
    assert_eq!(report["schema_version"], 1);
    assert!(report["machine"].is_string() && (report["adapter"].is_string() || report["adapter"].is_null()));
    let rows = report["rows"].as_array().expect("rows are a list");
    for row in rows {
        let place = format!("{} {} {}", row["evaluator"], row["precision"], row["model_id"]);
        for name in ["mcs_wall", "mcs_per_core_second"] {
            assert!(row[name].as_f64().is_some_and(|x| x > 0.0), "{place}: {name}");
        }
        for name in ["population", "steps", "jobs"] {
            assert!(row[name].as_u64().is_some_and(|x| x > 0), "{place}: {name}");
        }
        for name in ["transfer_s", "first_dispatch_s"] {
            assert!(row[name].as_f64().is_some_and(|x| x >= 0.0), "{place}: {name}");
        }
        let times = |name: &str| row[name].as_array().map_or(0, Vec::len);
        assert!(times("wall_s") > 1 && times("wall_s") == times("cpu_s"), "{place}: every single time is kept");
    }
    for (evaluator, precision) in [("native", "f32"), ("native", "f64"), ("reference", "f64")] {
        let is = |row: &&Value| row["evaluator"] == evaluator && row["precision"] == precision && row["model_id"] == 1;
        assert!(rows.iter().any(|row| is(&row)), "{evaluator} {precision} is listed with the evaluators");
    }
}

#[test]
fn what_is_exported_is_what_is_scored() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().to_str().expect("a UTF-8 path");
    let output = bench(&["--export", path]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let read = |name: &str| -> (Vec<String>, Vec<Vec<f64>>) {
        let mut reader = csv::Reader::from_path(folder.path().join(name)).expect("the file is there");
        let header = reader.headers().expect("a header").iter().map(str::to_owned).collect();
        let number = |field: &str| field.parse().unwrap_or(f64::NAN);
        let rows = reader.records().map(|r| r.expect("a row").iter().map(number).collect()).collect();
        (header, rows)
    };
    let (header, drive) = read("drive.csv");
    assert_eq!(header, ["v_l_mps", "dx_l_m", "s_m", "v_f_mps", "a_f_mps2"]);
    assert_eq!(drive.len(), 9227);
    let (header, candidates) = read("candidates.csv");
    assert_eq!(header, ["delta", "v_0", "d_0", "t_h", "a_max", "a_min", "nrmse_sva"]);
    assert_eq!(candidates.len(), 4096);

    // The equations again, as in benches/peers.
    let dt = 0.1;
    let rms = |k: usize| (drive[1..].iter().map(|row| row[k] * row[k]).sum::<f64>() / (drive.len() - 1) as f64).sqrt();
    let measured = [rms(2), rms(3), rms(4)];
    for row in candidates.iter().step_by(100) {
        let [delta, v_0, d_0, t_h, a_max, a_min, expected] = row[..] else { panic!("seven columns") };
        let (mut s, mut v, mut square) = (drive[0][2], drive[0][3], [0.0; 3]);
        for pair in drive.windows(2) {
            let (before, here) = (&pair[0], &pair[1]);
            let s_des = d_0 + (t_h * v - v * (before[0] - v) / (2.0 * (-a_max * a_min).sqrt())).max(0.0);
            let a = a_max * (1.0 - (v / v_0).powf(delta) - (s_des / s).powi(2));
            let v_next = (v + a * dt).max(0.0);
            s += here[1] - (v + v_next) / 2.0 * dt;
            for (sum, residual) in square.iter_mut().zip([s - here[2], v_next - here[3], (v_next - v) / dt - here[4]]) {
                *sum += residual * residual;
            }
            v = v_next;
        }
        let steps = (drive.len() - 1) as f64;
        let found: f64 = square.iter().zip(measured).map(|(sum, rms)| (sum / steps).sqrt() / rms).sum();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found} against {expected}");
    }
}
