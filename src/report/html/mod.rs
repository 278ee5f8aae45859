//! A result as one HTML file that needs nothing else: no network, no folder beside it.
//!
//! uPlot draws the charts (`assets/uplot`, MIT), embedded completely; everything else is plain HTML or SVG, so a printer or a reader
//! without scripts loses only the zoom.

mod budget;
mod calibration;
mod chart;
mod diagnosis;
mod made_by;
mod sumo;
mod table;

pub use calibration::{DriveErrors, calibration};
pub use chart::Chart;
pub use diagnosis::diagnosis;
pub use made_by::{MadeBy, RUN_VERSION};
pub(in crate::internal::report) use table::is_formula;

use crate::trajectory::driver_id;
use std::path::Path;

const UPLOT_JS: &str = include_str!("../../../assets/uplot/uPlot.iife.min.js");
const UPLOT_CSS: &str = include_str!("../../../assets/uplot/uPlot.min.css");
const UPLOT_LICENCE: &str = include_str!("../../../assets/uplot/LICENSE");
const REPORT_JS: &str = include_str!("../../../assets/report/report.js");
const REPORT_CSS: &str = include_str!("../../../assets/report/report.css");

/// uPlot formats numbers in the language of the browser, and a Chromium of the locale C names one that does not exist.
const LANGUAGE_JS: &str = "try { new Intl.NumberFormat(navigator.language); } catch { \
                           Object.defineProperty(navigator, \"language\", { value: \"en\", configurable: true }); }";

/// Content security policy of a page: only its own content, even if texts of a result contain addresses.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; \
                      form-action 'none'";

/// A page under construction.
#[derive(Debug, Default)]
pub(in crate::internal::report) struct Page {
    body: String,
    charts: Vec<Chart>,
    sections: Vec<(String, String)>,
}

impl Page {
    /// Adds HTML unchanged.
    pub fn raw(&mut self, html: &str) {
        self.body.push_str(html);
        self.body.push('\n');
    }

    /// Begins a section, ending the one before.
    pub fn section(&mut self, id: &str, title: &str) {
        if !self.sections.is_empty() {
            self.raw("</section>");
        }
        self.sections.push((id.to_owned(), title.to_owned()));
        self.raw(&format!("<section id=\"{id}\"><h2>{}</h2>", escape(title)));
    }

    /// Adds a paragraph of text.
    pub fn paragraph(&mut self, text: &str) {
        self.raw(&format!("<p>{}</p>", escape(text)));
    }

    /// Adds one chart, with choosers for its content: one of several (`of`, such as drives), and one of its signals. Adds nothing if there
    /// are none.
    pub fn charts(&mut self, caption: &str, of: &str, charts: Vec<Chart>) {
        if charts.is_empty() {
            return;
        }
        let caption = escape(caption);
        let numbers: Vec<String> = (self.charts.len()..).take(charts.len()).map(|number| number.to_string()).collect();
        self.raw(&format!(
            "<figure><figcaption>{caption}</figcaption><div class=\"choose\" data-of=\"{}\"></div><div class=\"chart\" data-chart=\"{}\" tabindex=\"0\" \
             role=\"img\" aria-label=\"{caption}\" title=\"Drag to zoom, double-click to see all; two fingers on a touch screen; keys: \
             arrows, + and −, 0\"></div><noscript><p>This chart is drawn by JavaScript, which is switched off here; the pictures and \
             tables beside the result show the same.</p></noscript></figure>",
            escape(of),
            numbers.join(" ")
        ));
        self.charts.extend(charts.into_iter().map(Chart::thinned));
    }

    /// Adds a finished picture.
    pub fn picture(&mut self, title: &str, svg: &str) {
        let title = escape(title);
        // The picture shrinks with the page down to a readable size, then scrolls.
        self.raw(&format!(
            "<figure><div class=\"svg\" role=\"group\" aria-label=\"{title}\" tabindex=\"0\">{svg}</div></figure>"
        ));
    }

