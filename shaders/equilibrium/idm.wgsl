// Spacing at which an IDM car at constant speed v behind another at that speed does not change it [m]. Near the desired speed
// there is no such spacing; then ten times the spacing of a slow car.
fn equilibrium_spacing(p: Params, v: f32) -> f32 {
    let share = max(v / p.v_0, 0.0);
    return (p.d_0 + p.t_h * v) / sqrt(max(1.0 - power(share, p.delta), 0.01));
}
