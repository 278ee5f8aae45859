//! The report as text for a terminal.

use super::report::{DiagnosisReport, Gains, MOST_OF_IT, Silence, Tally};
use std::fmt::Write;

impl DiagnosisReport {
    /// As text.
    #[must_use]
    pub fn table(&self) -> String {
        let mut text = format!(
            "{:30} {:>5} {:>5} {:>6} {:>4} {:>6} {:>9} {:>5}\n",
            "", "cases", "right", "in set", "half", "silent", "not found", "wrong"
        );
        for (row, tally) in &self.tallies {
            let Tally { cases, right, in_set, half, silent, not_found, wrong } = tally;
            let _ =
                writeln!(text, "{row:30} {cases:5} {right:5} {in_set:6} {half:4} {silent:6} {not_found:9} {wrong:5}");
        }
        text += "half: one of two effects, and nothing else\n";
        text += "not found: silent, though the truth, fitted from its values, would be named\n";
        text += "\nshare with its 95 % interval, and target; shown: the truth, fitted from its\n";
        text += "values, gains more than the threshold, each of two effects beside the other\n";
        for bar in &self.bars {
            let met = match bar.met {
                None => "no case",
                Some(true) => "met",
                Some(false) => "missed",
            };
            let [low, high] = bar.interval.map(|share| 100.0 * share);
            let target = format!("{} {} %", if bar.most { "<=" } else { ">=" }, 100.0 * bar.target);
            let interval = format!("[{low:.0}, {high:.0}] %");
            let _ =
                writeln!(text, "{:41}{:>4} of {:>3} {interval:>11} {target:>8} {met}", bar.what, bar.count, bar.cases);
        }
        text += "\nsingle effects named right, by the change of speed [m/s] that they make\n";
        let sizes = self.powers.first().map_or(&[][..], |row| &row.sizes);
        let _ = writeln!(text, "{:24}{}", "", sizes.iter().map(|at| format!("{:>10}", at.rms_mps)).collect::<String>());
        for row in self.powers.iter().chain(&self.powers_by_effect) {
            let counts = row.sizes.iter().map(|at| format!("{:>4} of {:>2}", at.right, at.cases));
            let _ = writeln!(text, "{:24}{}", row.of, counts.map(|count| format!("{count:>10}")).collect::<String>());
        }
        if !self.silence.is_empty() {
            text += "\ndrives without an effect: evidence of the likeliest cause, as a share of the threshold\n";
            let _ = writeln!(text, "{:24}{:>7}{:>8}{:>11}{:>9}", "", "drives", "median", "1 of 20 >", "highest");
        }
        for Silence { of, cases, median, one_in_twenty, highest } in &self.silence {
            let _ = writeln!(text, "{of:24}{cases:>7}{median:>8.2}{one_in_twenty:>11.2}{highest:>9.2}");
        }
        let [close, estimated] = self.close_estimates;
        let _ = writeln!(
            text,
            "\nof effects named right, all parameters within 10 % or 3 standard errors\nof the planted ones: {close} of {estimated}"
        );
        if let Some(Gains { median, most, cases }) = self.gains {
            let _ = writeln!(
                text,
                "\nshare of the gain of the truth on the hold-out that extended models reach (NRMSE(s,v,a)):\nmedian {:.0} %, at least {:.0} % in {most} of {cases}",
                100.0 * median,
                100.0 * MOST_OF_IT
            );
        }
        text += "\nplanted, and the answer\n";
        for (truth, said) in &self.names {
            let said: Vec<String> = said.iter().map(|(name, times)| format!("{name} {times}")).collect();
            let _ = writeln!(text, "{truth:36} {}", said.join(", "));
        }
        let _ = writeln!(
            text,
            "\n{} of {} cases, {} of them could not be generated\nmedian {:.0} s of CPU and {:.0} simulated candidates each",
            self.outcomes.len(),
            self.planned,
            self.failed,
            self.cost[0],
            self.cost[1]
        );
        text
    }
}
