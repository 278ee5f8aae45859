//! A tent over a place on the road, which a lap brings back.
//! tool: flexible term of a diagnosis
struct Parameters {
    /// acceleration in the middle of the tent [m/s2], -5 to 5, neutral 0
    road_a: f32,
    /// where the tent is [m], -1000000 to 1000000
    road_x: f32,
    /// half its width [m], 1 to 10000
    road_w: f32,
    /// length of the lap, or 0 [m], 0 to 1000000
    road_lap: f32,
}

fn probe_road_response(own: Parameters, w: World, a: f32) -> f32 {
    let lap = max(own.road_lap, 1.0);
    let far = w.x_f - own.road_x;
    let round = far - lap * floor(far / lap + 0.5);
    let off = abs(select(far, round, own.road_lap > 0.0));
    return a + own.road_a * max(1.0 - off / own.road_w, 0.0);
}
