//! f32 and f64 for the hand-written loop: arithmetic, and a power function over arrays.
//!
//! Both powers are 2^(y log2 x): log2 by the series of the inverse hyperbolic tangent, 2^z by its Taylor series, exponents by
//! their bits. Everything is a loop of plain operations over an array, without branches, which the compiler vectorises.
#![allow(clippy::approx_constant, reason = "coefficients of a polynomial that are close to known constants by chance")]

use std::ops::{Add, Div, Mul, Sub};

/// A floating-point type.
pub(super) trait Real:
    Copy
    + Send
    + Sync
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + PartialOrd
{
    /// The nearest value.
    fn of(x: f64) -> Self;
    /// The larger one.
    fn max(self, other: Self) -> Self;
    /// The smaller one.
    fn min(self, other: Self) -> Self;
    /// x^y for x >= 0, 0 for x = 0. With `FUSED` by fused multiply-adds, which the processor must have in hardware.
    fn power<const N: usize, const FUSED: bool>(x: &[Self; N], y: &[Self; N]) -> [Self; N];
}

/// The same text for both types. `$log` and `$exp` are the coefficients, the highest power first.
macro_rules! real {
    ($float:ident, $bits:ident, $mantissa:literal, $bias:literal, $tiny:literal, $lowest:literal, $round:literal, $half_mantissa:literal, $log:expr, $exp:expr) => {
        impl Real for $float {
            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $float
            }

            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }

            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }

            #[inline(always)]
            fn power<const N: usize, const FUSED: bool>(x: &[Self; N], y: &[Self; N]) -> [Self; N] {
                // Loops, not closures: a closure that is not inlined would be compiled without the caller's instruction set.
                const LOG: &[$float] = &$log;
                const EXP: &[$float] = &$exp;
                const ONE: $bits = ($bias as $bits) << $mantissa;
                let mut result = [0.0; N];
                for i in 0..N {
                    // x = 2^e m with m in [sqrt(1/2), sqrt(2)).
                    let bits = Real::max(x[i], $tiny).to_bits();
                    let exponent = bits.wrapping_add($half_mantissa) >> $mantissa;
                    // The exponent as a float, without a conversion: its bits behind those of 2^mantissa.
                    let e = $float::from_bits(exponent | $round.to_bits()) - ($round + $bias);
                    let m = $float::from_bits(bits.wrapping_sub(exponent << $mantissa).wrapping_add(ONE));
                    // log2 m = 2 / ln 2 artanh((m - 1) / (m + 1)).
                    let t = (m - 1.0) / (m + 1.0);
                    let t2 = t * t;
                    let mut series = LOG[0];
                    for c in &LOG[1..] {
                        series = if FUSED { series.mul_add(t2, *c) } else { series * t2 + c };
                    }
                    let log2 = if FUSED { series.mul_add(t, e) } else { series * t + e };
                    // 2^z = 2^k 2^f with f in [-1/2, 1/2].
                    let z = Real::max(y[i] * log2, $lowest);
                    let k = z + 1.5 * $round;
                    let f = z - (k - 1.5 * $round);
                    let mut series = EXP[0];
                    for c in &EXP[1..] {
                        series = if FUSED { series.mul_add(f, *c) } else { series * f + c };
                    }
                    let power = $float::from_bits(series.to_bits().wrapping_add(k.to_bits() << $mantissa));
                    result[i] = if x[i] > 0.0 { power } else { 0.0 };
                }
                result
            }
        }
    };
}

// 2 / (ln 2 (2 k + 1)) and ln(2)^k / k!, as many as the precision needs. The half-mantissa is what, added to the bits of m,
// carries into the exponent from sqrt(2) on.
real!(
    f32,
    u32,
    23,
    127.0,
    1e-30,
    -126.0,
    8_388_608.0_f32,
    0x004a_fb0d,
    [0.320_598_9, 0.412_198_57, 0.577_078_04, 0.961_796_7, 2.885_39],
    [0.000_154_035_3, 0.001_333_355_8, 0.009_618_129, 0.055_504_11, 0.240_226_5, 0.693_147_2, 1.0]
);
real!(
    f64,
    u64,
    52,
    1023.0,
    1e-300,
    -1022.0,
    4_503_599_627_370_496.0_f64,
    0x0009_5f61_9980_c433,
    [
        0.1373995277037108,
        0.15186263588304877,
        0.16972882833987804,
        0.19235933878519512,
        0.22195308321368667,
        0.2623081892525388,
        0.3205988979753252,
        0.4121985831111324,
        0.5770780163555853,
        0.9617966939259756,
        2.8853900817779268
    ],
    [
        1.3691488853904124e-12,
        2.5678435993488196e-11,
        4.44553827187081e-10,
        7.054911620801121e-09,
        1.0178086009239696e-07,
        1.3215486790144305e-06,
        1.5252733804059838e-05,
        0.00015403530393381606,
        0.0013333558146428441,
        0.009618129107628477,
        0.055504108664821576,
        0.2402265069591007,
        0.6931471805599453,
        1.0
    ]
);
