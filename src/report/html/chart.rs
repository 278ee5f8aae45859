//! Time charts as data for the script of a report: thinned to the resolution of the screen, extremes kept.

use crate::report::panel::Panel;
use serde::Serialize;

/// Number of stretches of which each keeps the extremes of every line.
const STRETCHES: usize = 1200;

/// Panels over one time axis, zoomed together.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    pub title: String,
    /// Name of the horizontal axis.
    pub x_label: String,
    /// Horizontal values, increasing.
    pub x: Vec<f64>,
    /// True if values are also drawn as points, for classes, whose positions a line alone does not show.
    #[serde(skip_serializing_if = "std::ops::Not::not")]
    pub points: bool,
    /// From the top down.
    pub panels: Vec<Panel>,
}

impl Chart {
    /// The same chart with few enough points: for each stretch, the samples at which a line is highest or lowest, with five
    /// digits.
    pub fn thinned(mut self) -> Chart {
        let count = self.x.len();
        let width = count.div_ceil(STRETCHES).max(1);
        let mut kept = Vec::new();
        for start in (0..count).step_by(width) {
            let end = (start + width).min(count);
            let mut own = vec![start];
            for line in self.panels.iter().flat_map(|panel| &panel.series) {
                let finite = |i: usize| line.values.get(i).copied().filter(|value| value.is_finite());
                let with_value = || (start..end).filter_map(|i| Some((i, finite(i)?)));
                own.extend(with_value().min_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i));
                own.extend(with_value().max_by(|a, b| a.1.total_cmp(&b.1)).map(|(i, _)| i));
            }
            own.sort_unstable();
            own.dedup();
            kept.extend(own);
        }
        kept.extend(count.checked_sub(1).filter(|last| kept.last() != Some(last)));
        self.x = kept.iter().map(|i| self.x[*i]).collect();
        for line in self.panels.iter_mut().flat_map(|panel| &mut panel.series) {
            line.values = kept.iter().map(|i| line.values.get(*i).map_or(f64::NAN, |value| five(*value))).collect();
        }
        self
    }
}

/// Five significant digits: more than a screen has pixels.
fn five(value: f64) -> f64 {
    format!("{value:.4e}").parse().unwrap_or(value)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::panel::{Series, Style};

    #[test]
    fn extremes_survive_and_the_rest_is_thinned() {
        let x: Vec<f64> = (0..24_000).map(|i| f64::from(i) * 0.1).collect();
        let mut values: Vec<f64> = x.iter().map(|x| (x * 0.1).sin()).collect();
        values[12_345] = 7.0;
        values[12_346] = f64::NAN;
        let panel = Panel::new("", vec![Series::new("s", Style::Observed, values)]);
        let chart =
            Chart { title: String::new(), x_label: String::new(), x, points: false, panels: vec![panel] }.thinned();
        assert!(chart.x.len() <= 3 * STRETCHES + 1 && chart.x.is_sorted());
        assert!(chart.panels[0].series[0].values.contains(&7.0));
        assert_eq!(chart.x.last(), Some(&2399.9));
    }
}
