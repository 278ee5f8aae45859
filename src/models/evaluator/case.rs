//! One trajectory for the runs of a variant under a convention.

use super::Share;
use crate::catalog::{Constraint, Variant};
use crate::convention::{Acceleration, Convention, Delay, Denominators, RoadLoad, Step};
use crate::score::{GoodnessOfFit, Measured};
use crate::symbols::{Bounds, Parameters, Symbol};
use crate::text::option::{BOUNDS, GRADE, VEHICLE};
use crate::trajectory::{Grade, Trajectory};
use crate::vehicle::Vehicle;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;

/// A trajectory prepared for simulation: measured signals, vehicle, grade and convention in one place.
#[derive(Debug, Clone)]
pub struct Case {
    /// The trajectory's label.
    pub label: Arc<str>,
    /// The variant it was prepared for.
    pub variant: Variant,
    pub convention: Convention,
    /// Time step Δt \[s\].
    pub dt: f64,
    /// Measured position of the preceding vehicle \[m\].
    pub x_l: Arc<[f64]>,
    /// Measured speed of the preceding vehicle \[m/s\].
    pub v_l: Arc<[f64]>,
    /// Length of the preceding vehicle \[m\].
    pub len_l: f64,
    /// Measured position of the follower \[m\].
    pub x_f: Arc<[f64]>,
    /// Measured speed of the follower \[m/s\].
    pub v_f: Arc<[f64]>,
    /// Acceleration of the follower \[m/s²\], differences of `v_f` by the convention.
    pub a_f: Arc<[f64]>,
    /// Measured spacing \[m\].
    pub s: Arc<[f64]>,
    /// The follower, if the variant needs it.
    pub vehicle: Option<Arc<Vehicle>>,
    /// The road, if the variant needs it.
    pub grade: Option<Arc<Grade>>,
    /// Time in the file at the first sample \[s\].
    pub t_0: f64,
    /// Acceleration of the preceding vehicle \[m/s²\], smoothed as extensions read it; `None`: it follows from `v_l`.
    pub a_l: Option<Arc<[f64]>>,
    /// Speed of the car ahead of the preceding vehicle \[m/s\], if measured.
    pub v_l2: Option<Arc<[f64]>>,
    /// Gap between those two \[m\], if measured.
    pub s_l2: Option<Arc<[f64]>>,
    /// Upper bound of τ_p \[s\]: with `delay=fractional` it fixes the scored window for every candidate.
    pub tau_p_upper: f64,
    /// Upper bound of the delay of an extension \[s\], if a search uses another one than the extension itself.
    pub extension_delay_upper: Option<f64>,
    /// No candidate is simulated or scored before this sample, however short its delay: variants that are compared then begin together.
    pub earliest: usize,
}

/// What supplies a signal that a variant lacks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Supply {
    Vehicle,
    Curve,
    Grade,
    Platoon,
}

impl fmt::Display for Supply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Supply::Vehicle => write!(f, "give {VEHICLE} NAME or FILE#NAME"),
            Supply::Curve => write!(
                f,
                "give {VEHICLE} FILE#NAME of a table that names an `mfc` file, or put mfc_SLUG.csv beside the table"
            ),
            Supply::Grade => write!(f, "give {GRADE} FILE, or {GRADE} level for a level road"),
            Supply::Platoon => {
                f.write_str("use a follower further back in the platoon, or give the column lead2_... of a pair file")
            }
        }
    }
}

/// A trajectory that a variant cannot run on.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum CaseError {
    #[error("{label}: variant {variant} needs {what}; {remedy}")]
    Missing { label: String, variant: String, what: &'static str, remedy: Supply },
    #[error("{label}: upper bound of {name}: expected a number of at least 0, found {found}")]
    DelayBound { label: String, name: &'static str, found: f64 },
    #[error("{label}: {samples} samples; variant {variant} starts at sample {first}, so at least {} are needed", first + 2)]
    TooShort { label: String, variant: String, samples: usize, first: usize },
}

/// A parameter vector that cannot be simulated.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum InvalidParameter {
    #[error("{name}: expected {expected}, found {found}")]
    Domain { name: &'static str, expected: String, found: f64 },
    #[error(
        "{name}: expected at most {upper} s, found {found}; the upper bound of {name} limits the memory of a simulation: raise it in a {BOUNDS} file"
    )]
    Delay {
        name: String,
        /// The longest delay possible \[s\].
        upper: f64,
        found: f64,
    },
}

impl Case {
    /// Checks that a candidate can be simulated, but not the bounds of a calibration. The error is the first parameter outside the domain of the
    /// equations, or a delay that reaches back before the data.
    pub fn check(&self, parameters: &Parameters) -> Result<(), InvalidParameter> {
        for symbol in self.variant.parameters() {
            let (found, domain) = (parameters.get(symbol), symbol.domain());
            if !domain.contains(found) {
                return Err(InvalidParameter::Domain { name: symbol.name(), expected: domain.expected(), found });
            }
        }
        let (upper, found) = (self.longest_delay(), self.delay(parameters));
        if found > upper {
            return Err(InvalidParameter::Delay { name: self.delay_name(), upper, found });
        }
        Ok(())
    }

