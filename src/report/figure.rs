//! Figures that are not time series: bars, boxes and points on plain axes, as SVG text.
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

/// Position of a text relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// It begins there.
    Start,
    /// Its middle is there.
    Middle,
    /// It ends there.
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
    #[must_use]
    pub fn new(width: f64, height: f64, title: &str, lines: &[&str]) -> Figure {
        let mut figure = Figure { width, height, body: String::new() };
        figure.text([16.0, 28.0], 18.0, Anchor::Start, INK, title);
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

    /// A line.
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
    pub fn told(&mut self, text: &str, draw: impl FnOnce(&mut Figure)) {
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
    #[must_use]
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

/// A rectangle of the picture with a vertical axis; along x, positions are the caller's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Plot {
    /// Left and right edge \[px\].
    pub x: [f64; 2],
    /// Upper and lower edge \[px\].
    pub y: [f64; 2],
    /// Value at the upper edge; at the lower edge it is 0.
    pub top: f64,
}

impl Plot {
    /// A plot whose axis runs from 0 to a round number above `highest`.
    #[must_use]
    pub fn new(x: [f64; 2], y: [f64; 2], highest: f64) -> Plot {
        let highest = if highest.is_finite() && highest > 0.0 { highest } else { 1.0 };
        let step = step(highest);
        Plot { x, y, top: (highest / step - 1e-9).ceil() * step }
    }

    /// Height of a value \[px\]; values above the axis end at its top.
    #[must_use]
    pub fn height(&self, value: f64) -> f64 {
        let share = (value / self.top).clamp(0.0, 1.0);
        self.y[1] - share * (self.y[1] - self.y[0])
    }

    /// The `i`-th of `count` equal steps along x, at `share` of its width \[px\].
    #[must_use]
    pub fn along(&self, i: usize, count: usize, share: f64) -> f64 {
        self.x[0] + (self.x[1] - self.x[0]) * (i as f64 + share) / count as f64
    }

    /// Draws grid, numbers, axis and its name.
    pub fn axis(&self, figure: &mut Figure, name: &str) {
        let step = step(self.top);
        let count = (self.top / step).round() as usize;
        let digits = (-(step * 1.000_001).log10().floor()).max(0.0) as usize;
        for i in 0..=count {
            let value = i as f64 * step;
            let y = self.height(value);
            figure.line([self.x[0], y], [self.x[1], y], 0.8, PALE);
            figure.text([self.x[0] - 6.0, y + 4.0], 11.5, Anchor::End, INK, &format!("{value:.digits$}"));
        }
        figure.line([self.x[0], self.y[1]], [self.x[1], self.y[1]], 1.0, INK);
        figure.upright([self.x[0] - 44.0, (self.y[0] + self.y[1]) / 2.0], 12.5, name);
    }
}

/// 1, 2 or 5 times a power of ten: four to nine of them make `span`.
fn step(span: f64) -> f64 {
    let power = 10f64.powf((span / 4.0).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|factor| factor * power).find(|step| span / step >= 4.0).unwrap_or(power)
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
