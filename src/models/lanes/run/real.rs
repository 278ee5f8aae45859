//! The two kinds of numbers a block program runs in.

use super::exponential::{exponential, exponential_f64, logarithm, logarithm_f64};
use super::power::power_block;
use super::power_f64;
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// f32 or f64.
pub trait Real:
    Copy
    + Send
    + Sync
    + Debug
    + Default
    + PartialOrd
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    const ZERO: Self;
    const ONE: Self;
    const INFINITY: Self;
    fn of(x: f64) -> Self;
    fn to_f64(self) -> f64;
    /// Appends some numbers to others.
    fn append(numbers: &[Self], to: &mut Vec<f64>);
    /// A literal of the text; in f64 the decimal as written, and not its f32 value.
    fn literal(x: f32) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn floor(self) -> Self;
    /// e to this power.
    fn exponential(self) -> Self;
    /// Natural logarithm.
    fn logarithm(self) -> Self;
    fn sin(self) -> Self;
    fn cos(self) -> Self;
    /// The whole part of a value from 0 to 4,000,000, by its bits: a cast handles all values and is not vectorised.
    fn whole(self) -> u32;
    fn power<const L: usize>(x: &[Self; L], y: &[Self; L], out: &mut [Self; L]);

    /// The larger one; if one is NaN, the other; `other` of two zeros.
    #[inline(always)]
    fn larger(self, other: Self) -> Self {
        let larger = if self > other { self } else { other };
        if other.is_number() { larger } else { self }
    }

    /// The smaller one; if one is NaN, the other; `other` of two zeros.
    #[inline(always)]
    fn smaller(self, other: Self) -> Self {
        let smaller = if self < other { self } else { other };
        if other.is_number() { smaller } else { self }
    }

    #[inline(always)]
    #[allow(clippy::eq_op, reason = "only NaN differs from itself")]
    fn is_number(self) -> bool {
        self == self
    }

    #[inline(always)]
    fn is_finite(self) -> bool {
        self.abs() < Self::INFINITY
    }
}

// `$one_apart`: from here on neighbouring values differ by 1.
macro_rules! real {
    ($type:ident, $one_apart:literal, $append:expr, $literal:expr, $power:expr, $exponential:expr, $logarithm:expr) => {
        impl Real for $type {
            const ZERO: $type = 0.0;
            const ONE: $type = 1.0;
            const INFINITY: $type = $type::INFINITY;
            fn of(x: f64) -> $type {
                x as $type
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                f64::from(self)
            }
            #[inline(always)]
            fn append(numbers: &[$type], to: &mut Vec<f64>) {
                $append(numbers, to);
            }
            fn literal(x: f32) -> $type {
                $literal(x)
            }
            #[inline(always)]
            fn abs(self) -> $type {
                $type::abs(self)
            }
            #[inline(always)]
            fn sqrt(self) -> $type {
                $type::sqrt(self)
            }
            #[inline(always)]
            fn floor(self) -> $type {
                $type::floor(self)
            }
            #[inline(always)]
            fn exponential(self) -> $type {
                $exponential(self)
            }
            #[inline(always)]
            fn logarithm(self) -> $type {
                $logarithm(self)
            }
            #[inline(always)]
            fn sin(self) -> $type {
                $type::sin(self)
            }
            #[inline(always)]
            fn cos(self) -> $type {
                $type::cos(self)
            }
            #[inline(always)]
            fn whole(self) -> u32 {
                (self.floor() + $one_apart).to_bits() as u32 & 0x007f_ffff
            }
            #[inline(always)]
            fn power<const L: usize>(x: &[$type; L], y: &[$type; L], out: &mut [$type; L]) {
                $power(x, y, out);
            }
        }
    };
}

real!(
    f32,
    8_388_608.0,
    |numbers: &[f32], to: &mut Vec<f64>| to.extend(numbers.iter().map(|x| f64::from(*x))),
    |x: f32| x,
    power_block,
    exponential,
    logarithm
);
real!(
    f64,
    4_503_599_627_370_496.0,
    |numbers: &[f64], to: &mut Vec<f64>| to.extend_from_slice(numbers),
    |x: f32| x.to_string().parse().expect("a printed number parses"),
    power_f64::power_block,
    exponential_f64,
    logarithm_f64
);
