// As opaque.wgsl, with zeros of their own: a compiler takes two exclusive ors with the same zero for none. What one extension
// hands to the next goes through one of these by turns, so that the terms of both cannot be mixed.
var<private> even_zero: u32;
var<private> odd_zero: u32;

fn opaque_even(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ even_zero);
}

fn opaque_odd(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ odd_zero);
}
