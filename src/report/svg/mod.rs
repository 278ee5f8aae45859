//! SVG: stacked panels over one time axis, such as spacing, speed and acceleration, observed against simulated.

mod heading;
mod layout;
mod panel;
mod thin;

use layout::{HEADING, HEIGHT, SCALE, TIME_AXIS, WIDTH, px};
use plotters::prelude::{IntoDrawingArea, SVGBackend, WHITE};

/// One panel: series that share a vertical axis.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Name of the vertical axis with its unit, such as `speed v [m/s]`.
    pub label: String,
    /// Drawn in this order, the last on top.
    pub series: Vec<Series>,
}

/// One line of a panel.
#[derive(Debug, Clone, PartialEq)]
pub struct Series {
    /// Name in the legend; a name that occurs in several panels with the same style is listed once.
    pub name: String,
    /// One value per time; NaN and infinities leave a gap in the line.
    pub values: Vec<f64>,
    /// How the line looks.
    pub style: Style,
}

/// Role of a series, which decides colour and width. The colours remain distinct with every kind of colour blindness
/// (Okabe and Ito), and by their lightness in grey print.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Style {
    /// Measured: nearly black.
    Observed,
    /// Simulated: orange.
    Simulated,
    /// A second simulation to compare with, such as one with an extension: blue.
    Alternative,
    /// Context, such as the speed of the car ahead: a thin grey line.
    Context,
}

/// Why a plot cannot be drawn.
#[derive(Debug, thiserror::Error)]
pub enum SvgError {
    /// No time axis.
    #[error(
        "times to plot over: expected at least 2, finite and increasing; found {samples}, first fault at sample {at}"
    )]
    Time {
        /// Number of times.
        samples: usize,
        /// Index of the first time that is missing, not finite or not later than the one before.
        at: usize,
    },
    /// A series that does not belong to the time axis.
    #[error("series `{series}` of panel `{panel}`: expected {expected} values, one per time, found {found}")]
    Length {
        /// Label of the panel.
        panel: String,
        /// Name of the series.
        series: String,
        /// Number of times.
        expected: usize,
        /// Number of values.
        found: usize,
    },
    /// No panels at all.
    #[error("panels to plot: expected at least 1, found none")]
    NoPanels,
    /// The drawing library failed.
    #[error("drawing the plot: {reason}")]
    Draw {
        /// Message of the library.
        reason: String,
    },
}

/// Draws panels over a shared time axis \[s\] and returns the text of an SVG of 1000 x 800 px.
///
/// The first line of `title` is set large, further lines small; a line that is too wide is set smaller, and cut
/// if that does not help. Of samples closer than a pixel only the extremes are kept. The same arguments give the
/// same text.
///
/// # Errors
/// Times that are not a time axis, a series of another length, no panels.
pub fn render(title: &str, t: &[f64], panels: &[Panel]) -> Result<String, SvgError> {
    check(t, panels)?;
    let mut svg = String::new();
    {
        let root = SVGBackend::with_string(&mut svg, (px(WIDTH) as u32, px(HEIGHT) as u32)).into_drawing_area();
        root.fill(&WHITE).map_err(drawing)?;
        let (top, mut rest) = root.split_vertically(px(HEADING));
        heading::draw(&top, title, panels)?;
        // The last panel carries the labels of the time axis, so it gets their height on top of its share.
        let share = (px(HEIGHT - HEADING - TIME_AXIS)) / panels.len() as i32;
        for (i, panel) in panels.iter().enumerate() {
            let last = i + 1 == panels.len();
            let (area, below) = if last { (rest.clone(), rest) } else { rest.split_vertically(share) };
            panel::draw(&area, t, panel, last)?;
            rest = below;
        }
        root.present().map_err(drawing)?;
    }
    Ok(at_screen_size(&svg))
}

/// The drawing library uses whole pixels only; the plot is drawn [`SCALE`] times as large and shown at its size.
fn at_screen_size(svg: &str) -> String {
    let large = format!("width=\"{}\" height=\"{}\"", px(WIDTH), px(HEIGHT));
    let small = format!("width=\"{WIDTH}\" height=\"{HEIGHT}\" stroke-linejoin=\"round\"");
    debug_assert!(svg.contains(&large), "size of the picture, scale {SCALE}");
    svg.replacen(&large, &small, 1)
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

fn drawing(error: impl std::error::Error) -> SvgError {
    SvgError::Draw { reason: error.to_string() }
}
