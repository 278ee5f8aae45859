//! Pictures as SVG text: lines, bars and points on plain axes.
//!
//! Coordinates are rounded to a tenth of a pixel, so that the same numbers give the same bytes.

use std::fmt::Write;

/// Colours that remain distinct with every kind of colour blindness (Okabe and Ito).
pub const PALETTE: [&str; 6] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
/// Text and axes.
pub const INK: &str = "#222222";
/// Grid lines and other background.
pub const PALE: &str = "#dddddd";
/// The paper's numbers.
pub const PAPER: &str = "#777777";

/// Average width of a character in units of the font size: a wide one, because no font is available to measure.
const CHARACTER: f64 = 0.56;
/// Smallest size of a fitted text \[px\].
const SMALLEST: f64 = 9.0;

/// Position of a text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    Middle,
    End,
}

/// A picture under construction.
#[derive(Debug)]
pub struct Figure {
    width: f64,
    height: f64,
    body: String,
}

impl Figure {
    /// An empty picture with a title and small lines below it.
    pub fn new(width: f64, height: f64, title: &str, lines: &[&str]) -> Figure {
        let mut figure = Figure { width, height, body: String::new() };
        figure.fitted([16.0, 28.0], 18.0, width - 32.0, title);
        for (i, line) in lines.iter().enumerate() {
            figure.text([16.0, 48.0 + 17.0 * i as f64], 12.5, Anchor::Start, "#555555", line);
        }
        figure
    }

