// Input of a law: the present speed of the car [m/s]. The law itself is a stage after this one.
fn commanded_acceleration(p: Params, x: Perceived, s_des: f32, v_f: f32) -> Command {
    return Command(v_f, true);
}
