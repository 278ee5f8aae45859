//! Textbook values of free driving, braking and gains.

use crate::diagnose::drive::Drive;
use crate::diagnose::likelihood::model::Model;

/// The largest speed of the follower \[m/s\].
#[must_use]
pub fn fastest(drives: &[Drive]) -> f64 {
    drives.iter().flat_map(|drive| &drive.trajectory.v_f).copied().fold(0.0, f64::max)
}

/// Replaces a model's free driving, braking and gains by textbook values: they often imitate an effect that the base lacks, and the
/// textbook values do not. `fastest` is the largest speed of the follower \[m/s\].
#[must_use]
pub fn with_textbook_values(model: &Model, values: &[f64], fastest: f64) -> Vec<f64> {
    let textbook = [
        ("v_0", fastest + 4.0),
        ("delta", 4.0),
        ("a_max", 1.8),
        ("a_min", -2.5),
        ("a_hat_min", -2.5),
        ("theta", 0.4),
        ("k_s", 0.25),
        ("k_v", 0.6),
        ("k_0", 0.6),
    ];
    let mut generic = values.to_vec();
    for (name, value) in textbook {
        if let Some(k) = model.symbols.iter().position(|symbol| symbol.name() == name) {
            generic[k] = value.clamp(model.axes[k].lower, model.axes[k].upper);
        }
    }
    generic
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::calibrate::Overrides;
    use crate::diagnose::made_up;

    #[test]
    fn textbook_values_leave_the_bounds_and_keep_distances() {
        let drives = [made_up::drive("made_up.csv", 0.0)];
        let model = Model::new("gipps".parse().expect("a base"), &drives, &Overrides::new(), &[]).expect("a model");
        let on_bounds: Vec<f64> = model.axes.iter().map(|axis| axis.lower).collect();
        let moved = with_textbook_values(&model, &on_bounds, 23.0);
        let value = |of: &[f64], name: &str| of[model.symbols.iter().position(|s| s.name() == name).expect(name)];
        assert_eq!(["a_min", "a_hat_min", "theta", "v_0"].map(|name| value(&moved, name)), [-2.5, -2.5, 0.4, 27.0]);
        assert_eq!(["d_0", "t_h"].map(|name| value(&moved, name)), ["d_0", "t_h"].map(|name| value(&on_bounds, name)));
    }
}
