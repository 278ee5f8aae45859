//! Every tolerance of the tests, with the reason why it is not smaller. Never widen one to make a test pass.

/// Hand-worked numbers: relative to the larger of 1 and the expected value. Not smaller: the stored acceleration is a
/// difference of speeds of 20 to 50 m/s over 0.1 s, so that one last bit of the speed (7e-15 m/s) is 7e-14 m/s², and a
/// step has up to ten such roundings.
pub const HAND_WORKED: f64 = 1e-12;

/// A score that is continuous in tau_p: change allowed for 1e-9 s of delay. Not smaller: the bench's signals jump by up to 6 m per
/// sample, so that the score changes by about 1 per second of delay; a jump by one whole sample would be 1e-2.
pub const CONTINUOUS: f64 = 1e-7;
