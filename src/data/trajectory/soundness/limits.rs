//! Every number that decides what is a fault of the data, and which fault moves the parameters of a model.

crate::numbers! {
    /// From which size on something is a fault, and from which one on (`..._matters`) it moves what is calibrated.
    Limits LIMITS:
    significant = 4.5, "-", "Standard errors of a fault of scale, clock or offset: one false alarm in some 100,000 links";
    told = 9.0, "-", "Chi-squared by which the other car explains a fault worse: three standard errors";
    least_drive = 60.0, "s", "Driving that tells a scale or a clock";
    least_scale = 1e-4, "-", "A smaller scale is no fault: a metre in ten kilometres";
    scale_matters = 0.01, "-", "A scale from here on counts like a speed difference of 0.3 m/s on a motorway";
    least_clock = 0.02, "s", "A smaller shift of a clock is no fault: a fifth of a usual time step";
    clock_share = 0.2, "-", "Nor is one below this share of the file's time step";
    clock_matters = 0.2, "s", "A shift from here on is as long as a reaction of a car with ACC";
    least_offset = 0.05, "m", "A smaller offset of the gap is no fault";
    offset_matters = 0.5, "m", "An offset from here on changes `d_0` by a fifth";
    unrelated = 0.5, "m/s", "Rate of the gap less speed difference, over a second, of signals that do not belong together";
    jump = 0.5, "m", "Within a sample the gap changes by so much more than speeds allow where it jumps";
    slow_jump = 2.0, "m", "The same within a second";
    jump_matters = 2.0, "m", "A jump within a sample from here on may be another car";
    slow_jump_matters = 3.0, "m", "The same within a second";
    unusual = 12.0, "-", "Robust standard deviations of what a signal usually does: for jumps and spikes";
    spike = 2.0, "m", "A value of the gap this far off those around it is a spike";
    spikes = 0.1, "-", "Share of values that may be spikes: where there are more, the signal contradicts itself";
    braking = 12.0, "m/s²", "No car on a road changes its speed faster: what does is no driving";
    held_chance = 1e-4, "-", "A value that chance holds this seldom in a file was held";
    held = 0.5, "s", "A coarse sensor holds a value for longer";
    held_step = 0.3, "m or m/s", "And the value then jumps by more";
    held_change = 1.0, "m", "Or the speeds tell that it changed by more meanwhile";
    held_matters = 0.01, "-", "Share of a drive that was held, or filled in, from which on parameters follow it";
    coloured = 0.42, "-", "Autocorrelation of third differences beside that of white noise: sensors have up to 0.36";
    noise_rate = 8.0, "Hz", "In files of a lower rate driving leaves as much in third differences as the noise of sensors";
    slow_rate = 2.0, "Hz", "A signal of a lower rate than this lacks what tells accelerations";
    held_rate = 5.5, "Hz", "A signal that is held between samples of up to this rate: at 5 Hz it moves a_min by 6 %";
    coarse_speed = 0.2, "m/s", "Steps of a speed from here on are seen in the acceleration: km/h without decimals";
    coarse_gap = 0.5, "m", "Steps of a gap from here on are seen in the spacing";
    fast = 55.0, "m/s", "Hardly a car behind another one is faster: 198 km/h";
    mostly_noise = 0.5, "-", "Share of noise in the variance of the acceleration from which on a score with it judges the sensor";
}
