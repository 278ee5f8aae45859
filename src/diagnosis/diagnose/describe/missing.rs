//! The missing acceleration d(t), with its uncertainty, against speed, leader acceleration, grade, gap error and place.

use super::covariates::Covariates;
use crate::diagnose::policy::POLICY;

/// Number of classes of a profile; a profile by place has as many as the road needs.
const CLASSES: usize = 12;
/// Name of the profile by place.
pub const PLACE: &str = "place";
/// Length of a class of place \[m\].
const PLACE_CLASS_M: f64 = 60.0;
/// A class needs this much time \[s\].
const CLASS_MIN_S: f64 = 5.0;
/// Places that two drives must share before their profiles are compared.
const COMMON_PLACES: usize = 10;

/// Correlations above this many standard deviations are not chance: fewer than one in a hundred of unrelated sets of two to five drives
/// exceed it, however long errors last.
const NOT_CHANCE: f64 = 2.8;

/// d(t) of one drive.
#[derive(Debug, Clone, Copy)]
pub struct Missing<'a> {
    /// The quantities at each sample.
    pub scene: &'a Covariates,
    /// Missing acceleration \[m/s²\], one per sample; NaN if undefined.
    pub d: &'a [f64],
    /// Gap minus desired gap \[m\], if the model has a desired gap.
    pub gap_error: Option<&'a [f64]>,
}

/// A class of a profile.
#[derive(Debug, Clone, Copy, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Class {
    /// Its number; the next class begins where this one ends. `None` in older results.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub number: Option<usize>,
    /// Mean of the quantity in the class.
    pub at: f64,
    /// Mean of d \[m/s²\].
    pub mean: f64,
    /// Standard error of that mean.
    pub error: f64,
    /// Time in the class \[s\].
    pub seconds: f64,
}

/// d against one quantity.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Profile {
    /// The quantity.
    pub name: String,
    /// Its unit.
    pub unit: String,
    /// Classes in rising order of the quantity.
    pub classes: Vec<Class>,
    /// Share of the variance of d that the class means explain.
    pub explained: f64,
    /// Mean chi-squared of the class means against their common mean: about 1 without a dependence.
    pub chi2: f64,
}

/// All profiles of d.
#[derive(Debug, Clone, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct Profiles {
    /// Root mean square of d \[m/s²\].
    pub rms: f64,
    /// Profiles against each known quantity.
    pub profiles: Vec<Profile>,
    /// Mean correlation between drives of the profiles by place; `None` for one drive, or without places.
    pub repeats_by_place: Option<f64>,
    /// Standard deviation of that correlation between drives that have nothing in common, of more than two drives that of a symmetric
    /// distribution with the same upper tail.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub repeats_by_chance: Option<f64>,
}

impl Profiles {
    /// The correlation by place, if it is not chance.
    #[must_use]
    pub fn repeats(&self) -> Option<f64> {
        let (repeats, chance) = self.repeats_by_place.zip(self.repeats_by_chance)?;
        (repeats > NOT_CHANCE * chance).then_some(repeats)
    }
}

/// A quantity at each sample, if it is known.
type Quantity = fn(&Missing) -> Option<Vec<f64>>;

/// Sorts d; `None` without a value.
#[must_use]
pub fn profiles(drives: &[Missing]) -> Option<Profiles> {
    let values = || drives.iter().flat_map(|drive| drive.d).filter(|d| d.is_finite());
    let count = values().count();
    if count == 0 {
        return None;
    }
    let rms = (values().map(|d| d * d).sum::<f64>() / count as f64).sqrt();
    let quantities: [(&str, &str, Quantity); 5] = [
        ("speed", "m/s", |m| Some(m.scene.v.clone())),
        ("acceleration of the car ahead", "m/s²", |m| Some(m.scene.a_l.clone())),
        ("sine of the grade", "-", |m| m.scene.sin_grade.clone()),
        ("gap error", "m", |m| m.gap_error.map(<[f64]>::to_vec)),
        (PLACE, "m", |m| m.scene.place.clone()),
    ];
    let profiles = quantities
        .into_iter()
        .filter_map(|(name, unit, quantity)| {
            let sorted: Option<Vec<(Vec<f64>, &Missing)>> =
                drives.iter().map(|drive| Some((quantity(drive)?, drive))).collect();
            let edges = if name == PLACE { None } else { Some(quantiles(sorted.as_ref()?)) };
            profile(name, unit, &sorted?, edges)
        })
        .collect();
    let (repeats_by_place, repeats_by_chance) = repeats_by_place(drives).unzip();
    Some(Profiles { rms, profiles, repeats_by_place, repeats_by_chance })
}

