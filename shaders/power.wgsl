// PLACEHOLDER
fn power(x: f32, y: f32) -> f32 {
    return select(0.0, pow(max(x, 1e-30), y), x > 0.0);
}
