//! Operations on one lane, and loops that apply them to all lanes of a few rows. Each row is a separate argument, so the compiler knows
//! that no two overlap.

use super::real::Real;
use std::hint::select_unpredictable;

/// An operation on one number.
pub trait One {
    fn of<T: Real>(x: T) -> T;
}

/// An operation on two numbers.
pub trait Two {
    /// True if the second is a literal, the same in all lanes.
    const OF_LITERAL: bool = false;
    fn of<T: Real>(x: T, y: T) -> T;

    /// In lane i of a row.
    #[inline(always)]
    fn of_row<T: Real, const L: usize>(x: T, y: &[T; L], i: usize) -> T {
        Self::of(x, if Self::OF_LITERAL { y[0] } else { y[i] })
    }
}

/// A comparison.
pub trait Compare {
    fn holds<T: Real>(x: T, y: T) -> bool;
}

macro_rules! one {
    ($($name:ident: |$x:ident| $result:expr;)*) => {$(
        pub struct $name;
        impl One for $name {
            #[inline(always)]
            fn of<T: Real>($x: T) -> T { $result }
        }
    )*};
}
macro_rules! two {
    ($of_literal:literal: $($name:ident: |$x:ident, $y:ident| $result:expr;)*) => {$(
        pub struct $name;
        impl Two for $name {
            const OF_LITERAL: bool = $of_literal;
            #[inline(always)]
            fn of<T: Real>($x: T, $y: T) -> T { $result }
        }
    )*};
}
macro_rules! compare {
    ($($name:ident: |$x:ident, $y:ident| $result:expr;)*) => {$(
        pub struct $name;
        impl Compare for $name {
            #[inline(always)]
            fn holds<T: Real>($x: T, $y: T) -> bool { $result }
        }
        impl Two for $name {
            #[inline(always)]
            fn of<T: Real>(x: T, y: T) -> T { if Self::holds(x, y) { T::ONE } else { T::ZERO } }
        }
    )*};
}

one! {
    Copy: |x| x;
    Negate: |x| -x;
    Not: |x| if x == T::ZERO { T::ONE } else { T::ZERO };
    Abs: |x| x.abs();
    Sqrt: |x| x.sqrt();
    Floor: |x| x.floor();
    Exponential: |x| x.exponential();
    Logarithm: |x| x.logarithm();
    Sin: |x| x.sin();
    Cos: |x| x.cos();
}
two! {
    false:
    Add: |x, y| x + y;
    Subtract: |x, y| x - y;
    SubtractFrom: |x, y| y - x;
    Multiply: |x, y| x * y;
    Divide: |x, y| x / y;
    DivideInto: |x, y| y / x;
    Min: |x, y| x.smaller(y);
    MinOf: |x, y| y.smaller(x);
    Max: |x, y| x.larger(y);
    And: |x, y| if x != T::ZERO { y } else { T::ZERO };
    Or: |x, y| if x != T::ZERO { T::ONE } else { y };
}
two! {
    true:
    // The second is a number, so the comparison alone selects it if the first is NaN.
    MinLiteral: |x, y| if x < y { x } else { y };
    MaxLiteral: |x, y| if x > y { x } else { y };
}
compare! {
    Less: |x, y| x < y;
    LessEqual: |x, y| x <= y;
    Equal: |x, y| x == y;
    NotEqual: |x, y| x != y;
}

#[inline(always)]
pub fn each1<T: Real, O: One, const L: usize>(to: &mut [T; L], x: &[T; L]) {
    for i in 0..L {
        to[i] = O::of(x[i]);
    }
}

#[inline(always)]
pub fn each2<T: Real, O: Two, const L: usize>(to: &mut [T; L], x: &[T; L], y: &[T; L]) {
    for i in 0..L {
        to[i] = O::of_row(x[i], y, i);
    }
}

#[inline(always)]
pub fn each3<T: Real, I: Two, O: Two, const L: usize>(to: &mut [T; L], x: &[T; L], y: &[T; L], z: &[T; L]) {
    for i in 0..L {
        to[i] = O::of_row(I::of_row(x[i], y, i), z, i);
    }
}

#[inline(always)]
pub fn each4<T: Real, I: Two, M: Two, O: Two, const L: usize>(
    to: &mut [T; L],
    x: &[T; L],
    y: &[T; L],
    w: &[T; L],
    z: &[T; L],
) {
    for i in 0..L {
        to[i] = O::of_row(M::of(I::of(x[i], y[i]), w[i]), z, i);
    }
}

/// Both values are loaded before one is selected; otherwise the compiler would gather from either row.
#[inline(always)]
pub fn each_select<T: Real, const L: usize>(to: &mut [T; L], c: &[T; L], accept: &[T; L], reject: &[T; L]) {
    for i in 0..L {
        to[i] = select_unpredictable(c[i] != T::ZERO, accept[i], reject[i]);
    }
}

#[inline(always)]
pub fn each_compare<T: Real, C: Compare, const L: usize>(
    to: &mut [T; L],
    x: &[T; L],
    y: &[T; L],
    accept: &[T; L],
    reject: &[T; L],
) {
    for i in 0..L {
        to[i] = select_unpredictable(C::holds(x[i], y[i]), accept[i], reject[i]);
    }
}

/// Eq. 1, with the values that all lanes share.
#[inline(always)]
#[allow(clippy::too_many_arguments, reason = "one row each, so that the compiler knows that none overlap")]
pub fn each_moved<T: Real, const L: usize>(
    s_next: &mut [T; L],
    v_next: &mut [T; L],
    a_next: &mut [T; L],
    s: &[T; L],
    v: &[T; L],
    a: &[T; L],
    [dx_l, dt, half_dt, per_dt]: [T; 4],
) {
    for i in 0..L {
        let v_free = v[i] + a[i] * dt;
        let v_then = MaxLiteral::of(v_free, T::ZERO);
        a_next[i] = select_unpredictable(v_free < T::ZERO, -v[i] * per_dt, a[i]);
        s_next[i] = s[i] + (dx_l - (v[i] + v_then) * half_dt);
        v_next[i] = v_then;
    }
}

/// Knuth's two-sum.
#[inline(always)]
pub fn each_two_sum<T: Real, const L: usize>(high: &mut [T; L], low: &mut [T; L], a: &[T; L], b: &[T; L]) {
    for i in 0..L {
        let sum = a[i] + b[i];
        let b_seen = sum - a[i];
        let a_seen = sum - b_seen;
        low[i] = (a[i] - a_seen) + (b[i] - b_seen);
        high[i] = sum;
    }
}
