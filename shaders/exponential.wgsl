// e to the power of x: relative error below 3e-7 for x in -87..88; 0 below, infinity above, NaN for NaN. The builtin
// `exp` and `log` differ from driver to driver; these two have the operations of shaders/power.wgsl, and src/models/lanes/run/exponential.rs
// repeats them bit for bit.
fn exponential(x: f32) -> f32 {
    let y = select(select(x, -100.0, x < -100.0), 100.0, x > 100.0);
    // y log2(e) = whole + part: with 12 bits in y_high and 11 in the factor, y_high 1.4423828125 is exact.
    let y_high = bitcast<f32>(bitcast<u32>(y) & 0xfffff000u);
    let y_low = y - y_high;
    let exact = y_high * 1.4423828125;
    let exact_whole = floor(exact);
    let rest = ((exact - exact_whole) + y_low * 1.4423828125) + y * 0.0003122284;
    let rest_whole = floor(rest);
    let result = power_of_two(exact_whole + rest_whole, rest - rest_whole);
    return select(result, x, (bitcast<u32>(x) & 0x7fffffffu) > 0x7f800000u);
}

// Natural logarithm: error below 4e-7 of the result for x above 0; -87.3, the logarithm of the smallest normal number, below
// that number, because a driver may flush subnormal numbers to 0; x for infinity and NaN.
fn logarithm(x: f32) -> f32 {
    let y = select(x, 1.17549435e-38, x < 1.17549435e-38);
    let result = (exponent_of(y) + log2_of_mantissa(y)) * 0.6931471805599453;
    return select(result, x, (bitcast<u32>(x) & 0x7f800000u) == 0x7f800000u);
}
