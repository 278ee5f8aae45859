//! Tells whether a changed text still gives the same bits on the GPU: for the files that only a GPU runs as they stand.
//!
//! That the unchanged text is right is for other tests to say: they compare its bits with `lanes` and its scores with the reference.

use super::gpu_common::{case, job, population};
use leadlag::convention::{BoundRule, Convention};
use leadlag::evaluator::{Evaluator, Observer, Population, Score};
use leadlag::gpu::{AdapterChoice, Gpu, Limits};
use leadlag::symbols::Symbol;
use leadlag::wgsl::Precision;

/// Samples: some chunks, a wrap of the ring, several blocks of the observer.
const SAMPLES: usize = 60;

/// Something that is run on the GPU, and what came out without any change, as text (shortest round-trip form: every bit counts).
pub struct Scene {
    gpu: Gpu,
    population: Population,
    what: What,
    expected: String,
}

#[derive(Debug, Clone, Copy)]
enum What {
    /// Everything the measures need.
    Raw,
    /// Scores.
    Scores,
    /// Runs corrected towards the measurement.
    Observed,
}

/// Variant, precision, what is asked for, goodness of fit, longest delay \[s\], clipping or rejecting: until everything in the kernel
/// decides somewhere. Kernels that a driver compiles quickly come first, for the first scene that notices a mutant is the last.
const SCENES: [(&str, Precision, What, &str, f64, BoundRule); 8] = [
    ("idm+linear+constant", Precision::Plain, What::Scores, "nrmse-sva", 0.8, BoundRule::Reject),
    ("l-cth", Precision::Plain, What::Scores, "rmspe-sva", 0.8, BoundRule::Clip),
    ("l-cth", Precision::Plain, What::Scores, "rmse-sn-vn", 0.8, BoundRule::Clip),
    ("idm+delay", Precision::Plain, What::Observed, "nrmse-sva", 0.8, BoundRule::Clip),
    // A ring that does not fit into an invocation.
    ("l-idm+delay+constant", Precision::Plain, What::Scores, "nrmse-sva", 7.0, BoundRule::Clip),
    ("l-gipps+nonlinear+mfc", Precision::Plain, What::Scores, "nrmse-sva", 0.8, BoundRule::Clip),
    ("idm", Precision::Compensated, What::Scores, "u-sva", 0.8, BoundRule::Clip),
    ("gipps+delay+nonlinear+mfc", Precision::Compensated, What::Raw, "nrmse-sva", 0.8, BoundRule::Clip),
];

/// All scenes, run once as they are.
pub fn scenes() -> Vec<Scene> {
    let scene =
        |(variant, precision, what, gof, tau_p_upper, bounds): (&str, Precision, What, &str, f64, BoundRule)| {
            let variant = variant.parse().expect("a variant");
            let convention = Convention { bounds, ..Convention::PAPER };
            let samples = if tau_p_upper > 1.0 { 2 * SAMPLES + 40 } else { SAMPLES };
            let mut whole = case(variant, convention, samples, 0.3);
            whole.tau_p_upper = tau_p_upper;
            // The drive passes the end of the closed track, 1200 m.
            whole.x_l = whole.x_l.iter().map(|x| x + 1120.0).collect();
            whole.x_f = whole.x_f.iter().map(|x| x + 1120.0).collect();
            let limits = Limits { chunk: Some(40), ..Limits::NONE };
            let gof = gof.parse().expect("a goodness of fit");
            // Two cases, so that offsets into the tables matter.
            let cases = vec![case(variant, convention, 25, 1.0), whole];
            let gpu =
                Gpu::with_limits(cases, gof, precision, &AdapterChoice::Best, limits).unwrap_or_else(|e| panic!("{e}"));
            let mut population = population(variant, convention, 70, 3);
            population.push(&broken(&population));
            let mut scene = Scene { gpu, population, what, expected: String::new() };
            scene.expected = scene.run().unwrap_or_else(|e| panic!("{variant}: {e}"));
            scene
        };
    SCENES.into_iter().map(scene).collect()
}

/// A candidate whose run is no number.
fn broken(population: &Population) -> Vec<f64> {
    let mut values = population.values(0).to_vec();
    if let Some(k) = population.symbols().iter().position(|s| *s == Symbol::d_0) {
        values[k] = f64::NAN;
    }
    values
}

impl Scene {
    fn run(&mut self) -> Result<String, String> {
        let Scene { gpu, population, what, .. } = self;
        let jobs = [job(0, population), job(1, population)];
        match what {
            What::Raw => gpu.raw(&jobs).map(|raw| format!("{raw:?}")),
            What::Scores => {
                let mut scores = vec![Score::Rejected; population.len()];
                gpu.evaluate(population, &mut scores).map(|()| format!("{scores:?}"))
            }
            What::Observed => {
                let observer = Observer { gain: [0.1, 0.02, 0.03, 0.2], whitening: [1.0, 0.3, 2.0], block: 8 };
                gpu.observed(&job(1, population), &observer).map(|observed| format!("{observed:?}"))
            }
        }
        .map_err(|e| e.to_string())
    }

    /// What is noticed with another text in the place of a file.
    pub fn verdict(&mut self, file: &str, text: &str) -> Result<(), String> {
        self.gpu.replace_shader(file, text).map_err(|e| e.to_string())?;
        let found = self.run()?;
        if found == self.expected { Ok(()) } else { Err("other bits".to_owned()) }
    }
}
