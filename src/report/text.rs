//! A calibration as text for a terminal of 80 columns.

use super::result::ResultFile;
use crate::symbols::Symbol;
use std::fmt::Write;

/// What was fitted to what, how well, with which parameters.
#[must_use]
pub fn calibration(result: &ResultFile) -> String {
    let mut text = String::new();
    // Writing to a String cannot fail.
    let _ = write_calibration(&mut text, result);
    text
}

fn write_calibration(text: &mut String, result: &ResultFile) -> std::fmt::Result {
    writeln!(text, "variant      {} {}", result.model_id, result.variant)?;
    for data in &result.data {
        let [from, to] = data.window_s;
        writeln!(text, "data         {}", data.path)?;
        writeln!(text, "             follower {}, {}", data.follower, data.name)?;
        let (samples, first) = (data.samples, data.first_scored);
        text.push_str(&wrapped(
            INDENT,
            INDENT + 2,
            &format!("{from:.1} to {to:.1} s, {samples} samples, scored from sample {first}"),
        ));
        text.push_str(&wrapped(INDENT, INDENT + 2, &format!("sha256 {}", &data.sha256[..16.min(data.sha256.len())])));
        for note in &data.preparation {
            text.push_str(&wrapped(INDENT, INDENT + 2, note));
        }
        if let Some(grade) = &data.grade {
            text.push_str(&wrapped(INDENT, INDENT + 2, &format!("grade: {}", grade.path)));
        }
    }
    if let Some(vehicle) = &result.vehicle {
        writeln!(text, "vehicle      {}, {} kg unladen", vehicle.slug, vehicle.m_0)?;
        text.push_str(&wrapped(INDENT, INDENT + 2, &format!("from {}", vehicle.from)));
    }
    writeln!(text, "convention   {}", result.convention)?;
    let adapter = result.adapter.as_deref().map_or(String::new(), |a| format!(" on {a}"));
    writeln!(text, "evaluator    {} ({}){adapter}", result.evaluator, result.precision)?;
    writeln!(text, "optimizer    {}, seed {}, {} evaluations", result.optimizer, result.seed, result.evaluations)?;
    for replicate in &result.replicates {
        writeln!(
            text,
            "replicate {:<3}{} = {:.6} after {} evaluations: {}",
            replicate.replicate, result.gof, replicate.score, replicate.evaluations, replicate.stop
        )?;
    }
    if let Some(cv) = result.cv {
        writeln!(text, "             coefficient of variation over replicates {:.3} %", 100.0 * cv)?;
    }

    writeln!(text, "\n{:<10}{:>11}  {:<5}{:>17}  meaning", "parameter", "value", "unit", "bounds")?;
    for (name, value) in &result.parameters {
        let [lower, upper] = result.bounds.get(name).copied().unwrap_or([f64::NAN; 2]);
        let bounds = if lower == upper { "fixed".to_owned() } else { format!("{} .. {}", short(lower), short(upper)) };
        let unit = result.units.get(name).map_or("", String::as_str);
        let meaning = Symbol::from_name(name).map_or("", Symbol::meaning);
        let mark = if result.at_bound.contains(name) { "AT BOUND" } else { meaning };
        writeln!(text, "{name:<10}{value:>11.5}  {unit:<5}{bounds:>17}  {mark}")?;
    }

    let score = |name: &str| result.score.get(name).copied().flatten();
    writeln!(text, "\n{:<14}{:>10}{:>10}{:>10}{:>12}", "", "spacing", "speed", "accel.", "sum")?;
    for (title, names) in [
        ("NRMSE", ["nrmse_s", "nrmse_v", "nrmse_a", "nrmse_sva"]),
        ("Theil's U", ["u_s", "u_v", "u_a", "u_sva"]),
        ("RMSE (SI)", ["rmse_s", "rmse_v", "rmse_a", ""]),
    ] {
        let [s, v, a, sum] = names.map(|n| score(n).map_or(String::new(), |x| format!("{x:.4}")));
        writeln!(text, "{}", format!("{title:<14}{s:>10}{v:>10}{a:>10}{sum:>12}").trim_end())?;
    }
    Ok(())
}

/// Columns of the terminal.
const WIDTH: usize = 80;
const INDENT: usize = 13;

/// A line wrapped to 80 columns: its first part is indented by `first` blanks, what follows by `rest`.
#[must_use]
pub fn wrapped(first: usize, rest: usize, line: &str) -> String {
    let (first, rest) = (" ".repeat(first), " ".repeat(rest));
    let options = textwrap::Options::new(WIDTH).initial_indent(&first).subsequent_indent(&rest);
    textwrap::wrap(line, options).join("\n") + "\n"
}

/// At most four significant digits.
fn short(x: f64) -> String {
    let rounded: f64 = format!("{x:.3e}").parse().unwrap_or(x);
    rounded.to_string()
}
