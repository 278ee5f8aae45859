//! Whether the car reacts to the car ahead: if not, no law describes it, and any cause that lets the law react less, such as a delay, gains.

use super::evidence::Gain;
use super::fit::{Entry, Field};
use super::loss::FLOOR;
use super::policy::Policy;
use super::{Answer, Horizon, Parts, Request};
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::{DiagnoseError, Drive, Watching};
use crate::result::diagnosis::recommended::HorizonGain;

/// Index of the speed among the signals.
const SPEED: usize = 1;
/// At this horizon the correction removes slow errors, so only reactions to the car ahead count.
const HORIZON: Horizon = Horizon::Step;

impl Answer {
    /// Judges by how much the base predicts the speed on the folds left out better than the same law without a car ahead. If it hardly does,
    /// nothing can be named. A law that cannot drive without a car ahead is not judged.
    ///
    /// # Errors
    /// As [`Field::law`].
    pub(super) fn judge_reaction(
        &mut self,
        request: &Request<'_>,
        base: &Entry,
        policy: &Policy,
        watching: &Watching<'_>,
    ) -> Result<(), DiagnoseError> {
        let variant = base.model.variant;
        let Some(judged) = base.fits[0].as_ref().and_then(|fit| fit.judged.as_ref()) else { return Ok(()) };
        let model = self.field.model(variant)?;
        let own = self.field.speed_errors(&model, &judged.folds)?;
        let of = &self.field.parts;
        let parts = Parts { drives: of.drives.iter().map(Drive::alone).collect(), ..of.clone() };
        let field = Field::new(parts, request.bounds, request.seed);
        let alone = field.model(variant)?;
        let Some(folds) = field.fitted_without_folds(&alone, HORIZON, watching)? else { return Ok(()) };
        let errors = field.speed_errors(&alone, &folds)?;
        self.simulations += model.simulations() + alone.simulations();
        let gains: Vec<f64> = errors.iter().zip(&own).map(|(alone, own)| alone - own).collect();
        if !gains.iter().all(|gain| gain.is_finite()) {
            return Ok(());
        }
        let Gain { share, interval, t } = Gain::of(HORIZON, &gains, 0.0, &self.resamples, policy);
        if interval[0] < policy.least_reaction {
            self.reacts = false;
            self.tried.not_testable = Some(format!(
                "with the car ahead, {} predicts the follower's speed over the next 2 s hardly better than without it; check which car is \
                 ahead, or give drives in which speeds change more",
                request.base
            ));
        }
        self.tried.reaction =
            Some(HorizonGain { horizon_s: HORIZON.seconds(), gain: share, interval, standard_errors: t });
        Ok(())
    }
}

impl Field {
    /// Logarithms of the squared errors of the speed, bin by bin, each with the parameters fitted without its fold.
    fn speed_errors(&self, model: &Model, folds: &[Vec<f64>]) -> Result<Vec<f64>, DiagnoseError> {
        let losses = self.losses_left_out(model, HORIZON, folds)?;
        let parts = losses.parts.iter().flatten();
        Ok(parts.flat_map(|part| &part.mse).map(|mse| (mse[SPEED] + FLOOR[SPEED].powi(2)).ln()).collect())
    }
}
