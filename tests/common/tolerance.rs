//! Every tolerance of the tests, with the reason why it is not smaller. Never widen one to make a test pass.

/// Hand-worked numbers: relative to the larger of 1 and the expected value. Not smaller: the stored acceleration is a
/// difference of speeds of 20 to 50 m/s over 0.1 s, so that one last bit of the speed (7e-15 m/s) is 7e-14 m/s², and a
/// step has up to ten such roundings.
pub const HAND_WORKED: f64 = 1e-12;

/// A score that is continuous in tau_p: change allowed for 1e-9 s of delay. Not smaller: the bench's signals jump by up to 6 m per
/// sample, so that the score changes by about 1 per second of delay; a jump by one whole sample would be 1e-2.
pub const CONTINUOUS: f64 = 1e-7;

/// Relative, each of the seventeen measures of a well-conditioned golden row: two f64 programs that order their
/// operations differently agree to about 1e-13, and some runs amplify that by three orders of magnitude.
pub const GOLDEN_MEASURE: f64 = 1e-9;

/// Relative, measures of the few rows in which such a rounding difference changes the branch of a clamp or minimum.
pub const GOLDEN_CHAOTIC: f64 = 1e-6;

/// Relative: half a unit in the ninth digit, with which the golden trajectories are printed.
pub const NINE_DIGITS: f64 = 5e-9;

/// s \[m\], v \[m/s\], a \[m/s²\] of the golden trajectories, beside [`NINE_DIGITS`]: rounding differences of two f64
/// programs, amplified along a run of 900 s.
pub const GOLDEN_STATE: f64 = 1e-6;

/// NRMSE(s,v,a) of a variant on its own simulation: the measured acceleration is differenced again from speeds near
/// 20 m/s, which costs 1e-13 m/s², and spacing from positions near 2 km.
pub const SELF_DRIVEN: f64 = 1e-9;

/// Share of a parameter's range by which an optimiser may miss a known value after 30,000 evaluations: the genetic algorithm
/// has no local search.
pub const RECOVERED: f64 = 0.02;

/// Relative, NRMSE(s,v,a) of a well-conditioned golden row in plain f32, for 99 % of the rows: f32 has 24 bits, a run some
/// ten thousand steps of rounding, and a condition number of ten is not rare.
pub const GOLDEN_F32: f64 = 5e-5;

/// Relative, median over all golden rows in plain f32: rounding errors of f32 (6e-8) add up like a random walk.
pub const GOLDEN_F32_MEDIAN: f64 = 1e-6;

/// Share of candidates that end alike in f32 and in f64: those that nearly crash may differ.
pub const SAME_STATUS: f64 = 0.995;

/// The same if a driver fuses products with sums, as hardware does: other candidates differ (golden rows on an NVIDIA H200: 31 of 5760; in
/// f32 without fusing 25).
pub const SAME_STATUS_FUSED: f64 = 0.99;

/// Sine of the grade, look-up in a table of lines against interpolation between nodes: both are f64, but a line is anchored at another
/// point than the interpolation.
pub const TABLE: f64 = 1e-14;

/// Relative, NRMSE(s,v,a) of a GPU (f32) against the reference over a short run: measured on lavapipe for candidates whose score
/// is not ill-conditioned, 2e-5 is the largest error of plain f32 over 9000 samples.
pub const GPU_SCORE: f64 = 2e-5;

/// Relative change of a score of the f64 reference when every parameter changes by up to 1e-6 of itself, above which the
/// candidate does not test an f32 evaluator: eight roundings of its parameters alone would do the same.
pub const GPU_ILL_CONDITIONED: f64 = 1e-5;

/// Relative, seventeen measures of a whole run, f64 of the WGSL text against the reference: the two write the spacing as a
/// state and as a difference of positions of up to 6 km, whose last bit is 1e-12 m.
pub const WHOLE_RUN: f64 = 1e-9;

