//! The long-run variance of a series: what remains of its variance, per sample, in a mean over many.

/// Variances of a series.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LongRun {
    /// Variance of one sample.
    pub variance: f64,
    /// Σ over all lags of the autocovariance: n times the variance of a mean of n samples, for large n.
    pub long_run: f64,
}

/// Largest autocorrelation of the pre-whitening: beyond it a series is as good as a random walk, and has no long-run variance.
const LARGEST: f64 = 0.995;

/// Long-run variance of a series: pre-whitened by an autoregression of order 1 (D. W. K. Andrews and J. C. Monahan, Econometrica 60,
/// 1992), then Bartlett's kernel (W. K. Newey and K. D. West, Econometrica 55, 1987) with the bandwidth of D. W. K. Andrews
/// (Econometrica 59, 1991, Eqs. 6.2 and 6.4).
#[must_use]
pub fn long_run(series: &[f64]) -> LongRun {
    let n = series.len() as f64;
    if series.len() < 4 {
        return LongRun { variance: 0.0, long_run: 0.0 };
    }
    let mean = series.iter().sum::<f64>() / n;
    let centred: Vec<f64> = series.iter().map(|x| x - mean).collect();
    let variance = lagged(&centred, 0);
    let rho = autocorrelation(&centred).clamp(-LARGEST, LARGEST);
    let whitened: Vec<f64> = centred.windows(2).map(|w| w[1] - rho * w[0]).collect();

    let left = autocorrelation(&whitened).clamp(-LARGEST, LARGEST);
    let alpha = 4.0 * left * left / ((1.0 - left).powi(2) * (1.0 + left).powi(2));
    let bandwidth = (1.1447 * (alpha * n).cbrt()).min(n / 4.0);
    let lags = bandwidth.floor() as usize;
    let kernel = |lag: usize| 1.0 - lag as f64 / (bandwidth + 1.0);
    let sum = (1..=lags).map(|lag| 2.0 * kernel(lag) * lagged(&whitened, lag)).sum::<f64>();
    let whitened_long_run = (lagged(&whitened, 0) + sum).max(0.0);
    LongRun { variance, long_run: whitened_long_run / (1.0 - rho).powi(2) }
}

/// Autocovariance of a series of mean 0.
fn lagged(series: &[f64], lag: usize) -> f64 {
    series.iter().zip(&series[lag..]).map(|(a, b)| a * b).sum::<f64>() / series.len() as f64
}

fn autocorrelation(series: &[f64]) -> f64 {
    let variance = lagged(series, 0);
    if variance > 0.0 { lagged(series, 1) / variance } else { 0.0 }
}
