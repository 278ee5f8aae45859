//! The box of parameters that a calibration searches.

use crate::catalog::Variant;
use crate::convention::Convention;
use crate::evaluator::Case;
use crate::optimize::SearchBox;
use crate::symbols::{Bounds, Parameters, Symbol};
use crate::text::option::VEHICLE;
use crate::text::spelling::did_you_mean;
use crate::vehicle::Vehicle;
use std::collections::BTreeMap;
use std::path::Path;

/// Bounds and fixed values of every parameter of a variant.
#[derive(Debug, Clone, PartialEq)]
pub struct SearchSpace {
    /// The parameters, in the order of the symbol table.
    pub symbols: Vec<Symbol>,
    /// Lower and upper bound of each; equal where the parameter is fixed.
    pub bounds: Vec<[f64; 2]>,
}

/// Bounds by parameter name; equal bounds fix a parameter.
pub type Overrides = BTreeMap<String, [f64; 2]>;

/// Bounds the time and duration of an event of an extension by the window of the data \[s\], unless the user sets bounds. The bounds of the
/// extension itself cover a day, because its author does not know these data.
pub fn bound_times(variant: &Variant, window: [f64; 2], overrides: &mut Overrides) {
    let [first, last] = window;
    for symbol in variant.parameters().into_iter().filter(|symbol| symbol.is_time()) {
        let Bounds::Fixed(lower, upper) = symbol.bounds() else { continue };
        let length = [lower.max(0.0), (last - first).min(upper)];
        let bounds = if symbol.is_length_of_time() { length } else { symbol.begins_within(window) };
        overrides.entry(symbol.name().to_owned()).or_insert(bounds);
    }
}

