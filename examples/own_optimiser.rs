//! Your own optimiser on leadlag's evaluator: differential evolution in thirty lines, beside leadlag's search.
//!
//!     cargo run --release --example own_optimiser

use leadlag::{Calibration, Error, synthetic};
use std::iter::repeat_with;

const MEMBERS: usize = 60;
const GENERATIONS: usize = 200;

fn main() -> Result<(), Error> {
    let drive = synthetic(1, 300.0)?.follower(1)?;
    let calibration = Calibration::of("idm")?;
    let mut evaluator = calibration.evaluate_on(&[&drive])?;
    let (lower, upper) = (evaluator.lower(), evaluator.upper());
    let width = lower.len();

    // Numbers in [0, 1) by xorshift.
    let mut state = 1_u64;
    let mut random = repeat_with(move || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    });
    let mut draw = move || random.next().unwrap_or_default();

    let mut members: Vec<f64> =
        (0..MEMBERS * width).map(|k| lower[k % width] + draw() * (upper[k % width] - lower[k % width])).collect();
    let mut scores = evaluator.scores(&members)?;
    for _ in 0..GENERATIONS {
        let mut trials = members.clone();
        for (member, trial) in trials.chunks_exact_mut(width).enumerate() {
            let [a, b, c] = [0, 1, 2].map(|_| (draw() * MEMBERS as f64) as usize * width);
            let kept = (draw() * width as f64) as usize;
            for k in 0..width {
                if k == kept || draw() < 0.9 {
                    let mutant = members[a + k] + 0.6 * (members[b + k] - members[c + k]);
                    trial[k] =
                        if (lower[k]..=upper[k]).contains(&mutant) { mutant } else { members[member * width + k] };
                }
            }
        }
        let found = evaluator.scores(&trials)?;
        for member in 0..MEMBERS {
            if found[member] <= scores[member] {
                scores[member] = found[member];
                members[member * width..][..width].copy_from_slice(&trials[member * width..][..width]);
            }
        }
    }
    let best = scores.into_iter().fold(f64::INFINITY, f64::min);
    println!("own search: {best:.6} after {} simulations", MEMBERS * (GENERATIONS + 1));
    println!("leadlag:    {:.6}", calibration.intervals(false).run(&drive)?.score());
    Ok(())
}
