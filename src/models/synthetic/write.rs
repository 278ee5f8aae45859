//! Writes a synthetic drive in the layouts of users' files.
//!
//! Digits as in the AstaZero files: speeds with 6 decimals, gaps and positions with 5.

use std::io::{self, Write};

use super::sample::Synthetic;

/// Writes all cars in the OpenACC layout: five metadata lines, then `Time,Speed1..,IVS1..`.
pub fn write_openacc(drive: &Synthetic, mut to: impl Write) -> io::Result<()> {
    let scenario = &drive.truth.scenario;
    let names: Vec<&str> = std::iter::once(scenario.lead.name.as_str())
        .chain(scenario.followers.iter().map(|car| car.name.as_str()))
        .collect();
    // A synthetic drive has no date, but the line must exist.
    writeln!(to, "Date,1,1,2000")?;
    writeln!(to, "Vehicle_order,{}", names.join(","))?;
    writeln!(to, "Number_of_vehicles,{}", names.len())?;
    writeln!(to, "ACC,1")?;
    writeln!(to, "Distance_setting,min")?;
    write!(to, "Time")?;
    for car in 1..=drive.v.len() {
        write!(to, ",Speed{car}")?;
    }
    for link in 1..=drive.gap.len() {
        write!(to, ",IVS{link}")?;
    }
    writeln!(to)?;
    for (i, t) in drive.t.iter().enumerate() {
        write!(to, "{t:?}")?;
        for speeds in &drive.v {
            write!(to, ",{:.6}", speeds[i])?;
        }
        for gaps in &drive.gap {
            write!(to, ",{:.5}", gaps[i])?;
        }
        writeln!(to)?;
    }
    to.flush()
}

/// Writes one follower in the pair layout; follower 1 is the car right behind the platoon leader.
///
/// The columns `lead2_*` exist from follower 2 on. `InvalidInput` if the platoon has no such follower.
pub fn write_pair(drive: &Synthetic, follower: usize, mut to: impl Write) -> io::Result<()> {
    if follower == 0 || follower > drive.gap.len() {
        return Err(io::Error::new(
            io::ErrorKind::InvalidInput,
            format!("follower {follower}: expected 1 to {}, the followers of this platoon", drive.gap.len()),
        ));
    }
    let ahead = follower - 1;
    write!(to, "time_s,lead_speed_mps,speed_mps,spacing_m,sin_grade,lead_position_m")?;
    if ahead > 0 {
        write!(to, ",lead2_speed_mps,lead2_spacing_m")?;
    }
    writeln!(to)?;
    for (i, t) in drive.t.iter().enumerate() {
        write!(
            to,
            "{t:?},{:.6},{:.6},{:.5},{:.7},{:.5}",
            drive.v[ahead][i],
            drive.v[follower][i],
            drive.gap[ahead][i],
            drive.sin_grade[follower][i],
            drive.x[ahead][i]
        )?;
        if ahead > 0 {
            write!(to, ",{:.6},{:.5}", drive.v[ahead - 1][i], drive.gap[ahead - 1][i])?;
        }
        writeln!(to)?;
    }
    to.flush()
}

/// Writes the road grade over one lap in the layout of `Slope.csv`: position `X` \[m\], sine of the grade `Y`.
pub fn write_slope(drive: &Synthetic, mut to: impl Write) -> io::Result<()> {
    writeln!(to, "X,Y")?;
    for (x, sin) in drive.grade.x.iter().zip(&drive.grade.sin) {
        writeln!(to, "{x:.5},{sin:.9}")?;
    }
    to.flush()
}
