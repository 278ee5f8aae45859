//! From files to drives: checked, corrected on request, prepared, cut.

use super::super::evaluator::warn;
use super::Args;
use crate::api::diagnosis::{Loaded, Loading, Source};
use crate::api::loading::{Input, only_follower};
use crate::api::reading::Reading;
use crate::catalog::Variant;
use std::path::Path;

/// The drives of all files.
pub fn load(args: &Args, variant: Variant) -> anyhow::Result<Loaded> {
    let reading = &args.prepare;
    let (mut train, mut holdout) = (Vec::new(), Vec::new());
    for file in args.trained_on() {
        train.extend(sources(args, reading, file)?);
    }
    for file in &args.holdout {
        holdout.extend(sources(args, reading, file)?);
    }
    let loading = Loading { variant, data_only: args.data_only };
    loading.load(train, holdout, &mut |text| warn(&text))
}

/// The requested followers of one file.
fn sources<'a>(args: &Args, reading: &'a Reading, file: &Path) -> anyhow::Result<Vec<Source<'a>>> {
    let (recording, follower) = reading.read(Input::File(file), args.follower.as_deref())?;
    let follower = follower.map_or_else(|| only_follower(&recording), Ok)?;
    let ids = reading.ids(&recording);
    let ids = if ids.is_empty() { vec![None] } else { ids.into_iter().map(Some).collect() };
    Ok(ids.into_iter().map(|id| Source { recording: recording.clone(), reading, follower, id }).collect())
}
