//! Extensions: whatever the file says, it is refused with its place, or it runs, and a small stack is enough for it.
#![no_main]

use leadlag::internal::catalog::Variant;
use leadlag::internal::convention::Convention;
use leadlag::internal::evaluator::{Case, Job, Observer, Population};
use leadlag::internal::lanes::{Lanes, LanesPrecision};
use leadlag::internal::score::GoodnessOfFit;
use leadlag::internal::symbols::{Bounds, Symbol};
use leadlag::internal::synthetic;
use leadlag::internal::trajectory::{Preparation, Trajectory, import, prepare};
use leadlag::internal::wgsl::read_extension;
use std::sync::LazyLock;

static DRIVE: LazyLock<Trajectory> = LazyLock::new(|| {
    let platoon =
        synthetic::run(&synthetic::Scenario { duration_s: 20.0, ..Default::default() }).expect("it can be driven");
    let mut file = Vec::new();
    synthetic::write_pair(&platoon, 1, &mut file).expect("memory");
    let recording = import::read_bytes(&file, "pair.csv", None).expect("just written");
    prepare(&recording, 1, &Preparation::default()).expect("a good drive").remove(0)
});

fn middle(symbol: Symbol) -> f64 {
    match symbol.bounds() {
        Bounds::Fixed(lower, upper) => 0.5 * (lower + upper),
        Bounds::PerVehicle => 1.0,
    }
}

/// Stack of the main thread on a small machine \[bytes\].
const STACK: usize = 512 << 10;

libfuzzer_sys::fuzz_target!(|text: &str| {
    std::thread::scope(|scope| {
        // A panic in the thread is a panic here.
        std::thread::Builder::new().stack_size(STACK).spawn_scoped(scope, || used(text)).expect("a thread");
    });
});

fn used(text: &str) {
    let Ok(extension) = read_extension("fuzzed.wgsl", text) else { return };
    for base in ["idm", "gipps", "l-cth"] {
        let base: Variant = base.parse().expect("a base");
        let Ok(variant) = base.with(extension) else { continue };
        let Ok(case) = Case::new(&DRIVE, variant, None, Convention::PAPER, 0.8) else { continue };
        // The base may lack parts that it reads, which is an error and not a panic.
        let Ok(mut lanes) = Lanes::new(vec![case], GoodnessOfFit::NRMSE_SVA, LanesPrecision::F64) else { continue };
        let symbols = variant.parameters();
        let mut population = Population::new(&symbols);
        population.push(&symbols.iter().map(|symbol| middle(*symbol)).collect::<Vec<_>>());
        let job = Job { case: 0, population: &population };
        let _ = lanes.raw(&[job]);
        let observer = Observer { gain: [0.2, 0.02, -0.05, 0.1, -0.03, 0.2], whitening: [0.7, -0.3, 1.6], decay: 0.95 };
        let _ = lanes.observed(&job, &[observer], 100);
    }
}
