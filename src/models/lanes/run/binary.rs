//! Common parts of `power`, `exponential` and `logarithm`, in f32 and in f64: binary exponents, and the polynomials of log2 and 2^x.

/// In f32, operation for operation as in shaders/power.wgsl.
pub mod single {
    /// log2(1 + z) / z for 1 + z in sqrt(1/2)..sqrt(2), the highest power first.
    pub const LOG: [f32; 9] = [
        0.125_496_1,
        -0.209_954_02,
        0.217_157_96,
        -0.238_570_53,
        0.287_694_8,
        -0.360_719_05,
        0.480_920_43,
        -0.721_347_15,
        1.442_694_9,
    ];
    /// 2^f for f in 0..1, the highest power first.
    pub const EXP: [f32; 7] =
        [0.000_215_659_72, 0.001_248_229, 0.009_673_775, 0.055_486_184, 0.240_229_09, 0.693_147_06, 1.0];

    /// sqrt(1/2), as bits.
    const SQRT_HALF: u32 = 0x3f35_04f3;

    /// e and z of x = (1 + z) 2^e with 1 + z in sqrt(1/2)..sqrt(2).
    #[inline(always)]
    pub fn parts(x: f32) -> [f32; 2] {
        let above = x.to_bits().wrapping_sub(SQRT_HALF);
        let e = (above.cast_signed() >> 23) as f32;
        [e, f32::from_bits((above & 0x007f_ffff) + SQRT_HALF) - 1.0]
    }

    /// The first bits of y, so that their product with an exponent is exact.
    #[inline(always)]
    pub fn high(y: f32) -> f32 {
        f32::from_bits(y.to_bits() & 0xffff_f000)
    }

    /// 2^whole; 0 and infinity outside the range of normal numbers.
    #[inline(always)]
    pub fn scale(whole: f32) -> f32 {
        // Comparisons instead of f32::max, whose treatment of NaN costs time, and NaN occurs only if an argument is NaN.
        let above = if whole > -127.0 { whole } else { -127.0 };
        let within = if above < 128.0 { above } else { 128.0 };
        f32::from_bits((within + 8_388_735.0).to_bits() << 23)
    }
}

/// In f64, with longer polynomials: minimax fits (Remez' exchange in 60 digits), the lowest power first.
pub mod double {
    /// log2(m) = t sum of LOG\[k\] t^2k with t = (m - 1) / (m + 1), within 1.2e-18.
    pub const LOG: [f64; 8] = [
        2.885_390_081_777_926_8,
        0.961_796_693_925_989_8,
        0.577_078_016_345_470_4,
        0.412_198_585_850_110_7,
        0.320_598_533_926_064_47,
        0.262_334_401_757_347_3,
        0.220_911_866_717_567_6,
        0.213_670_779_500_208_44,
    ];
    /// 2^f = sum of EXP\[k\] f^k for f in -1/2..1/2, within 3.1e-18.
    pub const EXP: [f64; 12] = [
        1.0,
        std::f64::consts::LN_2,
        0.240_226_506_959_101_55,
        0.055_504_108_664_819_925,
        0.009_618_129_107_588_335,
        0.001_333_355_814_678_995_5,
        0.000_154_035_304_625_146_44,
        1.525_273_348_995_760_5e-5,
        1.321_543_308_957_003_4e-6,
        1.017_819_803_425_067_2e-7,
        7.074_105_631_243_964e-9,
        4.435_280_849_218_033e-10,
    ];

    /// sqrt(1/2), as bits.
    const SQRT_HALF: u64 = 0x3fe6_a09e_667f_3bcd;
    const MANTISSA: u64 = 0x000f_ffff_ffff_ffff;
    /// From here on neighbouring values differ by 1, so that adding a small whole number changes only the last bits.
    const ONE_APART: f64 = 4_503_599_627_370_496.0;

    /// e and t = (m - 1) / (m + 1) of x = m 2^e with m in sqrt(1/2)..sqrt(2).
    #[inline(always)]
    pub fn parts(x: f64) -> [f64; 2] {
        let above = x.to_bits().wrapping_sub(SQRT_HALF);
        let exponent = ((above >> 52) + 2048) & 4095;
        let e = f64::from_bits(exponent | ONE_APART.to_bits()) - (ONE_APART + 2048.0);
        let m = f64::from_bits((above & MANTISSA) + SQRT_HALF);
        [e, (m - 1.0) / (m + 1.0)]
    }

    /// 2^whole; 0 and infinity outside the range of normal numbers.
    #[inline(always)]
    pub fn scale(whole: f64) -> f64 {
        let above = if whole > -1023.0 { whole } else { -1023.0 };
        let within = if above < 1024.0 { above } else { 1024.0 };
        f64::from_bits((within + (ONE_APART + 1023.0)).to_bits() << 52)
    }
}

/// A row of a block, as wide as the processor's vectors.
#[repr(C, align(64))]
pub struct Aligned<T, const L: usize>(pub [T; L]);

/// `$r x + c` for each of the coefficients in turn, in the order of the range.
macro_rules! horner {
    ($r:expr, $x:expr, $coefficients:ident, $range:expr) => {{
        let mut r = $r;
        for k in $range {
            r = r * $x + $coefficients[k];
        }
        r
    }};
}
pub(super) use horner;

/// The same in f64 with a single rounding each; no shader has to repeat its bits.
macro_rules! horner_fused {
    ($r:expr, $x:expr, $coefficients:ident, $range:expr) => {{
        let mut r: f64 = $r;
        for k in $range {
            r = r.mul_add($x, $coefficients[k]);
        }
        r
    }};
}
pub(super) use horner_fused;
