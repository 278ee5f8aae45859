//! The controller does not compensate this share of the grade force.
//! in short: this share of the slope is not compensated
//! equation: a = a - gg g sin(theta(x))
//! looks like: missing acceleration that repeats with the road, against the grade
//! experiment: the same road in the other direction: the effect of the slope changes its sign
struct Parameters {
    /// share of the grade force that acts on the car [-], -0.3 to 1.3, neutral 0
    gg: f32,
}

fn grade_response(own: Parameters, w: World, a: f32) -> f32 {
    return a - own.gg * 9.81 * w.sin_grade;
}
