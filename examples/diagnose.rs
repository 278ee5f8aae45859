//! Which effect does a model lack? The synthetic car has a lag, and the grade acts on it with half its force.
//!
//!     cargo run --release --example diagnose

use leadlag::{Diagnosis, Error, synthetic};

fn main() -> Result<(), Error> {
    let [first, second, held] = [1, 2, 3].map(|seed| synthetic(seed, 300.0).and_then(|drive| drive.follower(1)));
    let findings = Diagnosis::of("l-cth")?.effort("quick")?.run(&[&first?, &second?], &[&held?])?;
    print!("{findings}");
    Ok(())
}
