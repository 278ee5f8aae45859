//! From a drive to calibrated parameters, and to their error on another drive.
//!
//!     cargo run --release --example calibrate

use leadlag::{Calibration, Error, synthetic};

fn main() -> Result<(), Error> {
    // Your own file: leadlag::read("platoon.csv")?.follower(1)?
    let [drive, other] = [synthetic(1, 300.0)?.follower(1)?, synthetic(2, 300.0)?.follower(1)?];
    for model in ["idm", "idm+linear", "gipps+delay"] {
        let fit = Calibration::of(model)?.seed(1).run(&drive)?;
        print!("{fit}");
        println!("  on another drive {:.6}", fit.simulate(&other)?.scores["nrmse_sva"]);
    }
    Ok(())
}
