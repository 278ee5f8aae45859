//! Sizes and colours of the plot.

use plotters::prelude::{FontTransform, IntoFont, RGBColor, ShapeStyle, TextStyle};

use super::Style;

/// Width of the picture \[px\].
pub(super) const WIDTH: i32 = 1000;
/// Height of the picture \[px\].
pub(super) const HEIGHT: i32 = 800;
/// Height of title and legend \[px\].
pub(super) const HEADING: i32 = 84;
/// Height of the labels of the time axis \[px\].
pub(super) const TIME_AXIS: i32 = 46;
/// Width of the labels of the vertical axes \[px\].
pub(super) const VALUE_AXIS: i32 = 64;
/// Empty border on the left, part of that width \[px\].
pub(super) const LEFT: i32 = 8;
/// Length of tick marks, which keeps labels off the axes \[px\].
pub(super) const TICK: i32 = 5;
/// Empty border on the right, which also takes half of the last time label \[px\].
pub(super) const RIGHT: i32 = 24;
/// Between panels \[px\].
pub(super) const BETWEEN: i32 = 8;
/// Drawing units per pixel: coordinates are whole numbers, and lines need finer ones.
pub(super) const SCALE: i32 = 4;

/// Size of axis labels and legend \[px\].
pub(super) const TEXT: f64 = 13.0;

const INK: RGBColor = RGBColor(34, 34, 34);
const ORANGE: RGBColor = RGBColor(213, 94, 0);
const BLUE: RGBColor = RGBColor(0, 114, 178);
const GREY: RGBColor = RGBColor(150, 150, 150);
const FAINT: RGBColor = RGBColor(222, 222, 222);
const MIDDLE: RGBColor = RGBColor(120, 120, 120);

/// Grid lines.
pub(super) fn grid() -> ShapeStyle {
    ShapeStyle::from(FAINT).stroke_width(3)
}

/// Axes, and the line at zero.
pub(super) fn axis() -> ShapeStyle {
    ShapeStyle::from(MIDDLE).stroke_width(3)
}

/// Pixels in drawing units.
pub(super) const fn px(pixels: i32) -> i32 {
    pixels * SCALE
}

/// Text of a size \[px\] in nearly black.
pub(super) fn text(size: f64) -> TextStyle<'static> {
    // The SVG backend divides by 1.24 to turn a line height into a font size.
    ("sans-serif", size * 1.24 * f64::from(SCALE)).into_font().transform(FontTransform::None).color(&INK)
}

/// The line of a series.
pub(super) fn line(style: Style) -> ShapeStyle {
    // Widths in drawing units: a quarter of a pixel each.
    let (color, width) = match style {
        Style::Observed => (INK, 6),
        Style::Simulated => (ORANGE, 5),
        Style::Alternative => (BLUE, 5),
        Style::Context => (GREY, 3),
    };
    ShapeStyle { color: color.into(), filled: false, stroke_width: width }
}
