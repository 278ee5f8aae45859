// As opaque.wgsl, with separate zeros: a compiler removes two exclusive ors with the same zero. The value that one extension passes to the
// next goes through these in turn, so that the compiler cannot mix the terms of both.
var<private> even_zero: u32;
var<private> odd_zero: u32;

fn opaque_even(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ even_zero);
}

fn opaque_odd(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ odd_zero);
}
