//! Every limit for faults of the data and for their effect on the parameters of a model.

crate::numbers! {
    /// The size from which a deviation is a fault, and the one from which (`..._matters`) it changes the calibration.
    Limits LIMITS:
    significant = 4.5, "-", "Standard errors of a fault of scale, clock or offset: one false alarm in some 100,000 links";
    told = 9.0, "-", "Chi-squared by which the other car explains a fault less well: three standard errors";
    least_drive = 60.0, "s", "Driving that is needed to determine a scale or a clock";
    least_scale = 1e-4, "-", "A smaller scale is not a fault: a metre in ten kilometres";
    scale_matters = 0.01, "-", "A larger scale counts like a speed difference of 0.3 m/s on a motorway";
    least_clock = 0.02, "s", "A smaller shift of a clock is not a fault: a fifth of a usual time step";
    clock_share = 0.2, "-", "Nor is one below this share of the file's time step";
    clock_matters = 0.2, "s", "A larger shift is as long as a reaction of a car with ACC";
    least_offset = 0.05, "m", "A smaller offset of the gap is not a fault";
    offset_matters = 0.5, "m", "A larger offset changes `d_0` by a fifth";
    unrelated = 0.5, "m/s", "If gap rate and speed difference differ by more over a second, the signals do not belong together";
    contradiction = 2.0, "m/s", "The same without a correction of scales and clocks; and a position against its speed";
    jump = 0.5, "m", "The spacing jumps if it changes by this much more in a sample than the speeds allow";
    slow_jump = 2.0, "m", "The same within a second";
    jump_matters = 2.0, "m", "A larger jump within a sample may be another car";
    slow_jump_matters = 3.0, "m", "The same within a second";
    unusual = 12.0, "-", "Robust standard deviations of the usual changes of a signal, for jumps and spikes";
    spike = 2.0, "m", "A value of the gap this far off those around it is a spike";
    spikes = 0.1, "-", "Largest share of spikes; with more, the signal contradicts itself";
    braking = 12.0, "m/s²", "No car on a road changes its speed faster";
    held_chance = 1e-4, "-", "A value was held if it repeats by chance with a smaller probability in a file";
    held = 0.5, "s", "A coarse sensor holds a value for longer";
    held_step = 0.3, "m or m/s", "And the value then jumps by more";
    held_change = 1.0, "m", "Or the speeds imply that it changed by more meanwhile";
    held_matters = 0.01, "-", "Share of held or filled-in samples from which they bias parameters";
    coloured = 0.42, "-", "Autocorrelation of third differences beside that of white noise: sensors have up to 0.36";
    noise_rate = 8.0, "Hz", "In files of a lower rate, driving contributes as much to third differences as sensor noise";
    slow_rate = 2.0, "Hz", "A signal of a lower rate than this contains too little about accelerations";
    held_rate = 5.5, "Hz", "Highest rate of a held signal that matters: at 5 Hz it moves a_min by 6 %";
    coarse_speed = 0.2, "m/s", "Larger steps of a speed are visible in the acceleration: km/h without decimals";
    coarse_gap = 0.5, "m", "Larger steps of a gap are visible in the spacing";
    fast = 55.0, "m/s", "A car that follows another one is rarely faster: 198 km/h";
    mostly_noise = 0.5, "-", "With a larger share of noise in the variance of the acceleration, a score with it judges the sensor";
}
