//! Discrete Fourier transform of real samples, in powers of two, for spectra of signals.

/// |X_k|² for k = 0 to n/2 of real samples, filled up with zeros to a power of two.
pub fn power(samples: &[f64]) -> Vec<f64> {
    let n = samples.len().next_power_of_two();
    let mut re = samples.to_vec();
    re.resize(n, 0.0);
    let mut im = vec![0.0; n];
    transform(&mut re, &mut im);
    (0..=n / 2).map(|k| re[k % n] * re[k % n] + im[k % n] * im[k % n]).collect()
}

/// Cooley and Tukey, in place; the length is a power of two.
fn transform(re: &mut [f64], im: &mut [f64]) {
    let n = re.len();
    let bits = n.trailing_zeros();
    for i in 0..n {
        let j = i.reverse_bits() >> (usize::BITS - bits).min(usize::BITS - 1);
        if bits > 0 && i < j {
            re.swap(i, j);
            im.swap(i, j);
        }
    }
    let mut half = 1;
    while half < n {
        let step = -std::f64::consts::PI / half as f64;
        for k in 0..half {
            let (sin, cos) = (step * k as f64).sin_cos();
            for a in (k..n).step_by(2 * half) {
                let b = a + half;
                let (x, y) = (re[b] * cos - im[b] * sin, re[b] * sin + im[b] * cos);
                (re[b], im[b]) = (re[a] - x, im[a] - y);
                re[a] += x;
                im[a] += y;
            }
        }
        half *= 2;
    }
}

#[cfg(test)]
mod tests {
    use super::power;

    #[test]
    fn agrees_with_the_definition() {
        let samples: Vec<f64> = (0..32).map(|i| f64::from(i * i % 7) - 2.0).collect();
        for (k, found) in power(&samples).iter().enumerate() {
            let angle = |i: usize| std::f64::consts::TAU * (k * i) as f64 / 32.0;
            let re: f64 = samples.iter().enumerate().map(|(i, x)| x * angle(i).cos()).sum();
            let im: f64 = samples.iter().enumerate().map(|(i, x)| x * angle(i).sin()).sum();
            assert!((found - (re * re + im * im)).abs() < 1e-9, "{k}: {found}");
        }
        assert_eq!(power(&[3.0]), [9.0]);
    }
}
