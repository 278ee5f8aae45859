//! The paper's own numbers (Tables 4 and 5), to be printed beside ours.

use std::collections::BTreeMap;

/// Validation runs of each variant in the paper: 28 trajectories, six other platoons each.
pub const VALIDATIONS: f64 = 168.0;

/// The printed values of a variant; `None` for a dash (base models).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Printed {
    /// Table 4: median normalised calibration error.
    pub median: f64,
    /// Table 4: its change against the base model \[%\].
    pub change: Option<f64>,
    /// Table 5: changes of RMSE(s), RMSE(v), RMSE(a), NRMSE(s,v,a) in calibration \[%\].
    pub calibration: [Option<f64>; 4],
    /// Table 5: the same in validation \[%\].
    pub validation: [Option<f64>; 4],
    /// Table 5: collisions in [`VALIDATIONS`] runs.
    pub collisions: f64,
}

/// The numbers by id of Table 1.
pub fn printed() -> BTreeMap<u32, Printed> {
    let (four, five) = (rows(include_str!("table4.csv")), rows(include_str!("table5.csv")));
    let known = |x: Option<f64>| x.expect("the paper prints it");
    let both = four.iter().zip(&five).map(|(four, five)| {
        assert_eq!(four[0], five[0], "both tables list the variants in order");
        let printed = Printed {
            median: known(four[1]),
            change: four[2],
            calibration: [five[1], five[2], five[3], five[4]],
            validation: [five[5], five[6], five[7], five[8]],
            collisions: known(five[9]),
        };
        (known(four[0]) as u32, printed)
    });
    both.collect()
}

fn rows(text: &str) -> Vec<Vec<Option<f64>>> {
    let lines = text.lines().filter(|line| !line.starts_with('#')).skip(1);
    lines.map(|line| line.split(',').map(|field| field.parse().ok()).collect()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tables_are_those_of_the_paper() {
        let printed = printed();
        assert_eq!(printed.keys().copied().collect::<Vec<_>>(), (1..=90).collect::<Vec<_>>());
        assert_eq!((printed[&28].median, printed[&28].change), (0.027, Some(-82.0)));
        assert_eq!(printed[&34].calibration, [Some(-12.91), Some(-8.51), Some(-5.57), Some(-8.0)]);
        assert_eq!(printed[&72].validation[3], Some(3.35));
        assert_eq!(printed[&72].collisions, 83.0);
        assert!(printed.values().filter(|row| row.change.is_none()).count() == 5, "the base models");
        // The changes printed follow from the medians printed, within the rounding of both.
        for (id, row) in &printed {
            let base = printed[&((id - 1) / 18 * 18 + 1)].median;
            let change = row.change.unwrap_or(0.0);
            assert!((100.0 * (row.median / base - 1.0) - change).abs() < 1.5, "variant {id}: a typing error?");
        }
    }
}
