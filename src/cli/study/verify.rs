//! `leadlag study verify`.

use super::super::{evaluator, interrupt, output};
use super::run::Bar;
use super::status::{Place, complain};
use crate::api::error::refuse;
use crate::evaluator::AdapterChoice;
use crate::study::folder::Folder;
use crate::study::part::Part;
use crate::study::{Assignment, Event, Progress, RunSettings, drawn, inventory, verify};
use crate::text::shown::counted;
use anyhow::{bail, ensure};
use serde_json::Value;
use std::path::PathBuf;
use std::time::{SystemTime, UNIX_EPOCH};

/// Largest number of differing parts in a message.
const NAMED: usize = 10;

#[derive(Debug, clap::Args)]
pub struct Args {
    #[command(flatten)]
    of: Place,
    /// Share of the parts to compute again, above 0 and at most 1; one part at least
    #[arg(long, value_name = "SHARE", default_value_t = 0.01)]
    share: f64,
    /// Seed that selects the parts [default: a new selection each time]
    #[arg(long, value_name = "SEED")]
    seed: Option<u64>,
    /// Folder of the data, if it has moved since the plan
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    if !(args.share > 0.0 && args.share <= 1.0) {
        refuse!("--share: expected a number above 0 and at most 1, found {}", args.share);
    }
    interrupt::watch();
    let folder = Folder::open(&args.of.folder)?;
    let (study, tasks) = folder.study(args.data.as_deref())?;
    let inventory = inventory::look(&folder, &tasks, &args.of.parts)?;
    complain(&inventory)?;
    if inventory.done() == 0 {
        bail!("no task is done yet; `leadlag study run {}` computes them", args.of.folder.display());
    }
    // The selection must be unpredictable for anyone who changes a part.
    let clock = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| u64::from(time.subsec_nanos()));
    let seed = args.seed.unwrap_or_else(clock);
    let chosen = drawn(&inventory, args.share, seed);
    let progress = Progress::default();
    let mut bar = Bar::new(chosen.len(), study.plan.calibration.stop.max_evaluations);
    let mut tell = |event: Event| bar.tell(event, &progress);
    let settings = RunSettings { in_flight: None, wait: true, adapter: AdapterChoice::Best, warn: evaluator::warn };
    let assignment = Assignment { folder: &folder, study: &study, tasks: &tasks, chosen: &chosen };
    let found = verify(assignment, &inventory, &settings, &progress, &interrupt::asked, &mut tell);
    bar.finish();
    let found = found?;
    ensure!(!found.interrupted, "interrupted: {} of {} parts were computed again", found.parts, chosen.len());
    let (count, all) = (found.differing.len(), inventory.done());
    let said =
        format!("{} of {} computed again (--share {} --seed {seed}): ", found.parts, counted(all, "part"), args.share);
    if count == 0 {
        return output::print(&format!("{said}all identical\n"));
    }
    for (then, now) in found.differing.iter().take(NAMED) {
        let (id, platoon, follower) = (&then.id, &then.calibration.platoon, then.calibration.follower);
        let difference = difference(then, now);
        eprintln!("{id} ({platoon} follower {follower}, {}): {difference}", then.calibration.variant);
    }
    bail!(
        "{said}{count} differ: the numbers were changed, or they come from another version of this program, or from another \
         processor, library or device, whose last digits may differ (then verify it there); delete the wrong parts from {}, and \
         `leadlag study run` computes them again",
        folder.parts().display()
    )
}

/// The first value that differs, and where.
fn difference(then: &Part, now: &Part) -> String {
    let value = |part: &Part| serde_json::to_value(part).unwrap_or_default();
    let ignored = ["program", "evaluator", "precision", "adapter"];
    first(String::new(), &value(then), &value(now), &ignored).unwrap_or_default()
}

fn first(path: String, then: &Value, now: &Value, ignored: &[&str]) -> Option<String> {
    if then == now || ignored.iter().any(|name| path.ends_with(&format!(".{name}"))) {
        return None;
    }
    let below = |key: &str, then: &Value| {
        let path = if path.is_empty() { key.to_owned() } else { format!("{path}.{key}") };
        first(path, then, now.get(key).unwrap_or(&Value::Null), ignored)
    };
    let inside = match (then, now) {
        (Value::Object(then), Value::Object(_)) => then.iter().find_map(|(key, value)| below(key, value)),
        (Value::Array(then), Value::Array(now)) if then.len() == now.len() => {
            let pairs = then.iter().zip(now).enumerate();
            pairs.into_iter().find_map(|(k, (then, now))| first(format!("{path}[{k}]"), then, now, ignored))
        }
        _ => None,
    };
    inside.or_else(|| Some(format!("{path}: found {then}, computed {now}")))
}
