//! The plot of a simulated follower: spacing, speed and acceleration, observed against simulated.

use super::panel::{Panel, Series, Style};
use super::svg::{SvgError, render};
use crate::evaluator::{Case, Outcome};
use crate::reference::Trace;
use crate::score::{GoodnessOfFit, Signal};

/// Label of the measured car ahead.
pub const AHEAD: &str = "preceding vehicle";

/// Draws s, v and a over time; `ahead` is the label of the car ahead. A failed run is drawn up to its end. Fails when the drawing library fails.
pub fn draw(
    title: &str,
    ahead: &str,
    t: &[f64],
    case: &Case,
    trace: &Trace,
    outcome: &Outcome,
) -> Result<String, SvgError> {
    let quality = match outcome.result {
        Ok(m) => {
            let nrmse = |signal| m.signal(signal).nrmse;
            let (s, v, a) = (nrmse(Signal::Spacing), nrmse(Signal::Speed), nrmse(Signal::Acceleration));
            let sum = GoodnessOfFit::NRMSE_SVA.of(&m);
            format!("NRMSE(s) {s:.4} · NRMSE(v) {v:.4} · NRMSE(a) {a:.4} · sum {sum:.4}")
        }
        Err(failure) => {
            let when = t.get(failure.step).copied().unwrap_or(f64::NAN);
            format!("ended early at sample {} ({when:.1} s): {}", failure.step, failure.kind)
        }
    };
    let series = |name: &str, values: &[f64], style| {
        let mut values = values.to_vec();
        values.resize(t.len(), f64::NAN);
        Series::new(name, style, values)
    };
    let panels = [
        Panel::new(
            "spacing s [m]",
            vec![series("observed", &case.s, Style::Observed), series("simulated", &trace.s, Style::Simulated)],
        ),
        Panel::new(
            "speed v [m/s]",
            vec![
                series(ahead, &case.v_l, Style::Context),
                series("observed", &case.v_f, Style::Observed),
                series("simulated", &trace.v, Style::Simulated),
            ],
        ),
        Panel::new(
            "acceleration a [m/s²]",
            vec![series("observed", &case.a_f, Style::Observed), series("simulated", &trace.a, Style::Simulated)],
        ),
    ];
    render(&format!("{title}\n{quality}"), t, &panels)
}