    /// A piece of it, without the measurements before and after.
    pub fn part(&self, range: Range<usize>) -> Case {
        let own = |signal: &Arc<[f64]>| -> Arc<[f64]> { signal[range.clone()].into() };
        Case {
            x_l: own(&self.x_l),
            v_l: own(&self.v_l),
            x_f: own(&self.x_f),
            v_f: own(&self.v_f),
            a_f: own(&self.a_f),
            s: own(&self.s),
            t_0: self.t_0 + range.start as f64 * self.dt,
            a_l: self.a_l.as_ref().map(own),
            v_l2: self.v_l2.as_ref().map(own),
            s_l2: self.s_l2.as_ref().map(own),
            earliest: self.earliest.saturating_sub(range.start),
            ..self.clone()
        }
    }

    /// Prepares a trajectory for a variant. `tau_p_upper` is the upper bound of the perception delay \[s\] (0.8 in Table 3). Fails if the variant
    /// needs a vehicle, an MFC curve or a grade that is not given, or the data are too short.
    pub fn new(
        trajectory: &Trajectory,
        variant: Variant,
        vehicle: Option<&Vehicle>,
        convention: Convention,
        tau_p_upper: f64,
    ) -> Result<Case, CaseError> {
        Case::within(trajectory, variant, vehicle, convention, (tau_p_upper, None))
    }

    /// The same with the upper bound of the delay of an extension \[s\] besides; `None`: the extension's own.
    pub fn within(
        trajectory: &Trajectory,
        variant: Variant,
        vehicle: Option<&Vehicle>,
        convention: Convention,
        (tau_p_upper, extension_delay_upper): (f64, Option<f64>),
    ) -> Result<Case, CaseError> {
        let dt = match convention.step {
            Step::Nominal => trajectory.dt,
            Step::Raw => trajectory.dt_raw,
        };
        let case = Case {
            label: trajectory.label.as_str().into(),
            variant,
            convention,
            dt,
            x_l: trajectory.x_l.as_slice().into(),
            v_l: trajectory.v_l.as_slice().into(),
            len_l: trajectory.len_l,
            x_f: trajectory.x_f.as_slice().into(),
            v_f: trajectory.v_f.as_slice().into(),
            a_f: differences(&trajectory.v_f, dt, convention.acceleration).into(),
            s: trajectory.s.as_slice().into(),
            vehicle: vehicle.cloned().map(Arc::new),
            grade: trajectory.grade.clone().map(Arc::new),
            t_0: trajectory.t.first().copied().unwrap_or(0.0),
            a_l: None,
            v_l2: trajectory.v_l2.as_deref().map(Arc::from),
            s_l2: trajectory.s_l2.as_deref().map(Arc::from),
            tau_p_upper,
            extension_delay_upper,
            earliest: 1,
        };
        case.for_variant(variant)
    }

    /// The same case with another upper bound of the delay of an extension \[s\] than the extension's own, as
    /// [`crate::calibrate::SearchSpace::extension_delay_upper`] has it.
    pub fn with_extension_delay(self, extension_delay_upper: Option<f64>) -> Result<Case, CaseError> {
        Case { extension_delay_upper, ..self }.for_variant(self.variant)
    }

    /// The same case with this time at the start \[s\] in which the car is the measured one.
    pub fn with_history(self, history_s: Option<f64>) -> Result<Case, CaseError> {
        let Some(seconds) = history_s else { return Ok(self) };
        // As in `first_sample`.
        let earliest = ((seconds / self.dt - 1e-9).ceil() as usize).saturating_add(1);
        Case { earliest, ..self }.for_variant(self.variant)
    }

    /// The same case for another variant; the measured signals are shared, not copied.
    pub fn for_variant(&self, variant: Variant) -> Result<Case, CaseError> {
        let missing =
            |what, remedy| CaseError::Missing { label: self.label.to_string(), variant: variant.name(), what, remedy };
        if variant.needs_vehicle() && self.vehicle.is_none() {
            return Err(missing("the follower's vehicle", Supply::Vehicle));
        }
        if variant.constraint == Constraint::Mfc && self.vehicle.as_ref().is_some_and(|v| v.mfc.is_none()) {
            return Err(missing("the vehicle's MFC curve", Supply::Curve));
        }
        if variant.needs_grade() && self.grade.is_none() {
            return Err(missing("the road grade", Supply::Grade));
        }
        for (member, signal, what) in [
            ("v_l2", &self.v_l2, "the speed of the car ahead of the preceding vehicle"),
            ("s_l2", &self.s_l2, "the gap between the two cars ahead"),
        ] {
            if variant.extensions.read(member) && signal.as_ref().is_none_or(|y| y.iter().any(|x| !x.is_finite())) {
                return Err(missing(what, Supply::Platoon));
            }
        }
        let extension = variant.extensions.delay().zip(self.extension_delay_upper);
        for (symbol, found) in [(Symbol::tau_p, self.tau_p_upper)].into_iter().chain(extension) {
            if !symbol.domain().contains(found) {
                return Err(CaseError::DelayBound { label: self.label.to_string(), name: symbol.name(), found });
            }
        }
        let case = Case { variant, ..self.clone() };
        let first = case.first_sample(case.longest_delay());
        if case.s.len() < first + 2 {
            let (label, variant) = (case.label.to_string(), variant.name());
            return Err(CaseError::TooShort { label, variant, samples: case.s.len(), first });
        }
        Ok(case)
    }

