//! Whether the car reacts to the car ahead: if not, no law follows it, and any cause that lets the law react less, such as a delay, gains.

use super::evidence::Gain;
use super::fit::{Entry, Field};
use super::loss::FLOOR;
use super::policy::Policy;
use super::{Answer, Horizon, Parts, Request};
use crate::catalog::Variant;
use crate::diagnose::likelihood::model::Model;
use crate::diagnose::{DiagnoseError, Drive, Watching};
use crate::judge::Resamples;
use crate::result::diagnosis::recommended::HorizonGain;

/// Index of the speed among the signals.
const SPEED: usize = 1;
/// The horizon: only over some seconds does a law have to know the car ahead, because the correction makes up for slow changes.
const HORIZON: Horizon = Horizon::Step;

impl Field {
    /// The gain of the base over the same law without a car ahead: by how much it predicts the speed on the folds left out better. `None` if
    /// one of them cannot be fitted.
    ///
    /// # Errors
    /// As [`Field::law`].
    pub(super) fn reaction(
        &self,
        request: &Request<'_>,
        base: &Entry,
        resamples: &Resamples,
        policy: &Policy,
        watching: &Watching<'_>,
    ) -> Result<Option<HorizonGain>, DiagnoseError> {
        let variant = base.model.variant;
        let Some(judged) = base.fits[0].as_ref().and_then(|fit| fit.judged.as_ref()) else { return Ok(None) };
        let own = self.speed_errors(&self.model(variant)?, &judged.folds)?;
        let parts = Parts { drives: self.parts.drives.iter().map(Drive::alone).collect(), ..self.parts.clone() };
        let alone = Field::new(parts, request.bounds, request.seed);
        let model = alone.model(variant)?;
        let Some(folds) = alone.fitted_without_folds(&model, HORIZON, watching)? else { return Ok(None) };
        let alone = alone.speed_errors(&model, &folds)?;
        // A run that fails says nothing.
        let gain = |(alone, own): (&f64, &f64)| Some(alone - own).filter(|gain| gain.is_finite()).unwrap_or(0.0);
        let gains: Vec<f64> = alone.iter().zip(&own).map(gain).collect();
        let Gain { share, interval, t } = Gain::of(HORIZON, &gains, 0.0, resamples, policy);
        Ok(Some(HorizonGain { horizon_s: HORIZON.seconds(), gain: share, interval, standard_errors: t }))
    }

    /// Logarithms of the squared errors of the speed, bin by bin, each with the parameters fitted without its fold.
    fn speed_errors(&self, model: &Model, folds: &[Vec<f64>]) -> Result<Vec<f64>, DiagnoseError> {
        let losses = self.losses_left_out(model, HORIZON, folds)?;
        let parts = losses.parts.iter().flatten();
        Ok(parts.flat_map(|part| &part.mse).map(|mse| (mse[SPEED] + FLOOR[SPEED].powi(2)).ln()).collect())
    }
}

impl Answer {
    /// False if the car ahead hardly helps to predict the follower, so that nothing can be named.
    pub(super) fn reacts(&self) -> bool {
        self.tried.reaction.as_ref().is_none_or(|gain| gain.interval[0] >= Policy::DEFAULT.least_reaction)
    }
}

/// Why nothing can be named in such drives.
pub(super) fn no_reaction(base: Variant) -> String {
    format!(
        "{base} predicts the follower's speed over the next seconds hardly better with the car ahead than without it; check which car is \
         ahead, or give drives in which speeds change more"
    )
}
