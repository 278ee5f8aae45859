//! An extension of one's own, from a text to a calibrated model.
//!
//!     cargo run --release --example custom_extension

use leadlag::calibrate::{Calibration, Overrides, SearchSpace, best, calibrate};
use leadlag::catalog::Variant;
use leadlag::convention::Convention;
use leadlag::evaluator::Case;
use leadlag::lanes::{Lanes, LanesPrecision};
use leadlag::plant;
use leadlag::score::GoodnessOfFit;
use leadlag::trajectory::{Preparation, import, prepare};
use leadlag::wgsl::read_extension;
use std::ops::ControlFlow;

/// The car brakes less than it is told to.
const SOFT: &str = "
struct Parameters {
    /// share of the braking that is lost [-], 0 to 0.9, neutral 0
    lost: f32,
}

fn soft_command(own: Parameters, a_cmd: f32) -> f32 {
    return select(a_cmd, (1.0 - own.lost) * a_cmd, a_cmd < 0.0);
}
";

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A synthetic platoon, read as a measured one would be.
    let platoon = plant::run(&plant::Scenario { duration_s: 300.0, ..Default::default() })?;
    let mut file = Vec::new();
    plant::write_pair(&platoon, 1, &mut file)?;
    let recording = import::read_bytes(&file, "pair.csv", None)?;
    let trajectory = prepare(&recording, 1, &Preparation::default())?.remove(0);

    let base: Variant = "l-cth".parse()?;
    let soft = read_extension("soft.wgsl", SOFT)?;
    for variant in [base, base.with(soft)?] {
        let convention = Convention::PAPER;
        let space = SearchSpace::new(&variant, None, convention, &Overrides::new())?;
        let case = Case::new(&trajectory, variant, None, convention, space.tau_p_upper())?;
        let mut lanes = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::Plain)?;
        let replicates = calibrate(&mut lanes, &space, &Calibration::default(), &mut |_| ControlFlow::Continue(()))?;
        let best = best(&replicates).expect("there is one replicate");
        println!("{:<12} NRMSE(s,v,a) {:.4}", variant.name(), best.score);
        for (symbol, value) in space.symbols.iter().zip(&best.candidate) {
            println!("  {:<6} {value:>9.4} {}", symbol.name(), symbol.unit());
        }
    }
    Ok(())
}