/// Factor by which a run amplifies rounding differences: the change of the reference when its own parameters move by [`NUDGE`], times
/// [`AMPLIFIED`]. For a linear controller with gains of 5/s² and no lag, no smaller value is possible.
pub const NUDGE: f64 = 1e-13;

/// See [`NUDGE`]; a run of 9000 steps makes tens of thousands of roundings of 1e-16, and four nudges do not find the worst.
pub const AMPLIFIED: f64 = 1000.0;

/// Relative, one part alone, beside the changes of the reference if its arguments move by as much, one after the other: where
/// large numbers cancel, the last bits of the arguments decide, and the two texts order their operations differently.
pub const PART: f64 = 1e-12;

/// Relative, the same for the candidates whose run amplifies a rounding difference, or in which one changes the branch of a clamp or
/// minimum.
pub const WHOLE_RUN_SENSITIVE: f64 = 1e-3;

/// Condition number up to which a score tests an evaluator: a candidate above it turns the roundings of its own
/// parameters (6e-8) into more than 6e-7 before the evaluator has done anything.
pub const CONDITIONED: f64 = 10.0;

/// Relative, NRMSE(s,v,a) in plain f32, for 99 % of the candidates with K <= [`CONDITIONED`]: ten thousand steps of roundings of
/// 6e-8, amplified up to ten times.
pub const SCORE_PLAIN: f64 = 2e-5;

/// The same, compensated: only roundings of the parameters, of the measured signals and within a step remain.
pub const SCORE_COMPENSATED: f64 = 3e-6;

/// Relative, for 99.9 % of the same candidates in either precision: K is the largest change that a few trials met, not a bound.
pub const LARGEST_EXCEPTION: f64 = 3e-4;

/// Relative change of the parameters within which a candidate that ends otherwise in f32 does so in f64 too.
pub const DISTANCE_TO_BOUNDARY: f64 = 1e-5;

/// Difference of spacings \[m\] at which two runs in f64 count as chaotic: rounding has grown by fourteen decades.
pub const CHAOTIC: f64 = 0.1;

/// s \[m\] (times s / 100 m beyond 100 m), v \[m/s\], a \[m/s²\] of f32 one step from a state of the reference: the last bit of 100 m
/// is 8e-6 m and that of 30 m/s 2e-6 m/s, and an acceleration reads them with gains of up to 5 per second or second squared,
/// or divides by a spacing of a few metres.
pub const FIRST_STEP: [f64; 3] = [3e-5, 1e-4, 1e-3];

/// The same within 50 steps: fifty such roundings, fed back by the controller.
pub const WINDOW: [f64; 3] = [1e-3, 1e-3, 1e-3];

/// A window may exceed [`WINDOW`] if f64, started from the same states rounded to f32 or moved by one last bit of it, misses the
/// reference by more than this fraction of it. Not smaller: f32 rounds speed and spacing at each of 50 steps, a hundred
/// times in all, the start only once.
pub const UNSTABLE: f64 = 100.0;

/// Share of the windows of a kind that may be unstable. Not smaller: of the runs with K > [`CONDITIONED`] one in 28 is, over Table 3,
/// because the step of 0.1 s is too long for the gains there.
pub const UNSTABLE_SHARE: f64 = 0.05;

/// Condition number up to which two programs in f64 have to agree on a whole run within [`WHOLE_RUN`].
pub const CONDITIONED_IN_F64: f64 = 100.0;

/// Share of these that do. Not 1: K tries sixteen changes of the parameters, and does not detect a controller that oscillates from step to
/// step, in which the roundings of 9000 steps grow.
pub const SAME_IN_F64: f64 = 0.995;

/// Relative, optimum of a calibration by L-SHADE scored in f64: the search ends when its candidates nearly coincide, by scores that f32
/// rounds by 1e-6, and the flat surface of L-CTH leaves half of this.
pub const SAME_OPTIMUM: f64 = 1e-4;

/// Sine of the grade, table with thinned nodes: the error that thinning allows, once on either side.
pub const THINNED: f64 = 2e-6;