    /// A text at a point, in a size \[px\].
    pub fn text(&mut self, [x, y]: [f64; 2], size: f64, anchor: Anchor, colour: &str, text: &str) {
        let anchor = match anchor {
            Anchor::Start => "start",
            Anchor::Middle => "middle",
            Anchor::End => "end",
        };
        let text = escape(text);
        self.push(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"{anchor}\" fill=\"{colour}\">{text}</text>"
        ));
    }

    /// A text in this size \[px\] or, if it is too wide, a smaller one; the end of a text that is wider yet is cut.
    pub fn fitted(&mut self, at: [f64; 2], size: f64, width: f64, text: &str) {
        let count = text.chars().count().max(1) as f64;
        let size = size.min(width / CHARACTER / count).max(SMALLEST);
        let room = (width / CHARACTER / size * (1.0 + 1e-9)) as usize;
        let cut = text.chars().count() > room;
        let shown: String = text.chars().take(if cut { room.saturating_sub(1) } else { room }).collect();
        self.text(at, size, Anchor::Start, INK, &(shown + if cut { "…" } else { "" }));
    }

    /// Lines across at the round values of a vertical axis, their numbers, and the name of the axis.
    pub fn vertical(&mut self, axis: &Axis, [from, to]: [f64; 2], least: f64, name: &str) {
        for (y, number) in axis.ticks(least) {
            self.line([from, y], [to, y], 0.8, PALE);
            self.text([from - 6.0, y + 4.0], 11.5, Anchor::End, INK, &number);
        }
        self.upright([from - 44.0, (axis.places[0] + axis.places[1]) / 2.0], 12.5, name);
    }

    /// Lines downwards at the round values of a horizontal axis, with their numbers below if it has a name.
    pub fn horizontal(&mut self, axis: &Axis, [top, bottom]: [f64; 2], least: f64, name: Option<&str>) {
        for (x, number) in axis.ticks(least) {
            self.line([x, top], [x, bottom], 0.8, PALE);
            if name.is_some() {
                self.text([x, bottom + 15.0], 11.5, Anchor::Middle, INK, &number);
            }
        }
        if let Some(name) = name {
            self.text([(axis.places[0] + axis.places[1]) / 2.0, bottom + 33.0], 12.5, Anchor::Middle, INK, name);
        }
    }

    /// A text that reads upwards.
    pub fn upright(&mut self, [x, y]: [f64; 2], size: f64, text: &str) {
        let text = escape(text);
        self.push(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" text-anchor=\"middle\" fill=\"{INK}\" transform=\"rotate(-90 {x:.1} {y:.1})\">{text}</text>"
        ));
    }

    /// A text that rises to the right from its point.
    pub fn rising(&mut self, [x, y]: [f64; 2], size: f64, text: &str) {
        let text = escape(text);
        self.push(format_args!(
            "<text x=\"{x:.1}\" y=\"{y:.1}\" font-size=\"{size}\" fill=\"{INK}\" transform=\"rotate(-60 {x:.1} {y:.1})\">{text}</text>"
        ));
    }

    pub fn line(&mut self, [x, y]: [f64; 2], [to_x, to_y]: [f64; 2], width: f64, colour: &str) {
        self.push(format_args!(
            "<line x1=\"{x:.1}\" y1=\"{y:.1}\" x2=\"{to_x:.1}\" y2=\"{to_y:.1}\" stroke=\"{colour}\" stroke-width=\"{width}\"/>"
        ));
    }

    /// A line through several points.
    pub fn polyline(&mut self, points: &[[f64; 2]], width: f64, colour: &str) {
        let points: Vec<String> = points.iter().map(|[x, y]| format!("{x:.1},{y:.1}")).collect();
        let points = points.join(" ");
        self.push(format_args!(
            "<polyline points=\"{points}\" fill=\"none\" stroke=\"{colour}\" stroke-width=\"{width}\" stroke-linejoin=\"round\"/>"
        ));
    }

    /// A filled rectangle between two corners.
    pub fn bar(&mut self, from: [f64; 2], to: [f64; 2], fill: &str, stroke: &str) {
        let ([x, y], [to_x, to_y]) = (from, to);
        let (left, top, width, height) = (x.min(to_x), y.min(to_y), (to_x - x).abs(), (to_y - y).abs());
        self.push(format_args!(
            "<rect x=\"{left:.1}\" y=\"{top:.1}\" width=\"{width:.1}\" height=\"{height:.1}\" fill=\"{fill}\" stroke=\"{stroke}\" stroke-width=\"0.8\"/>"
        ));
    }

    /// A round point.
    pub fn dot(&mut self, [x, y]: [f64; 2], radius: f64, fill: &str) {
        self.push(format_args!("<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"{radius}\" fill=\"{fill}\"/>"));
    }

    /// An open diamond: the paper's value.
    pub fn diamond(&mut self, [x, y]: [f64; 2], radius: f64) {
        let r = radius;
        self.push(format_args!(
            "<path d=\"M{:.1} {y:.1}L{x:.1} {:.1}L{:.1} {y:.1}L{x:.1} {:.1}Z\" fill=\"white\" stroke=\"{PAPER}\" stroke-width=\"1.4\"/>",
            x - r,
            y - r,
            x + r,
            y + r
        ));
    }

    /// A triangle at the upper edge of a plot, with a value that lies beyond it.
    pub fn beyond(&mut self, [x, y]: [f64; 2], radius: f64, value: &str) {
        let r = radius;
        self.push(format_args!(
            "<path d=\"M{:.1} {:.1}L{:.1} {:.1}L{x:.1} {:.1}Z\" fill=\"white\" stroke=\"{PAPER}\" stroke-width=\"1.4\"/>",
            x - r,
            y + r,
            x + r,
            y + r,
            y - r
        ));
        self.rising([x + 3.0, y - r - 2.0], 10.0, value);
    }

    /// Shapes drawn in the closure belong together and share this tooltip.
    pub fn with_tooltip(&mut self, text: &str, draw: impl FnOnce(&mut Figure)) {
        let text = escape(text);
        self.push(format_args!("<g><title>{text}</title>"));
        draw(self);
        self.push(format_args!("</g>"));
    }

    /// A name in the colour of all text, with a square of its own colour before it, both centred at a point.
    pub fn named(&mut self, [x, y]: [f64; 2], name: &str, colour: &str) {
        let width = 15.0 + 7.2 * name.chars().count() as f64;
        self.legend([x - width / 2.0, y], &[(name, colour)]);
    }

    /// A legend on one line: coloured squares with names.
    pub fn legend(&mut self, [mut x, y]: [f64; 2], entries: &[(&str, &str)]) {
        for (name, colour) in entries {
            self.bar([x, y - 9.0], [x + 10.0, y + 1.0], colour, colour);
            self.text([x + 15.0, y], 12.5, Anchor::Start, INK, name);
            x += 34.0 + 7.2 * name.chars().count() as f64;
        }
    }

    fn push(&mut self, element: std::fmt::Arguments) {
        writeln!(self.body, "{element}").expect("a String takes all");
    }

    /// The text of the SVG.
    pub fn finish(self) -> String {
        let Figure { width, height, body } = self;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
             font-family=\"sans-serif\">\n<rect width=\"{width}\" height=\"{height}\" fill=\"white\"/>\n{body}</svg>\n"
        )
    }
}

