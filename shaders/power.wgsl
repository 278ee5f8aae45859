// x to the power of y for a finite x and any sign of y; 0 where x is not above 0 (or so small that a driver may take it
// for 0). Relative error below 6e-7 for x in 1e-3..1.4, y in 0.1..10, results above 1e-30. The builtin `pow` differs from
// driver to driver; this one uses only operations that are exact or correctly rounded, in an order that leaves a compiler
// nothing to re-associate, and src/models/lanes/run/power.rs repeats it bit for bit.
//
// Coefficients: minimax fits in f64 (Lawson's iteration on 4001 Chebyshev nodes), lowest coefficient first: rounded to f32,
// then the others fitted to the remainder. Logarithm: absolute error of z l(z) below 1e-8 for m in sqrt(1/2)..sqrt(2);
// exponential: relative error below 2e-9 in 0..1; only rounding remains.
fn power(x: f32, y: f32) -> f32 {
    let e = exponent_of(x);
    let l = log2_of_mantissa(x);
    // y (e + log2(m)) = whole + part: with 12 bits in y_high, y_high e is exact.
    let y_high = bitcast<f32>(bitcast<u32>(y) & 0xfffff000u);
    let y_low = y - y_high;
    let exact = y_high * e;
    let exact_whole = floor(exact);
    // Not c + (a b + d e), because Mesa would turn it into (c + a b) + d e.
    let rest = ((exact - exact_whole) + y_low * e) + y * l;
    let rest_whole = floor(rest);
    return select(0.0, power_of_two(exact_whole + rest_whole, rest - rest_whole), x >= 1.17549435e-38);
}

// x = m 2^e with m in sqrt(1/2)..sqrt(2): e.
fn exponent_of(x: f32) -> f32 {
    return f32(bitcast<i32>(bitcast<u32>(x) - 0x3f3504f3u) >> 23u);
}

// log2(m)
fn log2_of_mantissa(x: f32) -> f32 {
    let above = bitcast<u32>(x) - 0x3f3504f3u;
    let z = bitcast<f32>((above & 0x007fffffu) + 0x3f3504f3u) - 1.0;
    var l = 0.12549610435962677 * z - 0.20995402336120605;
    l = l * z + 0.21715795993804932;
    l = l * z - 0.23857052624225616;
    l = l * z + 0.2876948118209839;
    l = l * z - 0.36071905493736267;
    l = l * z + 0.4809204339981079;
    l = l * z - 0.7213471531867981;
    l = l * z + 1.442694902420044;
    return l * z;
}

// 2^(whole + part) for a part in 0..1.
fn power_of_two(whole: f32, part: f32) -> f32 {
    var r = 0.000215659718378447 * part + 0.0012482289457693696;
    r = r * part + 0.009673775173723698;
    r = r * part + 0.05548618361353874;
    r = r * part + 0.24022908508777618;
    r = r * part + 0.6931470632553101;
    r = r * part + 1.0;
    // From -127 (which is 0) to 128 (infinity): 8388608 + 127 + whole has the exponent in its last bits.
    let within = min(max(whole, -127.0), 128.0);
    let scale = bitcast<f32>(bitcast<u32>(within + 8388735.0) << 23u);
    return r * scale;
}
