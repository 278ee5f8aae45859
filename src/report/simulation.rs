//! The simulated follower beside the measured one, as CSV.

use crate::evaluator::Case;
use crate::reference::Trace;
use crate::simulate::SIMULATION_COLUMNS;
use std::io::Write;

/// Writes one row per sample: the speed of the preceding vehicle that the follower drove behind, which in a platoon is a simulated one, the measured
/// follower and its measured spacing, then the simulated follower. After a failed run the simulated columns are empty. Fails when writing fails.
pub fn write_csv(out: impl Write, t: &[f64], case: &Case, trace: &Trace) -> csv::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    writer.write_record(SIMULATION_COLUMNS)?;
    for (i, t) in t.iter().enumerate() {
        let measured = [*t, case.v_l[i], case.s[i], case.v_f[i], case.a_f[i]].map(|x| x.to_string());
        let simulated =
            [&trace.x, &trace.s, &trace.v, &trace.a].map(|y| y.get(i).map_or(String::new(), f64::to_string));
        writer.write_record(measured.iter().chain(&simulated))?;
    }
    writer.flush()?;
    Ok(())
}