fn escape(text: &str) -> String {
    crate::text::shown::name(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;")
}

/// A straight axis: the values at its ends, and their places \[px\].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Axis {
    /// Different ones.
    pub values: [f64; 2],
    /// Along x or y.
    pub places: [f64; 2],
}

impl Axis {
    /// The place of a value.
    pub fn at(&self, value: f64) -> f64 {
        let ([low, high], [from, to]) = (self.values, self.places);
        from + (value - low) / (high - low) * (to - from)
    }

    /// The places of its round values and their numbers: as few as make `least` steps or more.
    pub fn ticks(&self, least: f64) -> impl Iterator<Item = (f64, String)> {
        let (axis, [low, high]) = (*self, self.values);
        let step = step(high - low, least);
        let digits = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        let number = move |value: f64| match step {
            1e-5..1e6 => format!("{value:.digits$}"),
            _ => format!("{value:.1e}"),
        };
        let (first, last) = ((low / step - 1e-9).ceil() as i64, (high / step + 1e-9).floor() as i64);
        (first..=last).map(move |k| (axis.at(k as f64 * step), number(k as f64 * step)))
    }
}

/// A rectangle of the picture with a vertical axis from 0; along x, positions are the caller's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plot {
    /// Left and right edge \[px\].
    pub x: [f64; 2],
    /// Upper and lower edge \[px\].
    pub y: [f64; 2],
    /// Value at the upper edge.
    pub top: f64,
}

/// Steps of the axis of a [`Plot`] at least.
const STEPS: f64 = 4.0;

impl Plot {
    /// A plot whose axis runs from 0 to a round number above `highest`.
    pub fn new(x: [f64; 2], y: [f64; 2], highest: f64) -> Plot {
        let highest = if highest.is_finite() && highest > 0.0 { highest } else { 1.0 };
        let step = step(highest, STEPS);
        Plot { x, y, top: (highest / step - 1e-9).ceil() * step }
    }

    fn values(&self) -> Axis {
        Axis { values: [0.0, self.top], places: [self.y[1], self.y[0]] }
    }

    /// Height of a value \[px\]; values above the axis end at its top.
    pub fn height(&self, value: f64) -> f64 {
        self.values().at(value.clamp(0.0, self.top))
    }

    /// The `i`-th of `count` equal steps along x, at `share` of its width \[px\].
    pub fn along(&self, i: usize, count: usize, share: f64) -> f64 {
        self.x[0] + (self.x[1] - self.x[0]) * (i as f64 + share) / count as f64
    }

    /// Draws grid, numbers, axis and its name.
    pub fn axis(&self, figure: &mut Figure, name: &str) {
        figure.vertical(&self.values(), self.x, STEPS, name);
        figure.line([self.x[0], self.y[1]], [self.x[1], self.y[1]], 1.0, INK);
    }
}

/// The largest of 1, 2 or 5 times a power of ten of which `span` has `least` or more.
fn step(span: f64, least: f64) -> f64 {
    let power = 10f64.powf((span / least).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|factor| factor * power).find(|step| span / step >= least).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_end_at_round_numbers() {
        for (highest, top) in [(0.27, 0.3), (7.0, 7.0), (0.1, 0.1), (41.0, 50.0), (0.0, 1.0), (f64::NAN, 1.0)] {
            let found = Plot::new([0.0, 1.0], [0.0, 1.0], highest).top;
            assert!((found - top).abs() < 1e-9, "{highest}: {found}");
        }
    }
}
