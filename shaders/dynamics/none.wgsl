// Eq. 9: the command is the acceleration [m/s2].
fn vehicle_response(p: Params, a_cmd: f32, ego: Ego, road: Road) -> f32 {
    return a_cmd;
}
