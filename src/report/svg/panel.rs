//! One panel: axes, grid, lines.

use plotters::coord::Shift;
use plotters::prelude::{ChartBuilder, Circle, DrawingArea, PathElement, SVGBackend};

use super::layout::{BETWEEN, LEFT, RIGHT, TEXT, TICK, TIME_AXIS, VALUE_AXIS, WIDTH, axis, grid, line, px, text};
use super::thin::lines;
use super::{Panel, SvgError, drawing};

pub(super) fn draw(
    area: &DrawingArea<SVGBackend<'_>, Shift>,
    t: &[f64],
    panel: &Panel,
    last: bool,
) -> Result<(), SvgError> {
    let (low, high) = range(panel);
    let times = t[0]..t[t.len() - 1];
    let mut chart = ChartBuilder::on(area)
        .margin_left(px(LEFT))
        .margin_right(px(RIGHT))
        .margin_top(px(BETWEEN))
        .y_label_area_size(px(VALUE_AXIS - LEFT))
        .x_label_area_size(if last { px(TIME_AXIS) } else { 0 })
        .build_cartesian_2d(times.clone(), low..high)
        .map_err(drawing)?;
    let mut mesh = chart.configure_mesh();
    mesh.bold_line_style(grid())
        .max_light_lines(0)
        .axis_style(axis())
        .label_style(text(TEXT))
        .axis_desc_style(text(TEXT))
        .set_all_tick_mark_size(px(TICK))
        .x_labels(12)
        .y_labels(6)
        .x_label_formatter(&|time| short(*time))
        .y_label_formatter(&|value| short(*value))
        .y_desc(panel.label.as_str());
    if last {
        mesh.x_desc("time [s]");
    }
    mesh.draw().map_err(drawing)?;
    // The lower end of every panel, and zero where speeds and accelerations change sign.
    let zero = (low < 0.0 && high > 0.0).then_some(0.0);
    for value in [Some(low), zero].into_iter().flatten() {
        let across = vec![(times.start, value), (times.end, value)];
        chart.draw_series([PathElement::new(across, axis())]).map_err(drawing)?;
    }
    for series in &panel.series {
        let style = line(series.style);
        for points in lines(t, &series.values, (WIDTH - VALUE_AXIS - RIGHT) as usize) {
            if let [point] = points[..] {
                // A sample between two gaps, because a line of one point would be invisible.
                let dot = Circle::new(point, style.stroke_width, style.filled());
                chart.draw_series([dot]).map_err(drawing)?;
            } else {
                chart.draw_series([PathElement::new(points, style)]).map_err(drawing)?;
            }
        }
    }
    Ok(())
}

/// Range of all series with a little room above and below.
fn range(panel: &Panel) -> (f64, f64) {
    let values = panel.series.iter().flat_map(|series| &series.values);
    let (low, high) = values
        .filter(|value| value.is_finite())
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), &value| (low.min(value), high.max(value)));
    if low > high {
        return (0.0, 1.0);
    }
    // A constant signal gets a range around it, wide enough that its rounding errors stay invisible.
    let room = (0.05 * (high - low)).max(0.01 * low.abs().max(high.abs()).max(1.0));
    (low - room, high + room)
}

/// A label without the digits that binary fractions leave behind.
fn short(value: f64) -> String {
    let rounded = (value * 1e4).round() / 1e4;
    // Adding 0 turns -0 into 0.
    format!("{}", rounded + 0.0)
}