    /// The whole file. `twin` is the machine-readable result, `made` the command that made it, if known.
    pub fn finish(mut self, title: &str, lead: &str, twin: &str, made: Option<&MadeBy>) -> String {
        if !self.sections.is_empty() {
            self.raw("</section>");
        }
        let links: String = self
            .sections
            .iter()
            .map(|(id, title)| format!("<a href=\"#{id}\">{}</a>", escape(title)))
            .collect::<Vec<_>>()
            .join(" ");
        let charts = serde_json::to_string(&self.charts).expect("numbers and text can be written");
        let version = env!("CARGO_PKG_VERSION");
        let [warnings, command] = [MadeBy::warnings, MadeBy::command].map(|of| made.map_or(String::new(), of));
        format!(
            "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\n\
             <meta http-equiv=\"Content-Security-Policy\" content=\"{POLICY}\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"color-scheme\" content=\"light dark\"><meta name=\"generator\" content=\"leadlag {version}\">\n\
             <link rel=\"icon\" href=\"data:,\"><title>{title}</title>\n<style>{UPLOT_CSS}\n{REPORT_CSS}</style></head>\n\
             <body><header><h1>{title}</h1>{lead}{warnings}<nav aria-label=\"sections\">{links}</nav></header>\n<main>\n{body}</main>\n\
             <footer>{command}<p>Made by leadlag {version}. Charts: uPlot. The whole result is in this file: \
             <button type=\"button\" id=\"save\">save it as JSON</button>\
             <noscript> (needs JavaScript)</noscript></p>\
             <details><summary>Licence of uPlot</summary><pre>{licence}</pre></details></footer>\n\
             <script type=\"application/json\" id=\"result\">{twin}</script>\n\
             <script type=\"application/json\" id=\"charts\">{charts}</script>\n\
             <script>{LANGUAGE_JS}</script>\n<script>{UPLOT_JS}</script>\n<script>{REPORT_JS}</script></body></html>\n",
            title = escape(title),
            body = self.body,
            licence = escape(UPLOT_LICENCE),
            twin = unscripted(twin),
            charts = unscripted(&charts),
        )
    }
}

/// The end of a title: the file and the driver of one drive, or the number of several drives, by their paths and names.
fn drives<'a>(of: impl ExactSizeIterator<Item = (&'a str, &'a str)>) -> String {
    let count = of.len();
    let mut of = of;
    match (of.next(), count) {
        (Some((path, name)), 1) => {
            let file = Path::new(path).file_name().map_or(path.into(), |file| file.to_string_lossy());
            driver_id(name, None).map_or_else(|| format!(" on {file}"), |id| format!(" on {file}, {id}"))
        }
        (Some(_), count) => format!(" on {count} drives"),
        (None, _) => String::new(),
    }
}

/// Text in HTML.
pub(in crate::internal::report) fn escape(text: &str) -> String {
    crate::text::shown::lines(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}

/// JSON that cannot end its script element.
fn unscripted(json: &str) -> String {
    json.replace('<', "\\u003c")
}

/// Four significant digits; a value that is 0 up to rounding is 0.
pub(in crate::internal::report) fn short(value: f64) -> String {
    if value.abs() < 1e-12 {
        return "0".to_owned();
    }
    if !value.is_finite() {
        return "–".to_owned();
    }
    let rounded: f64 = format!("{value:.3e}").parse().unwrap_or(value);
    // Values near 0 need no digits.
    if rounded.abs() < 1e-3 { format!("{rounded:e}") } else { rounded.to_string() }
}

/// A value with the significant digits of its interval: two of its width.
pub(in crate::internal::report) fn within(value: f64, [low, high]: [f64; 2]) -> String {
    let width = high - low;
    if !value.is_finite() || !width.is_finite() || width <= 0.0 {
        return short(value);
    }
    let decimals = (1.0 - width.log10().floor()).clamp(0.0, 12.0) as usize;
    format!("{value:.decimals$}")
}

pub(super) fn between(interval: Option<[f64; 2]>) -> String {
    interval.map_or("–".to_owned(), |[low, high]| format!("{} to {}", short(low), short(high)))
}

#[cfg(test)]
mod tests {
    use super::{short, within};

    #[test]
    fn numbers_are_short_whatever_their_size() {
        let shown = [12_346.0, 0.281_639, 0.001, -0.000_013_63, 2.619e-9, -1.7e-17, f64::NAN].map(short);
        assert_eq!(shown, ["12350", "0.2816", "0.001", "-1.363e-5", "2.619e-9", "0", "–"]);
    }

    #[test]
    fn a_value_has_the_digits_of_its_interval() {
        for (value, ends, shown) in [
            (1.196_437, [1.117_3, 1.279_8], "1.20"),
            (33.651_2, [21.0, 59.0], "34"),
            (0.055_56, [0.0551, 0.0560], "0.05556"),
            (1234.5, [1000.0, 1500.0], "1234"),
            (0.281_639, [0.281_639; 2], "0.2816"),
            (f64::NAN, [0.0, 1.0], "–"),
        ] {
            assert_eq!(within(value, ends), shown);
        }
    }
}
