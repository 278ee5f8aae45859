//! Output of the test: lines on stdout, tables under `target/tmp/scores/`.

use super::window::Largest;
use super::{CONDITIONED, Judged, PRECISIONS, ending};
use crate::common::followers::Follower;
use leadlag::internal::evaluator::Score;
use std::fs;
use std::path::Path;

pub struct Report<'a> {
    pub followers: &'a [Follower],
    /// Candidates of each variant and follower.
    pub count: usize,
    lines: Vec<String>,
    exceptions: csv::Writer<Vec<u8>>,
    statuses: csv::Writer<Vec<u8>>,
    variants: csv::Writer<Vec<u8>>,
}

fn table(header: &[&str]) -> csv::Writer<Vec<u8>> {
    let mut table = csv::Writer::from_writer(Vec::new());
    table.write_record(header).expect("memory");
    table
}

fn value(score: &Score) -> String {
    match score {
        Score::Value(value) => format!("{value:e}"),
        other => ending(other).to_owned(),
    }
}

impl<'a> Report<'a> {
    pub fn new(followers: &'a [Follower], count: usize) -> Report<'a> {
        let candidate = ["precision", "variant", "trajectory", "candidate", "parameters_si", "condition"];
        let header = |more: &[&str]| table(&[&candidate[..], more].concat());
        Report {
            followers,
            count,
            lines: Vec::new(),
            exceptions: header(&[
                "kind",
                "nrmse_sva_f64",
                "nrmse_sva_f32",
                "window_s_m",
                "window_v_mps",
                "window_a_mps2",
                "windows",
                "unstable",
            ]),
            statuses: header(&["ending_f64", "ending_f32", "change_that_flips", "smallest_spacing_m"]),
            variants: table(&["precision", "variant", "scores", "within_limit", "median", "largest"]),
        }
    }

    /// Prints a line and keeps it.
    pub fn say(&mut self, line: String) {
        println!("{line}");
        self.lines.push(line);
    }

    /// Variant, trajectory and candidate in words.
    pub fn name(&self, j: &Judged) -> String {
        let values = j.population(self.followers, self.count).values(j.candidate).to_vec();
        let label = &self.followers[j.follower].trajectory.label;
        format!("{}, {label}, candidate {} {values:?}, K = {:.1}", j.variant, j.candidate, j.condition)
    }

    fn candidate(&self, j: &Judged, precision: usize) -> Vec<String> {
        let population = j.population(self.followers, self.count);
        let parameter =
            |(symbol, value): (&leadlag::internal::symbols::Symbol, &f64)| format!("{}={value}", symbol.name());
        let parameters: Vec<String> =
            population.symbols().iter().zip(population.values(j.candidate)).map(parameter).collect();
        vec![
            PRECISIONS[precision].1.into_str().to_owned(),
            j.variant.name(),
            self.followers[j.follower].trajectory.label.clone(),
            j.candidate.to_string(),
            parameters.join(" "),
            format!("{:.3e}", j.condition),
        ]
    }

    pub fn exception(&mut self, j: &Judged, precision: usize, kind: &str, found: &Largest) {
        let mut record = self.candidate(j, precision);
        record.extend([kind.to_owned(), value(&j.exact), value(&j.found[precision])]);
        record.extend(found.difference.map(|difference| format!("{difference:.2e}")));
        record.extend([found.windows.to_string(), found.unstable.to_string()]);
        self.exceptions.write_record(record).expect("memory");
    }

    pub fn status(&mut self, j: &Judged, precision: usize, distance: f64, spacing: f64) {
        let mut record = self.candidate(j, precision);
        record.extend([ending(&j.exact).to_owned(), ending(&j.found[precision]).to_owned()]);
        record.extend([format!("{distance:.0e}"), format!("{spacing:.6}")]);
        self.statuses.write_record(record).expect("memory");
    }

    /// One line per precision and variant, of its well-conditioned candidates.
    pub fn by_variant(&mut self, judged: &[Judged]) {
        for (precision, (_, in_lanes, limit)) in PRECISIONS.iter().enumerate() {
            let mut worst = (1.0, String::new());
            for variant in leadlag::internal::catalog::Variant::all() {
                let of = judged.iter().filter(|j| j.variant == variant && j.condition <= CONDITIONED);
                let mut errors: Vec<f64> = of.filter_map(|j| j.error(precision)).collect();
                errors.sort_by(f64::total_cmp);
                let Some(largest) = errors.last() else { continue };
                let within = errors.iter().filter(|error| *error <= limit).count() as f64 / errors.len() as f64;
                if within < worst.0 {
                    worst = (within, variant.name());
                }
                let median = format!("{:.2e}", errors[errors.len() / 2]);
                let (scores, largest) = (errors.len().to_string(), format!("{largest:.2e}"));
                let record =
                    [in_lanes.into_str(), &variant.name(), &scores, &format!("{within:.4}"), &median, &largest];
                self.variants.write_record(record).expect("memory");
            }
            let (within, name) = worst;
            self.say(format!(
                "{}: smallest share within the limit {:.2} %: {name}",
                in_lanes.into_str(),
                100.0 * within
            ));
        }
    }

    /// Writes the tables.
    pub fn finish(self) {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("scores");
        fs::create_dir_all(&folder).expect("target is writable");
        let tables = [("exceptions", self.exceptions), ("statuses", self.statuses), ("variants", self.variants)];
        for (name, table) in tables {
            fs::write(folder.join(format!("{name}.csv")), table.into_inner().expect("memory"))
                .expect("target is writable");
        }
        fs::write(folder.join("summary.txt"), self.lines.join("\n") + "\n").expect("target is writable");
        println!("tables in {}", folder.display());
    }
}