/// Edges of classes with equally many samples.
fn quantiles(sorted: &[(Vec<f64>, &Missing)]) -> Vec<f64> {
    let with_d = sorted.iter().flat_map(|(q, m)| q.iter().zip(m.d));
    let mut all: Vec<f64> = with_d.filter(|(q, d)| q.is_finite() && d.is_finite()).map(|(q, _)| *q).collect();
    all.sort_by(f64::total_cmp);
    let mut edges: Vec<f64> = (1..CLASSES).filter_map(|k| all.get(k * all.len() / CLASSES).copied()).collect();
    edges.dedup();
    edges
}

fn profile(name: &str, unit: &str, drives: &[(Vec<f64>, &Missing)], edges: Option<Vec<f64>>) -> Option<Profile> {
    let class_of = |q: f64| match &edges {
        Some(edges) => edges.partition_point(|edge| *edge <= q),
        None => (q / PLACE_CLASS_M).floor().max(0.0) as usize,
    };
    // Sums over each block, by class, so that correlated samples of a block count once.
    let mut classes: std::collections::BTreeMap<usize, Vec<[f64; 3]>> = std::collections::BTreeMap::new();
    let mut seconds = std::collections::BTreeMap::new();
    for (q, missing) in drives {
        let block = ((POLICY.block / missing.scene.dt).round() as usize).max(1);
        for start in (0..missing.d.len()).step_by(block) {
            let mut sums: std::collections::BTreeMap<usize, [f64; 3]> = std::collections::BTreeMap::new();
            for (q, d) in q.iter().zip(missing.d).skip(start).take(block) {
                if q.is_finite() && d.is_finite() {
                    let sum = sums.entry(class_of(*q)).or_default();
                    *sum = [sum[0] + 1.0, sum[1] + d, sum[2] + q];
                    *seconds.entry(class_of(*q)).or_insert(0.0) += missing.scene.dt;
                }
            }
            for (class, sum) in sums {
                classes.entry(class).or_default().push(sum);
            }
        }
    }
    let classes: Vec<Class> = classes
        .into_iter()
        .filter(|(k, blocks)| blocks.len() > 1 && seconds[k] >= if edges.is_some() { CLASS_MIN_S } else { 1.0 })
        .map(|(k, blocks)| {
            let n: f64 = blocks.iter().map(|b| b[0]).sum();
            let mean = blocks.iter().map(|b| b[1]).sum::<f64>() / n;
            let at = blocks.iter().map(|b| b[2]).sum::<f64>() / n;
            let spread: f64 = blocks.iter().map(|b| (b[1] - mean * b[0]).powi(2)).sum();
            let few = blocks.len() as f64 / (blocks.len() as f64 - 1.0);
            Class { number: Some(k), at, mean, error: (spread * few).sqrt() / n, seconds: seconds[&k] }
        })
        .collect();
    if classes.len() < 3 {
        return None;
    }
    let all: f64 = classes.iter().map(|c| c.seconds).sum();
    let mean = classes.iter().map(|c| c.mean * c.seconds).sum::<f64>() / all;
    let between = classes.iter().map(|c| (c.mean - mean).powi(2) * c.seconds).sum::<f64>() / all;
    let d = drives.iter().flat_map(|(_, m)| m.d).filter(|d| d.is_finite());
    let (sum, n) = d.fold((0.0, 0.0), |(sum, n), d| (sum + (d - mean).powi(2), n + 1.0));
    let weights = || classes.iter().map(|c| c.error.max(1e-9).powi(-2));
    let centre = classes.iter().zip(weights()).map(|(c, w)| c.mean * w).sum::<f64>() / weights().sum::<f64>();
    let chi2 = classes.iter().zip(weights()).map(|(c, w)| (c.mean - centre).powi(2) * w).sum::<f64>();
    Some(Profile {
        name: name.to_owned(),
        unit: unit.to_owned(),
        explained: if sum > 0.0 { (between * n / sum).min(1.0) } else { 0.0 },
        chi2: chi2 / (classes.len() as f64 - 1.0),
        classes,
    })
}

