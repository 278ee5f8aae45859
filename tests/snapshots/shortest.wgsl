// Variant l-cth, precision plain. Made by tests/model/wgsl.rs; do not edit.

struct Params {
    // gain for the spacing error [1/s²]
    k_s: f32,
    // gain for the speed difference [1/s]
    k_v: f32,
    // gain for the set-speed deviation [1/s]
    k_0: f32,
    // desired speed (ACC set speed) [m/s]
    v_0: f32,
    // desired spacing at standstill [m]
    d_0: f32,
    // headway, or Gipps' reaction time [s]
    t_h: f32,
}
// What the parts see. The same names, in the same units, as src/reference/types.rs.

// Perceived signals, delayed by tau_p: spacing [m], ego speed [m/s], speed of the preceding vehicle [m/s].
struct Perceived {
    s: f32,
    v_f: f32,
    v_l: f32,
}

// What a controller commands: a_cmd [m/s2], and whether its own equation has a solution (Gipps' radicand).
struct Command {
    a_cmd: f32,
    feasible: bool,
}

// The ego vehicle at the current sample: speed [m/s], acceleration [m/s2], unladen mass [kg], equivalent inertial mass
// factor [-], time step [s].
struct Ego {
    v_f: f32,
    a_f: f32,
    m_0: f32,
    phi_f: f32,
    dt: f32,
}

// Looked up for the current position and speed: sine of the grade, deceleration and acceleration potential [m/s2].
struct Road {
    sin_grade: f32,
    a_dp: f32,
    a_ap: f32,
}
// x to the power of y for a finite x and any sign of y; 0 where x is not above 0 (or so small that a driver may take it
// for 0). Relative error below 6e-7 for x in 1e-3..1.4, y in 0.1..10, results above 1e-30. The builtin `pow` differs from
// driver to driver; this one uses only operations that are exact or correctly rounded, in an order that leaves a compiler
// nothing to re-associate, and src/lanes/run/power.rs repeats it bit for bit.
//
// Coefficients: minimax fits in f64 (Lawson's iteration on 4001 Chebyshev nodes), lowest coefficient first: rounded to f32,
// then the others fitted to what is left. Logarithm: absolute error of z l(z) below 1e-8 for m in sqrt(1/2)..sqrt(2);
// exponential: relative error below 2e-9 in 0..1; rounding is what remains.
fn power(x: f32, y: f32) -> f32 {
    let e = exponent_of(x);
    let l = log2_of_mantissa(x);
    // y (e + log2(m)) = whole + part: with 12 bits in y_high, y_high e is exact.
    let y_high = bitcast<f32>(bitcast<u32>(y) & 0xfffff000u);
    let y_low = y - y_high;
    let exact = y_high * e;
    let exact_whole = floor(exact);
    // Not c + (a b + d e): Mesa makes (c + a b) + d e of it.
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
// Zero, which only run time tells.
var<private> opaque_zero: u32;

// The argument itself, in a form that no compiler sees through. Drivers may re-associate sums (naga writes no NoContraction,
// and Mesa does), which would cancel the error terms of compensated sums; an exclusive or with a zero that is known at
// run time only stops that. `lanes` knows this function by name: Rust re-associates nothing.
fn opaque(x: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(x) ^ opaque_zero);
}
// Eq. 7: desired spacing at a constant time headway [m].
fn desired_spacing(p: Params, x: Perceived) -> f32 {
    return p.d_0 + p.t_h * x.v_f;
}
// Eq. 6: commanded acceleration of the linear control law [m/s2].
fn commanded_acceleration(p: Params, x: Perceived, s_des: f32, v_f: f32) -> Command {
    let dv = x.v_l - x.v_f;
    let ds = s_des - x.s;
    return Command(min(p.k_v * dv - p.k_s * ds, p.k_0 * (p.v_0 - x.v_f)), true);
}
// Eq. 9: the command is the acceleration [m/s2].
fn vehicle_response(p: Params, a_cmd: f32, ego: Ego, road: Road) -> f32 {
    return a_cmd;
}
// Eq. 12: no constraint [m/s2].
fn constrained_acceleration(a: f32, road: Road) -> f32 {
    return a;
}
// The spacing at a sample before the first simulated one, as measured [m] (convention `radicand=measured`).
fn starting_spacing(p: Params, x: Perceived) -> f32 {
    return x.s;
}
// The simulated state: spacing [m], speed [m/s], acceleration [m/s2]. The spacing is a state of its own, and never the
// difference of two positions kilometres away, which f32 could not tell apart.
struct Motion {
    s: f32,
    v_f: f32,
    a_f: f32,
}

// The state at a measured sample.
fn at_rest_in(s: f32, v_f: f32, a_f: f32) -> Motion {
    return Motion(s, v_f, a_f);
}

// Eq. 1: the state one step dt [s] later; the preceding vehicle drives dx_l [m] meanwhile. A car does not roll backwards,
// and its acceleration is the one it then had.
fn moved(now: Motion, a: f32, dx_l: f32, dt: f32) -> Motion {
    let per_dt = 1.0 / dt;
    let half_dt = 0.5 * dt;
    let v_free = now.v_f + a * dt;
    let v_next = max(v_free, 0.0);
    let a_next = select(a, -now.v_f * per_dt, v_free < 0.0);
    return Motion(now.s + (dx_l - (now.v_f + v_next) * half_dt), v_next, a_next);
}
// One simulated step.
struct Step {
    next: Motion,
    // Acceleration before the constraint [m/s2]; it is checked for NaN and infinity there, which a clamp would hide.
    a_free: f32,
    // Acceleration after the constraint [m/s2].
    a: f32,
    // False where Gipps' radicand is negative.
    feasible: bool,
}

// The order of the paper: spacing policy, controller, dynamics, constraint, then Eq. 1. `dx_l` is the way [m] that the
// preceding vehicle drives in the step `dt` [s]; m_0 [kg] and phi_f belong to the ego vehicle.
fn step(p: Params, x: Perceived, now: Motion, m_0: f32, phi_f: f32, road: Road, dx_l: f32, dt: f32) -> Step {
    let s_des = desired_spacing(p, x);
    let command = commanded_acceleration(p, x, s_des, now.v_f);
    let ego = Ego(now.v_f, now.a_f, m_0, phi_f, dt);
    let a_free = vehicle_response(p, command.a_cmd, ego, road);
    let a = constrained_acceleration(a_free, road);
    return Step(moved(now, a, dx_l, dt), a_free, a, command.feasible);
}
