//! Effects of a given size: the change of a drive makes an effect weak or strong, not its parameter.

use super::effect::Effect;
use super::error::SyntheticError;
use super::noise::Noise;
use super::sample::Ahead;
use super::scenario::Scenario;

/// Tolerance of the requested size.
const PRECISION: f64 = 0.01;
/// Halvings of the range of a parameter.
const HALVINGS: usize = 40;
/// Largest strength of the search for a weak effect.
const NEARLY_ALL: f64 = 0.999;

/// The scenario with each effect of a follower (1 drives behind the platoon leader) scaled so that it alone changes that follower's speed by `rms`
/// \[m/s\] (root mean square over the drive), with everything else at its true value. Fails if an effect cannot change this drive by that
/// amount, otherwise as a run.
/// Panics for an unknown follower.
pub fn at_amplitude(scenario: &Scenario, follower: usize, rms: f64) -> Result<Scenario, SyntheticError> {
    let mut quiet = Scenario { noise: Noise::NONE, ..scenario.clone() };
    quiet.followers.truncate(follower);
    let car = &mut quiet.followers[follower - 1];
    car.gusts = None;
    let effects = std::mem::take(&mut car.effects);
    let ahead = Ahead::of(&quiet, follower)?;
    let plain = ahead.speed_behind(&quiet)?;
    let scaled: Result<Vec<Effect>, SyntheticError> =
        effects.iter().map(|effect| scale(&mut quiet, &ahead, effect, rms, &plain)).collect();
    let mut found = scenario.clone();
    found.followers[follower - 1].effects = scaled?;
    Ok(found)
}

/// One effect of the last follower.
fn scale(
    quiet: &mut Scenario,
    ahead: &Ahead,
    effect: &Effect,
    rms: f64,
    plain: &[f64],
) -> Result<Effect, SyntheticError> {
    let follower = quiet.followers.len();
    let (mut weak, mut strong) = (0.0, 1.0);
    let mut largest = 0.0_f64;
    for _ in 0..HALVINGS {
        let strength = 0.5 * (weak + strong);
        let scaled = effect.at_strength(strength);
        quiet.followers[follower - 1].effects = vec![scaled.clone()];
        let size = match ahead.speed_behind(quiet) {
            Ok(v) => {
                let squares: f64 = v.iter().zip(plain).map(|(a, b)| (a - b) * (a - b)).sum();
                (squares / v.len() as f64).sqrt()
            }
            // So strong that the platoon crashes, or a delay that is shorter than a step of the integration.
            Err(SyntheticError::Collision { .. }) => f64::INFINITY,
            Err(SyntheticError::OutOfRange { .. }) => 0.0,
            Err(error) => return Err(error),
        };
        if size.is_finite() {
            largest = largest.max(size);
        }
        if (size / rms - 1.0).abs() < PRECISION {
            return Ok(scaled);
        }
        if size < rms {
            weak = strength
        } else {
            strong = strength
        }
        if weak > NEARLY_ALL {
            break;
        }
    }
    Err(SyntheticError::Weak { effect: effect.kind(), car: follower + 1, wanted: rms, largest })
}
