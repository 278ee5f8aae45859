//! Driving a scenario and measuring it.

use super::drive::{follow, platoon};
use super::error::SyntheticError;
use super::history::History;
use super::noise::{Purpose, Stream};
use super::road::{GradeProfile, Hills};
use super::scenario::{Scenario, Truth};
use super::set_speed::SetSpeed;

/// A measured synthetic drive, cars front to back; every vector of samples is as long as `t`.
#[derive(Debug, Clone, PartialEq, serde::Serialize)]
pub struct Synthetic {
    /// Time \[s\], from 0.
    pub t: Vec<f64>,
    /// Measured speed of every car \[m/s\]; a magnitude, as from a Doppler sensor, so never negative.
    pub v: Vec<Vec<f64>>,
    /// Measured bumper-to-bumper gap of every link \[m\]: `gap[0]` between cars 1 and 2.
    pub gap: Vec<Vec<f64>>,
    /// True position of every car's front bumper along the road \[m\], not wrapped at the end of a lap.
    pub x: Vec<Vec<f64>>,
    /// True acceleration of every car \[m/s²\].
    pub a: Vec<Vec<f64>>,
    /// True sine of the road grade under every car.
    pub sin_grade: Vec<Vec<f64>>,
    /// Road grade over one lap.
    pub grade: GradeProfile,
    /// The drive without measurement errors.
    pub truth: Truth,
}

/// Drives a scenario. The same scenario gives the same numbers. Fails for a quantity out of its range, or a platoon that collides.
pub fn run(scenario: &Scenario) -> Result<Synthetic, SyntheticError> {
    scenario.check()?;
    let seed = scenario.seed;
    let (hills, set_speed) = given(scenario);
    let (h, per_sample) = scenario.step();
    let samples = samples(scenario);
    let histories = platoon(scenario, &hills, &set_speed, h, samples * per_sample)?;
    let steps: Vec<usize> = (0..=samples).map(|i| i * per_sample).collect();

    let x = signal(&histories, &steps, |history, step| history.get(step).x);
    let a = signal(&histories, &steps, |history, step| history.get(step).a);
    let mut v = signal(&histories, &steps, |history, step| history.get(step).v);
    for (car, speeds) in v.iter_mut().enumerate() {
        let mut stream = Stream::new(seed, Purpose::SpeedOfCar(car));
        for speed in speeds {
            *speed = (*speed + scenario.noise.speed_mps * stream.normal()).abs();
        }
    }
    let lengths = std::iter::once(scenario.lead.length).chain(scenario.followers.iter().map(|car| car.length));
    let gap = x
        .windows(2)
        .zip(lengths)
        .enumerate()
        .map(|(link, (pair, length))| {
            let mut stream = Stream::new(seed, Purpose::GapOfLink(link));
            let noise = scenario.noise.gap_m;
            pair[0].iter().zip(&pair[1]).map(|(ahead, own)| ahead - length - own + noise * stream.normal()).collect()
        })
        .collect();
    let sin_grade = x.iter().map(|x| x.iter().map(|&x| hills.sin_grade(x)).collect()).collect();
    Ok(Synthetic {
        // Quotients of whole numbers, so that 0.3 s is 0.3 and not 3 * 0.1.
        t: (0..=samples).map(|i| i as f64 / f64::from(scenario.rate_hz)).collect(),
        v,
        gap,
        x,
        a,
        sin_grade,
        grade: hills.profile(),
        truth: Truth { scenario: scenario.clone(), set_speed: set_speed.into_segments() },
    })
}

/// Perception of a follower, driven once, to try many cars behind it.
pub(super) struct Ahead {
    hills: Hills,
    cars: Vec<History>,
    follower: usize,
}

impl Ahead {
    /// The cars ahead of a follower (1 drives behind the platoon leader).
    pub(super) fn of(scenario: &Scenario, follower: usize) -> Result<Ahead, SyntheticError> {
        scenario.check()?;
        let (hills, set_speed) = given(scenario);
        let (h, per_sample) = scenario.step();
        let mut cars = platoon(scenario, &hills, &set_speed, h, samples(scenario) * per_sample)?;
        cars.truncate(follower);
        Ok(Ahead { hills, cars, follower })
    }

    /// True speed of the follower, sample by sample, in a scenario \[m/s\].
    pub(super) fn speed_behind(&self, scenario: &Scenario) -> Result<Vec<f64>, SyntheticError> {
        scenario.check()?;
        let (h, per_sample) = scenario.step();
        let samples = samples(scenario);
        let own = follow(scenario, self.follower, &self.cars, &self.hills, h, samples * per_sample)?;
        Ok((0..=samples).map(|i| own.get(i * per_sample).v).collect())
    }
}

/// The road, and the motion of the platoon leader.
fn given(scenario: &Scenario) -> (Hills, SetSpeed) {
    let seed = scenario.seed;
    let hills = Hills::new(&scenario.road, &mut Stream::new(scenario.road_seed.unwrap_or(seed), Purpose::Road));
    let set_speed = SetSpeed::new(&scenario.profile, scenario.duration_s, &mut Stream::new(seed, Purpose::SetSpeed));
    (hills, set_speed)
}

/// Samples behind the first.
fn samples(scenario: &Scenario) -> usize {
    (scenario.duration_s * f64::from(scenario.rate_hz)).floor() as usize
}

fn signal(histories: &[History], steps: &[usize], value: impl Fn(&History, usize) -> f64) -> Vec<Vec<f64>> {
    histories.iter().map(|history| steps.iter().map(|&step| value(history, step)).collect()).collect()
}
