//! The controller sees spacing and speeds as they were tp ago; the time loop delays them, between samples by interpolation.
//! in short: the car reacts to signals that are this old
//! equation: a_cmd(t) = law(s, v, dv at t - tp)
//! family: phase
//! looks like: residuals that follow the changes of the speed ahead, late
//! confounded with: actuation_lag, asym_lag, sensor_lowpass, time_offset
//! experiment: a leader that brakes and accelerates at once and hard, under sensors with little noise: a delay shifts the response, a lag or
//! filter rounds it
//! reference: Treiber, Kesting, Helbing 2006, Physica A 360(1), 71-88
//! loop: delay by tp
struct Parameters {
    /// delay of the perceived signals [s], 0 to 3, neutral 0
    tp: f32,
}
