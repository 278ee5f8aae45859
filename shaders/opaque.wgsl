// Zero, known only at run time.
var<private> opaque_zero: u32;

// The argument itself, in a form that is opaque to compilers. Drivers may re-associate sums (naga writes no NoContraction, and Mesa does
// re-associate), which would cancel the error terms of compensated sums. An exclusive or with a zero that is known only at run time
// prevents that. `lanes` knows this function by name: Rust never re-associates.
fn opaque(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ opaque_zero);
}
