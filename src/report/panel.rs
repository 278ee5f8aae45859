//! What pictures and pages draw over time.

use serde::Serialize;

/// Series that share a vertical axis.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Panel {
    /// Name of the vertical axis with its unit, such as `speed v [m/s]`.
    pub label: String,
    /// Drawn in this order, the last on top.
    #[serde(rename = "lines")]
    pub series: Vec<Series>,
}

/// One line of a panel.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Series {
    /// Name in the legend; a name that occurs in several panels with the same style is listed once.
    pub name: String,
    /// How the line looks.
    #[serde(rename = "role")]
    pub style: Style,
    /// One value per horizontal one; NaN and infinities leave a gap in the line.
    pub values: Vec<f64>,
}

/// Role of a series, which decides colour and width.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Style {
    /// Measured.
    Observed,
    /// Simulated by the model, or by the base model.
    Simulated,
    /// A second simulation to compare with, such as one with an extension.
    Alternative,
    /// Context, such as the speed of the car ahead.
    Context,
}

impl Panel {
    /// A panel with these series.
    pub fn new(label: &str, series: Vec<Series>) -> Panel {
        Panel { label: label.to_owned(), series }
    }
}

impl Series {
    /// A series with these values.
    pub fn new(name: &str, style: Style, values: Vec<f64>) -> Series {
        Series { name: name.to_owned(), style, values }
    }
}
