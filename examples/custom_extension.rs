//! Your own term in the model, and a test of it on another drive.
//!
//!     cargo run --release --example custom_extension

use leadlag::{Calibration, Error, synthetic};

/// The car brakes less than commanded.
const SOFT: &str = "
struct Parameters {
    /// share of the braking that is lost [-], 0 to 0.9, neutral 0
    lost: f32,
}

fn soft_command(own: Parameters, a_cmd: f32) -> f32 {
    return select(a_cmd, (1.0 - own.lost) * a_cmd, a_cmd < 0.0);
}
";

fn main() -> Result<(), Error> {
    let [drive, other] = [synthetic(1, 300.0)?.follower(1)?, synthetic(2, 300.0)?.follower(1)?];
    let base = Calibration::of("l-cth")?;
    for calibration in [base.clone(), base.extend_text("soft", SOFT)?] {
        let fit = calibration.run(&drive)?;
        print!("{fit}");
        println!("  on another drive {:.6}", fit.simulate(&other)?.scores["nrmse_sva"]);
    }
    Ok(())
}