/// Invalid bounds.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[allow(missing_docs, reason = "the message of each variant says what its fields hold")]
pub enum BoundsError {
    #[error("{path}: cannot read the bounds: {reason}")]
    Read { path: String, reason: String },
    #[error("{path}: expected bounds as TOML, such as v_0 = [25, 40]: {reason}")]
    Text { path: String, reason: String },
    #[error(
        "{path}: {name} is not a parameter of any variant; `leadlag list parameters` shows them{}",
        did_you_mean(name, Symbol::ALL.iter().map(|symbol| symbol.name()))
    )]
    NoParameter { path: String, name: String },
    #[error("{path}: {name}: expected [lower, upper], or one number to fix it; found {found}")]
    Entry { path: String, name: String, found: String },
    #[error("{0}: Table 3 gives its bounds per vehicle; give {VEHICLE} NAME or FILE#NAME")]
    Vehicle(&'static str),
    #[error(
        "{name} is not a parameter of variant {variant}, which has {}{}",
        known.join(", "),
        did_you_mean(name, known.iter().copied())
    )]
    Unknown { name: String, variant: String, known: Vec<&'static str> },
    #[error("{name}: expected {expected}{}", found([*lower, *upper]))]
    Impossible { name: &'static str, expected: String, lower: f64, upper: f64 },
}

impl SearchSpace {
    /// Table 3 for a variant, a vehicle and a convention, overridden by name; a fixed value is a pair of equal bounds.
    ///
    /// # Errors
    /// A name that the variant does not have, invalid bounds, road loads without vehicle or own bounds.
    pub fn new(
        variant: &Variant,
        vehicle: Option<&Vehicle>,
        convention: Convention,
        overrides: &Overrides,
    ) -> Result<SearchSpace, BoundsError> {
        let symbols = variant.parameters();
        if let Some(name) = overrides.keys().find(|name| !symbols.iter().any(|s| s.name() == name.as_str())) {
            let known = symbols.iter().map(|s| s.name()).collect();
            return Err(BoundsError::Unknown { name: name.clone(), variant: variant.name(), known });
        }
        let mut bounds = Vec::new();
        for &symbol in &symbols {
            let table = Case::bounds(symbol, vehicle, convention);
            let [lower, upper] =
                overrides.get(symbol.name()).copied().or(table).ok_or(BoundsError::Vehicle(symbol.name()))?;
            bounds.push(checked(symbol, [lower, upper])?);
        }
        Ok(SearchSpace { symbols, bounds })
    }

    /// Upper bound of the perception delay \[s\]; 0 for variants without.
    #[must_use]
    pub fn tau_p_upper(&self) -> f64 {
        let delay = self.symbols.iter().position(|s| *s == Symbol::tau_p);
        delay.map_or(0.0, |i| self.bounds[i][1])
    }

    /// Upper bound of the delay of an extension \[s\]; `None` for variants without, see [`Case::with_extension_delay`].
    #[must_use]
    pub fn extension_delay_upper(&self) -> Option<f64> {
        self.symbols.iter().position(|symbol| symbol.is_delay()).map(|i| self.bounds[i][1])
    }

    /// Positions of the parameters that are searched.
    #[must_use]
    pub fn free(&self) -> Vec<usize> {
        (0..self.bounds.len()).filter(|&i| self.bounds[i][0] < self.bounds[i][1]).collect()
    }

    /// Coordinates of the search: the parameters themselves or, with `ratios`, the logarithms of those that span decades.
    pub(super) fn search_box(&self, ratios: bool) -> SearchBox {
        let free = self.free();
        let bound = |i: usize, k: usize| {
            let bound = self.bounds[i][k];
            if ratios && self.spans_decades(i) { bound.ln() } else { bound }
        };
        SearchBox {
            lower: free.iter().map(|&i| bound(i, 0)).collect(),
            upper: free.iter().map(|&i| bound(i, 1)).collect(),
        }
    }

    /// The share of the searched range of parameter `i` that an interval covers; of the logarithm where that is searched, as all optimisers but
    /// `ga` do.
    #[must_use]
    pub fn share_of_range(&self, i: usize, interval: [f64; 2]) -> f64 {
        let along = |x: f64| if self.spans_decades(i) { x.ln() } else { x };
        let ([lower, upper], [low, high]) = (self.bounds[i].map(along), interval.map(along));
        if upper > lower { (high - low) / (upper - lower) } else { 0.0 }
    }

    /// True for a positive parameter whose bounds are more than two decades apart: equal differences would rarely try the
    /// lower ones. Of Table 3 these are the gains of the linear controllers.
    fn spans_decades(&self, i: usize) -> bool {
        let [lower, upper] = self.bounds[i];
        lower > 0.0 && upper > 100.0 * lower
    }

    /// A point of the search box as a candidate, with the fixed parameters filled in.
    pub(super) fn complete(&self, free: &[usize], point: &[f64], ratios: bool) -> Vec<f64> {
        let mut candidate: Vec<f64> = self.bounds.iter().map(|b| b[0]).collect();
        for (&i, &x) in free.iter().zip(point) {
            let [lower, upper] = self.bounds[i];
            // The exponential of a logarithm may be off a bound by a rounding.
            candidate[i] = match ratios && self.spans_decades(i) {
                false => x,
                true if x <= lower.ln() => lower,
                true if x >= upper.ln() => upper,
                true => x.exp().clamp(lower, upper),
            };
        }
        candidate
    }

    /// Named parameters of a candidate.
    #[must_use]
    pub fn parameters(&self, candidate: &[f64]) -> Parameters {
        let mut parameters = Parameters::NONE;
        for (&symbol, &value) in self.symbols.iter().zip(candidate) {
            parameters.set(symbol, value);
        }
        parameters
    }

    /// The parameters that lie on a bound: within 0.1 % of the range, without fixed ones. If a parameter spans decades, the range is that
    /// of the logarithm, as all optimisers except `ga` search it: for 0.01 to 5, 0.1 % of the difference would be half of the lower bound,
    /// although 0.015 is not on it.
    #[must_use]
    pub fn at_bound(&self, candidate: &[f64]) -> Vec<Symbol> {
        let near = |&i: &usize| {
            let along = |x: f64| if self.spans_decades(i) { x.ln() } else { x };
            let ([lower, upper], x) = (self.bounds[i].map(along), along(candidate[i]));
            let margin = 1e-3 * (upper - lower);
            x - lower <= margin || upper - x <= margin
        };
        self.free().into_iter().filter(near).map(|i| self.symbols[i]).collect()
    }
}

/// The end of a message on bounds; equal ones are a fixed value.
fn found([lower, upper]: [f64; 2]) -> String {
    if lower == upper {
        return format!(", found {lower}");
    }
    format!(" as both bounds, the lower one not above the upper one; found [{lower}, {upper}]")
}

/// Bounds that are in order and in the domain of the equations.
///
/// # Errors
/// [`BoundsError::Impossible`].
pub fn checked(symbol: Symbol, [lower, upper]: [f64; 2]) -> Result<[f64; 2], BoundsError> {
    let domain = symbol.domain();
    if domain.contains(lower) && domain.contains(upper) && lower <= upper {
        return Ok([lower, upper]);
    }
    Err(BoundsError::Impossible { name: symbol.name(), expected: domain.expected(), lower, upper })
}

/// Reads a TOML file of bounds: `v_0 = [25, 40]`, or `tau_p = 0.3` to fix a parameter; it may name parameters of the extensions
/// of a variant, too.
///
/// # Errors
/// For a file that cannot be read, is not TOML, or has an entry that is neither a pair of numbers nor a number.
pub fn read_bounds(path: &Path, variant: &Variant) -> Result<Overrides, BoundsError> {
    let shown = path.display().to_string();
    let text = crate::text::bounded::read_to_string(path, crate::text::bounded::TEXT_MAX)
        .map_err(|e| BoundsError::Read { path: shown.clone(), reason: e.to_string() })?;
    parse_bounds(&text, &shown, variant)
}

/// The same from a text; `shown` stands for the file in messages.
pub(super) fn parse_bounds(text: &str, shown: &str, variant: &Variant) -> Result<Overrides, BoundsError> {
    let table: toml::Table = toml::from_str(text)
        .map_err(|e| BoundsError::Text { path: shown.to_owned(), reason: e.to_string().trim_end().to_owned() })?;
    let number = |value: &toml::Value| value.as_float().or(value.as_integer().map(|i| i as f64));
    let mut overrides = Overrides::new();
    for (name, value) in &table {
        let pair = match value.as_array().map(Vec::as_slice) {
            Some([lower, upper]) => number(lower).zip(number(upper)).map(|(lower, upper)| [lower, upper]),
            Some(_) => None,
            None => number(value).map(|x| [x, x]),
        };
        let entry = || BoundsError::Entry { path: shown.to_owned(), name: name.clone(), found: value.to_string() };
        let own = variant.parameters().into_iter().find(|symbol| symbol.name() == name);
        let symbol = own
            .or_else(|| Symbol::from_name(name))
            .ok_or_else(|| BoundsError::NoParameter { path: shown.to_owned(), name: name.clone() })?;
        overrides.insert(name.clone(), checked(symbol, pair.ok_or_else(entry)?)?);
    }
    Ok(overrides)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gains_of_linear_laws_are_searched_in_ratios_and_keep_their_bounds() {
        let variant: Variant = "l-cth".parse().expect("a base");
        let space = SearchSpace::new(&variant, None, Convention::PAPER, &Overrides::new()).expect("Table 3");
        let (free, found) = (space.free(), space.search_box(true));
        let names: Vec<&str> = free.iter().map(|&i| space.symbols[i].name()).collect();
        let logarithmic = |k: &usize| found.lower[*k] == space.bounds[free[*k]][0].ln();
        let in_ratios: Vec<&str> = (0..free.len()).filter(logarithmic).map(|k| names[k]).collect();
        assert_eq!(in_ratios, ["k_s", "k_v", "k_0"]);
        // The bounds are recovered to the bit; the middle of 0.01 and 5 in ratios is sqrt(0.05).
        assert_eq!(space.complete(&free, &found.lower, true), space.bounds.iter().map(|b| b[0]).collect::<Vec<_>>());
        assert_eq!(space.complete(&free, &found.upper, true), space.bounds.iter().map(|b| b[1]).collect::<Vec<_>>());
        let middle: Vec<f64> = found.lower.iter().zip(&found.upper).map(|(low, high)| 0.5 * (low + high)).collect();
        let k_s = space.complete(&free, &middle, true)[free[0]];
        assert!((k_s - 0.05_f64.sqrt()).abs() < 1e-12, "{k_s}");
        // The paper's algorithm sees the parameters themselves.
        assert_eq!(space.search_box(false).upper[0], 5.0);
        assert_eq!(space.complete(&free, &space.search_box(false).lower, false)[free[0]], 0.01);
    }

    #[test]
    fn a_gain_is_on_a_bound_by_its_ratio_to_it() {
        let variant: Variant = "l-cth".parse().expect("a base");
        let space = SearchSpace::new(&variant, None, Convention::PAPER, &Overrides::new()).expect("Table 3");
        let on_bound = |k_s: f64, v_0: f64| {
            let middle = |symbol: &Symbol, bounds: &[f64; 2]| match symbol {
                Symbol::k_s => k_s,
                Symbol::v_0 => v_0,
                _ => 0.5 * (bounds[0] + bounds[1]),
            };
            let candidate: Vec<f64> = space.symbols.iter().zip(&space.bounds).map(|(s, b)| middle(s, b)).collect();
            space.at_bound(&candidate)
        };
        let v_0 = space.bounds[space.symbols.iter().position(|s| *s == Symbol::v_0).expect("it has one")];
        let inside = 0.5 * (v_0[0] + v_0[1]);
        assert_eq!(on_bound(0.01, inside), [Symbol::k_s]);
        assert_eq!(on_bound(0.01 * 1.006, inside), [Symbol::k_s]);
        assert_eq!(on_bound(0.0101, inside), [], "a hundredth above the bound");
        assert_eq!(on_bound(4.98, inside), [Symbol::k_s]);
        assert_eq!(on_bound(1.0, v_0[1] - 0.9e-3 * (v_0[1] - v_0[0])), [Symbol::v_0]);
        assert_eq!(on_bound(1.0, v_0[1] - 1.1e-3 * (v_0[1] - v_0[0])), []);
    }

    /// A user's event, whose length has another name than that of the built-in one.
    const PAUSE: &str = "struct Parameters {
    /// when it begins [s], 0 to 100000
    start: f32,
    /// how long it lasts [s], 1 to 100000, length of time
    lasting: f32,
}
fn pause_command(own: Parameters, w: World, a_cmd: f32) -> f32 {
    let since = w.t - own.start;
    return select(a_cmd, 0.0, since >= 0.0 && since < own.lasting);
}
";

    #[test]
    fn events_are_bounded_by_the_window_whatever_its_clock() {
        let base: Variant = "idm".parse().expect("a base");
        let own = crate::wgsl::read_extension("pause.wgsl", PAUSE).expect("valid");
        let built_in = crate::wgsl::extension_named("set_speed_change").expect("built in");
        for (extension, begin, length) in [(own, "start", "lasting"), (built_in, "t1", "dur")] {
            let variant = base.with(extension).expect("no conflict");
            // Times of a clock that counts from 0, from the middle of a recording, from 1970, and to an event.
            for [first, last] in [[0.0, 200.0], [50.0, 250.0], [1.1e9, 1.1e9 + 200.0], [-300.0, -10.0], [-5.0, 100.0]] {
                let mut overrides = Overrides::new();
                bound_times(&variant, [first, last], &mut overrides);
                assert_eq!(overrides[begin], [first, last]);
                assert_eq!(overrides[length], [1.0, last - first]);
                assert!(SearchSpace::new(&variant, None, Convention::PAPER, &overrides).is_ok(), "{first}");
            }
        }
    }
}
