//! Title and legend, above the panels, where they cannot hide a line.

use plotters::coord::Shift;
use plotters::prelude::{DrawingArea, PathElement, SVGBackend, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};

use super::layout::{RIGHT, TEXT, VALUE_AXIS, WIDTH, line, px, text};
use super::{Panel, Style, SvgError, drawing};

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Average width of a character in units of the font size: a wide one, because no font is available to measure.
const CHARACTER: f64 = 0.56;
/// Smallest size of a title line \[px\]; longer text is cut.
const SMALLEST: f64 = 9.0;
/// Number of title lines with enough room.
const LINES: usize = 2;
/// Middle of the legend \[px\].
const LEGEND: i32 = 68;

pub(super) fn draw(area: &Area<'_>, title: &str, panels: &[Panel]) -> Result<(), SvgError> {
    let mut y = 8;
    for (i, words) in title.lines().take(LINES).enumerate() {
        let wanted = if i == 0 { 17.0 } else { TEXT };
        let room = f64::from(WIDTH - VALUE_AXIS - RIGHT) / CHARACTER;
        let size = wanted.min(room / words.chars().count().max(1) as f64).max(SMALLEST);
        let words = cut(words, (room / size) as usize);
        area.draw(&Text::new(words, (px(VALUE_AXIS), px(y)), text(size))).map_err(drawing)?;
        y += (wanted * 1.4) as i32;
    }
    legend(area, panels)
}

fn legend(area: &Area<'_>, panels: &[Panel]) -> Result<(), SvgError> {
    let mut listed: Vec<(&str, Style)> = Vec::new();
    for series in panels.iter().flat_map(|panel| &panel.series) {
        let entry = (series.name.as_str(), series.style);
        if !series.name.is_empty() && !listed.contains(&entry) {
            listed.push(entry);
        }
    }
    let middle_left = Pos::new(HPos::Left, VPos::Center);
    let mut x = VALUE_AXIS;
    for (name, style) in listed {
        // Thicker than in the plot, because a short line shows little colour.
        let mut sample = line(style);
        sample.stroke_width += 4;
        let ends = vec![(px(x), px(LEGEND)), (px(x + 26), px(LEGEND))];
        area.draw(&PathElement::new(ends, sample)).map_err(drawing)?;
        area.draw(&Text::new(name.to_owned(), (px(x + 32), px(LEGEND)), text(TEXT).pos(middle_left)))
            .map_err(drawing)?;
        x += 32 + (name.chars().count() as f64 * TEXT * CHARACTER) as i32 + 28;
    }
    Ok(())
}

fn cut(words: &str, characters: usize) -> String {
    if words.chars().count() <= characters {
        return words.to_owned();
    }
    let kept = words.chars().take(characters.saturating_sub(1));
    kept.chain(['…']).collect()
}
