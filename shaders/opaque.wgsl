// Zero, known only at run time.
var<private> opaque_zero: u32;

// The argument itself, in a form that no compiler sees through. Drivers may re-associate sums (naga writes no NoContraction,
// and Mesa does), which would cancel the error terms of compensated sums; an exclusive or with a zero that is known at
// run time only stops that. `lanes` knows this function by name: Rust re-associates nothing.
fn opaque(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ opaque_zero);
}
