//! SVG: stacked panels over one time axis, such as spacing, speed and acceleration, observed against simulated.

mod thin;

use super::figure::{Axis, Figure, INK, PALETTE};
use super::panel::{Panel, Style};
use thin::lines;

/// The picture, and the edges of all panels \[px\].
const SIZE: [f64; 2] = [1000.0, 800.0];
const ACROSS: [f64; 2] = [64.0, 976.0];
/// Below title and legend, and above the numbers of the time axis.
const DOWN: [f64; 2] = [84.0, 754.0];
/// Between panels \[px\].
const BETWEEN: f64 = 8.0;
/// Axes, and the line at zero.
const AXIS: &str = "#787878";

/// Why a plot cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum SvgError {
    #[error(
        "times to plot over: expected at least 2, finite and increasing; found {samples}, first fault at sample {at}"
    )]
    Time { samples: usize, at: usize },
    #[error("series `{series}` of panel `{panel}`: expected {expected} values, one per time, found {found}")]
    Length { panel: String, series: String, expected: usize, found: usize },
    #[error("panels to plot: expected at least 1, found none")]
    NoPanels,
}

/// Draws panels over a shared time axis \[s\] and returns the text of an SVG of 1000 x 800 px.
///
/// The first line of `title` is set large, further lines small; a line that is too wide is set smaller, and cut if that does not help. Of samples
/// closer than a pixel only the extremes are kept. The same arguments give the same text. Fails for times that are not a time axis, a series of
/// another length, no panels.
pub fn render(title: &str, t: &[f64], panels: &[Panel]) -> Result<String, SvgError> {
    check(t, panels)?;
    let mut figure = Figure::new(SIZE[0], SIZE[1], "", &[]);
    for ((words, y), size) in title.lines().zip([22.0, 42.0]).zip([17.0, 13.0]) {
        figure.fitted([ACROSS[0], y], size, ACROSS[1] - ACROSS[0], words);
    }
    let mut legend: Vec<(&str, &str)> = Vec::new();
    for series in panels.iter().flat_map(|panel| &panel.series).filter(|series| !series.name.is_empty()) {
        let entry = (series.name.as_str(), series.style.line().0);
        if !legend.contains(&entry) {
            legend.push(entry);
        }
    }
    figure.legend([ACROSS[0], 70.0], &legend);
    let share = (DOWN[1] - DOWN[0]) / panels.len() as f64;
    for (i, panel) in panels.iter().enumerate() {
        let top = DOWN[0] + share * i as f64;
        let last = i + 1 == panels.len();
        panel.draw(&mut figure, t, [top + BETWEEN, top + share], last.then_some("time [s]"));
    }
    Ok(figure.finish())
}

impl Style {
    /// Colour, and width \[px\]. The colours remain distinct with every kind of colour blindness (Okabe and Ito), and by their lightness in
    /// grey print.
    fn line(self) -> (&'static str, f64) {
        match self {
            Style::Observed => (INK, 1.5),
            Style::Simulated => (PALETTE[1], 1.25),
            Style::Alternative => (PALETTE[0], 1.25),
            Style::Context => ("#969696", 0.75),
        }
    }
}

impl Panel {
    fn draw(&self, figure: &mut Figure, t: &[f64], [top, bottom]: [f64; 2], below: Option<&str>) {
        let times = Axis { values: [t[0], t[t.len() - 1]], places: ACROSS };
        let values = Axis { values: self.range(), places: [bottom, top] };
        figure.horizontal(&times, [top, bottom], 8.0, below);
        figure.vertical(&values, ACROSS, 3.0, &self.label);
        // Zero where speeds and accelerations change sign.
        let [low, high] = values.values;
        let zero = (low < 0.0 && high > 0.0).then(|| values.at(0.0));
        for y in [Some(bottom), zero].into_iter().flatten() {
            figure.line([ACROSS[0], y], [ACROSS[1], y], 0.75, AXIS);
        }
        figure.line([ACROSS[0], top], [ACROSS[0], bottom], 0.75, AXIS);
        for series in &self.series {
            let (colour, width) = series.style.line();
            for points in lines(t, &series.values, (ACROSS[1] - ACROSS[0]) as usize) {
                let points: Vec<[f64; 2]> = points.iter().map(|(time, x)| [times.at(*time), values.at(*x)]).collect();
                match points[..] {
                    // A sample between two gaps: a line of one point would not show.
                    [point] => figure.dot(point, width, colour),
                    _ => figure.polyline(&points, width, colour),
                }
            }
        }
    }

    /// Range of all series with a little room above and below.
    fn range(&self) -> [f64; 2] {
        let values = self.series.iter().flat_map(|series| &series.values);
        let (low, high) = values
            .filter(|value| value.is_finite())
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)));
        if low > high {
            return [0.0, 1.0];
        }
        // A constant signal gets a range around it, wide enough that its rounding errors stay invisible.
        let room = (0.05 * (high - low)).max(0.01 * low.abs().max(high.abs()).max(1.0));
        [low - room, high + room]
    }
}

fn check(t: &[f64], panels: &[Panel]) -> Result<(), SvgError> {
    let fault = (0..t.len().max(2)).find(|&i| match t.get(i) {
        None => true,
        Some(time) => !time.is_finite() || (i > 0 && *time <= t[i - 1]),
    });
    if let Some(at) = fault {
        return Err(SvgError::Time { samples: t.len(), at });
    }
    if panels.is_empty() {
        return Err(SvgError::NoPanels);
    }
    for panel in panels {
        for series in &panel.series {
            if series.values.len() != t.len() {
                return Err(SvgError::Length {
                    panel: panel.label.clone(),
                    series: series.name.clone(),
                    expected: t.len(),
                    found: series.values.len(),
                });
            }
        }
    }
    Ok(())
}