/// Mean correlation of d by place over all pairs of drives, and its standard deviation if the drives are unrelated.
fn repeats_by_place(drives: &[Missing]) -> Option<(f64, f64)> {
    let profile = |missing: &Missing| {
        let place = missing.scene.place.as_ref()?;
        let mut sums: std::collections::BTreeMap<usize, (f64, f64)> = std::collections::BTreeMap::new();
        for (x, d) in place.iter().zip(missing.d).filter(|(_, d)| d.is_finite()) {
            let sum = sums.entry((x / PLACE_CLASS_M).floor().max(0.0) as usize).or_default();
            *sum = (sum.0 + d, sum.1 + 1.0);
        }
        Some(sums.into_iter().map(|(k, (sum, n))| (k, sum / n)).collect::<std::collections::BTreeMap<_, _>>())
    };
    let all: Vec<_> = drives.iter().filter_map(profile).collect();
    let mut found = Vec::new();
    for (i, a) in all.iter().enumerate() {
        for b in &all[i + 1..] {
            let pairs: Vec<(f64, f64)> = a.iter().filter_map(|(k, x)| Some((*x, *b.get(k)?))).collect();
            if pairs.len() >= COMMON_PLACES {
                found.extend(correlation(&pairs));
            }
        }
    }
    let count = found.len() as f64;
    let sum = |of: fn(&[f64; 2]) -> f64| found.iter().map(of).sum::<f64>();
    // The correlations of unrelated drives are uncorrelated, also of two pairs with a drive in common.
    let variance = sum(|[_, variance]| *variance);
    let chance = variance.sqrt() / count * widening(all.len() as f64, variance / count);
    (!found.is_empty()).then(|| (sum(|[r, _]| *r) / count, chance))
}

/// How much further than that of a normal distribution the upper tail of a mean correlation reaches. Between the pairs of three drives the
/// correlations are uncorrelated, but the mean of their product is the square of their variance: the mean of many is skewed. By Wilson and
/// Hilferty (1931), for a gamma distribution of that skewness.
fn widening(drives: f64, variance: f64) -> f64 {
    let [pairs, triples] = [drives * (drives - 1.0) / 2.0, drives * (drives - 1.0) * (drives - 2.0) / 6.0];
    let skewness = 6.0 * triples * pairs.powf(-1.5) * variance.sqrt();
    if skewness < 1e-6 {
        return 1.0;
    }
    let cube = (1.0 + skewness * NOT_CHANCE / 6.0 - skewness * skewness / 36.0).powi(3);
    2.0 / skewness * (cube - 1.0) / NOT_CHANCE
}

/// Correlation of two series, and its variance if they are unrelated, by Bartlett's formula: the sum of the products of their
/// autocorrelations over their length.
fn correlation(pairs: &[(f64, f64)]) -> Option<[f64; 2]> {
    let n = pairs.len() as f64;
    let (x, y) = (pairs.iter().map(|p| p.0).sum::<f64>() / n, pairs.iter().map(|p| p.1).sum::<f64>() / n);
    let sum = |f: &dyn Fn(f64, f64) -> f64| pairs.iter().map(|(a, b)| f(a - x, b - y)).sum::<f64>();
    let [squares, others] = [sum(&|a, _| a * a), sum(&|_, b| b * b)];
    let r = sum(&|a, b| a * b) / (squares * others).sqrt();
    let lagged = |lag: usize, centred: &dyn Fn(usize) -> f64| -> f64 {
        (lag..pairs.len()).map(|i| centred(i) * centred(i - lag)).sum()
    };
    let product = |lag: usize| lagged(lag, &|i| pairs[i].0 - x) * lagged(lag, &|i| pairs[i].1 - y) / (squares * others);
    let variance = (1.0 + 2.0 * (1..pairs.len()).map(product).sum::<f64>()) / n;
    r.is_finite().then_some([r, variance.max(0.0)])
}