    /// Its share in the score of several cases, from the first sample that any candidate is scored on.
    pub fn share(&self, gof: &GoodnessOfFit) -> Share {
        let floored = self.convention.denominators == Denominators::Floored;
        let of = |signal: &[f64], floored| Measured::of(&signal[self.earliest.min(signal.len())..], floored);
        let weight = || gof.weight(&[of(&self.s, false), of(&self.v_f, floored), of(&self.a_f, false)]);
        Share { samples: self.s.len(), weight: gof.is_pooled().then(weight).flatten() }
    }

    /// Perception delay of a candidate \[s\]: τ_p and that of an extension. NaN counts as 0, and a run marks such a
    /// candidate; so does a negative one, which [`Case::check`] refuses.
    pub fn delay(&self, parameters: &Parameters) -> f64 {
        let part = |has: bool, value: f64| if has && value.is_finite() { value.max(0.0) } else { 0.0 };
        let extension = self.variant.extensions.delay().map_or(0.0, |symbol| part(true, parameters.get(symbol)));
        part(self.variant.delay, parameters.tau_p) + extension
    }

    /// The longest perception delay that is remembered \[s\].
    pub fn longest_delay(&self) -> f64 {
        let base = if self.variant.delay { self.tau_p_upper } else { 0.0 };
        let bounds =
            |symbol: Symbol| self.extension_delay_upper.map_or(symbol.bounds(), |upper| Bounds::Fixed(upper, upper));
        let extension = self.variant.extensions.delay().map(bounds);
        base + extension.map_or(0.0, |bounds| if let Bounds::Fixed(_, upper) = bounds { upper } else { 0.0 })
    }

    /// Source of the perception delay, for messages: `tau_p`, the parameter of an extension, or both.
    pub fn delay_name(&self) -> String {
        let base = self.variant.delay.then_some(Symbol::tau_p);
        let names: Vec<&str> = base.into_iter().chain(self.variant.extensions.delay()).map(Symbol::name).collect();
        names.join(" + ")
    }

    /// A perception delay \[s\] in samples.
    pub fn delay_steps(&self, delay: f64) -> f64 {
        match (self.variant.perceives_late(), self.convention.delay) {
            (false, _) => 0.0,
            (true, Delay::Fractional) => delay / self.dt,
            (true, Delay::Floor) => (delay / self.dt).floor(),
        }
    }

    /// The first simulated and scored sample of a candidate with this perception delay \[s\].
    pub fn first_sample(&self, delay: f64) -> usize {
        let whole = match self.convention.delay {
            Delay::Floor => self.delay_steps(delay),
            // 1e-9: 0.8 s / 0.1 s must be 8 samples and not 9, whatever the last bit of the quotient.
            Delay::Fractional => (self.delay_steps(self.longest_delay()) - 1e-9).ceil(),
        };
        (whole as usize + 1).max(self.earliest)
    }

    /// Bounds of a parameter for this vehicle and convention: Table 3; `None` for road loads without a vehicle.
    pub fn bounds(symbol: Symbol, vehicle: Option<&Vehicle>, convention: Convention) -> Option<[f64; 2]> {
        // 3.6 and 12.96 = 3.6²: km/h per m/s.
        let in_si = |[lower, upper]: [f64; 2], factor: f64| match convention.road_load {
            RoadLoad::Si => [lower * factor, upper * factor],
            RoadLoad::Printed => [lower, upper],
        };
        match (symbol.bounds(), symbol) {
            (Bounds::Fixed(lower, upper), _) => Some([lower, upper]),
            (Bounds::PerVehicle, Symbol::f_0) => vehicle.map(|v| v.f_0),
            (Bounds::PerVehicle, Symbol::f_1) => vehicle.map(|v| in_si(v.f_1_printed, 3.6)),
            (Bounds::PerVehicle, Symbol::f_2) => vehicle.map(|v| in_si(v.f_2_printed, 12.96)),
            (Bounds::PerVehicle, _) => None,
        }
    }
}

/// Acceleration from speeds \[m/s²\]. The sample without a neighbour gets the next one's value (backward) or 0 (forward, as in the authors'
/// program).
pub(super) fn differences(v: &[f64], dt: f64, rule: Acceleration) -> Vec<f64> {
    let forward = v.windows(2).map(|w| (w[1] - w[0]) / dt);
    match rule {
        Acceleration::Backward => {
            let first = forward.clone().next().unwrap_or(0.0);
            std::iter::once(first).chain(forward).collect()
        }
        Acceleration::Forward => forward.chain([0.0]).collect(),
    }
}
