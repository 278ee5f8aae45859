// The time loop: one invocation, one candidate. `src/models/lanes/run/time_loop.rs` does the same, operation for operation, on the CPU; the
// tests compare every bit. Generated in front of this file (src/models/gpu/kernel.rs), one set per pipeline: the constants DELAY,
// GRADE, MFC, REJECT, COMPENSATED, OBSERVER, LEAVES, EXTENDED, WORLD, LOOKS_BACK, RING_IN_STATES, WINDOW, PAST_IN_WINDOW (bool),
// ACCUMULATION (src/models/score.rs; ALL: everything the measures need, for `evaluate`), RING (a power of two), WORKGROUP,
// WINDOW_LENGTH, PARAMETERS, MOTION_WORDS and MEMORY_WORDS (u32); the functions `load_params`, `params_are_finite`,
// `load_motion`, `save_motion`, `load_memory`, `save_memory`, `initial_memory`, `corrected` (the missing acceleration), `set_zeros` and `stepped`, which is `step` with or without extensions.

// Values of ACCUMULATION.
const SQUARED = 0u;
const RELATIVE = 1u;
const THEIL = 2u;
const FLOORED = 3u;
const ALL = 4u;

// One candidate population on one trajectory.
struct Job {
    // First of its entries in `samples`, in vec4, and the number of samples.
    sample: u32,
    samples: u32,
    // First of its entries in `norms`; entry k belongs to a run that starts at sample k.
    norm: u32,
    // First cell in `cells` (in vec4) and number of cells of the tables of grade and MFC curves.
    grade_cell: u32,
    grade_cells: u32,
    mfc_cell: u32,
    mfc_cells: u32,
    // Mass of the follower [kg], its equivalent inertial mass factor, time step [s], length of a closed track [m] or 0.
    m_0: f32,
    phi_f: f32,
    dt: f32,
    period: f32,
    per_period: f32,
    // Start of the tables, and their cells per metre, or per m/s.
    grade_origin: f32,
    grade_per_width: f32,
    mfc_origin: f32,
    mfc_per_width: f32,
}

// Coefficients of a score in the sums, for spacing, speed and acceleration (src/models/score.rs, `Norm`).
struct Norm {
    per_count: vec3<f32>,
    weight: vec3<f32>,
    rms_measured: vec3<f32>,
}

// Work of one submission: samples from_sample to to_sample - 1 of every candidate.
struct Chunk {
    from_sample: u32,
    to_sample: u32,
    // Candidates in this dispatch, and the distance of two words of one candidate in `candidates`, `states` and `results`.
    candidates: u32,
    stride: u32,
    // Zero; see opaque.wgsl. It also keeps a driver from unrolling every loop over the ring, which would take longer to compile than all
    // the rest.
    zero: u32,
    // With an observer: samples in a block of sums.
    block: u32,
    // Zeros; see between.wgsl.
    even_zero: u32,
    odd_zero: u32,
    // With WINDOW: the entry of `samples` that `window` begins with.
    window: u32,
}

// Three vec4 per sample: (v_l, dx_l, s, v_f) (a_f, x_road, v_denominator, s_start) (1/denominator of s, v, a; unused), and with
// extensions a fourth: (a_l, v_l2, s_l2, t).
@group(0) @binding(0) var<storage, read> jobs: array<Job>;
@group(0) @binding(1) var<storage, read> samples: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> norms: array<Norm>;
@group(0) @binding(3) var<storage, read> cells: array<vec4<f32>>;
// Per candidate its Params, then back and fraction of the delay, first sample, job; with LOOKS_BACK back and fraction of the
// whole and of the half way; with OBSERVER, with r = predicted - measured, six gains (s -= k0 r_s + k1 r_v, v -= k2 r_s + k3 r_v,
// d -= k4 r_s + k5 r_v), three whitening factors ((w0 r_s)^2 and (w1 r_s + w2 r_v)^2 are added up per block of samples), and the
// decay of d, which is part of its Params. Words, not floats: small integers are denormal floats, which a driver may flush to 0.
@group(0) @binding(4) var<storage, read> candidates: array<u32>;
@group(0) @binding(5) var<storage, read_write> states: array<u32>;
@group(0) @binding(6) var<storage, read_write> results: array<u32>;
// With OBSERVER, two sums of each block of samples; with LEAVES, the three errors that the score squares at each sample of this chunk;
// before a run starts, zeros.
@group(0) @binding(7) var<storage, read_write> blocks: array<f32>;
@group(0) @binding(8) var<uniform> chunk: Chunk;
@group(0) @binding(9) var<uniform> window: array<vec4<f32>, WINDOW_LENGTH>;

const SAMPLE_WORDS: u32 = select(3u, 4u, WORLD);
const AT_LOOK_BACK: u32 = PARAMETERS + 4u;
const AT_OBSERVER: u32 = AT_LOOK_BACK + select(0u, 4u, LOOKS_BACK);

// Status of a run: 0 while it continues, else the top bit, the kind, and the sample; or DONE after its last sample.
const DONE = 1u;
const FAILED: u32 = 0x80000000u;
const CRASH: u32 = 0u << 28u;
const RADICAND: u32 = 1u << 28u;
const NOT_FINITE: u32 = 2u << 28u;
const REJECTED: u32 = 3u << 28u;
// The score of a complete run with an undefined goodness of fit.
const UNDEFINED: u32 = 0x7fc00000u;

// On some drivers a comparison with itself does not detect a NaN; a check of its bits does.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// Entry `at` of `samples`: the sample of a candidate. This is faster than the next function, because most candidates are
// at the same sample.
fn sample(at: u32) -> vec4<f32> {
    if (WINDOW) {
        return window[at - chunk.window];
    }
    return samples[at];
}

// The same if each candidate looks up another sample.
fn past_sample(at: u32) -> vec4<f32> {
    if (PAST_IN_WINDOW) {
        return window[at - chunk.window];
    }
    return samples[at];
}

fn total(sum: Triple) -> vec3<f32> {
    if (!COMPENSATED) {
        return sum.high;
    }
    return sum.high + sum.low;
}

// The sums and states that a run needs; the compiler drops the rest of the code below.
const HAS_SIMULATED = ACCUMULATION == THEIL || ACCUMULATION == ALL;
const HAS_ALL = ACCUMULATION == ALL;
const HAS_CUTS = REJECT || HAS_ALL;

// Words of one candidate in `states`: status, cuts, state, sums, block, ring. src/models/gpu/kernel.rs counts them too.
const TRIPLE_WORDS: u32 = select(3u, 6u, COMPENSATED);
const AT_MOTION: u32 = 3u;
const AT_MEMORY: u32 = AT_MOTION + MOTION_WORDS;
const AT_ERROR: u32 = AT_MEMORY + MEMORY_WORDS;
const AT_SIMULATED: u32 = AT_ERROR + TRIPLE_WORDS;
const AT_RELATIVE: u32 = AT_SIMULATED + select(0u, TRIPLE_WORDS, HAS_SIMULATED);
const AT_FLOORED: u32 = AT_RELATIVE + select(0u, TRIPLE_WORDS, HAS_ALL);
const AT_BLOCK: u32 = AT_FLOORED + select(0u, TRIPLE_WORDS, HAS_ALL);
const AT_RING: u32 = AT_BLOCK + select(0u, 2u, OBSERVER);

fn candidate_word(word: u32, i: u32) -> u32 {
    return candidates[word * chunk.stride + i];
}

fn candidate(word: u32, i: u32) -> f32 {
    return bitcast<f32>(candidate_word(word, i));
}

fn saved(word: u32, i: u32) -> f32 {
    return bitcast<f32>(states[word * chunk.stride + i]);
}

fn save(word: u32, i: u32, x: f32) {
    states[word * chunk.stride + i] = bitcast<u32>(x);
}

fn leave(t: u32, i: u32, errors: vec3<f32>) {
    let at = 3u * (t - chunk.from_sample) * chunk.stride + i;
    blocks[at] = errors.x;
    blocks[at + chunk.stride] = errors.y;
    blocks[at + 2u * chunk.stride] = errors.z;
}

fn saved3(word: u32, i: u32) -> vec3<f32> {
    return vec3<f32>(saved(word, i), saved(word + 1u, i), saved(word + 2u, i));
}

fn save3(word: u32, i: u32, x: vec3<f32>) {
    save(word, i, x.x);
    save(word + 1u, i, x.y);
    save(word + 2u, i, x.z);
}

fn load_triple(word: u32, i: u32) -> Triple {
    var sum = Triple(saved3(word, i), vec3<f32>());
    if (COMPENSATED) {
        sum.low = saved3(word + 3u, i);
    }
    return sum;
}

fn save_triple(word: u32, i: u32, sum: Triple) {
    save3(word, i, sum.high);
    if (COMPENSATED) {
        save3(word + 3u, i, sum.low);
    }
}

// The last RING samples' (s, v_f), for perception with delay; sample t is entry t mod RING. A long one does not fit into the
// memory of an invocation and lies in `states`.
var<private> ring: array<vec2<f32>, select(RING, 1u, RING_IN_STATES)>;

fn remember(t: u32, i: u32, now: Motion) {
    let k = t & (RING - 1u);
    if (RING_IN_STATES) {
        save(AT_RING + 2u * k, i, now.s);
        save(AT_RING + 2u * k + 1u, i, now.v_f);
    } else {
        ring[k] = vec2<f32>(now.s, now.v_f);
    }
}

fn remembered(t: u32, i: u32) -> vec2<f32> {
    let k = t & (RING - 1u);
    if (RING_IN_STATES) {
        return vec2<f32>(saved(AT_RING + 2u * k, i), saved(AT_RING + 2u * k + 1u, i));
    }
    return ring[k];
}

// Sine of the grade under a follower with spacing s; at spacing 0 the follower would be at x_road.
fn sin_grade_at(job: Job, x_road: f32, s: f32) -> f32 {
    var x = x_road - s;
    if (job.period > 0.0) {
        x = x - job.period * floor(x * job.per_period);
    }
    let place = max((x - job.grade_origin) * job.grade_per_width, 0.0);
    let cell = min(u32(min(place, 1e6)), job.grade_cells - 1u);
    let line = cells[job.grade_cell + cell];
    let d = x - line.x;
    return line.y + select(line.z, line.w, d > 0.0) * d;
}

// (a_dp, a_ap) at speed v.
fn mfc_bounds(job: Job, v: f32) -> vec2<f32> {
    let place = max((v - job.mfc_origin) * job.mfc_per_width, 0.0);
    let cell = job.mfc_cell + 3u * min(u32(min(place, 1e6)), job.mfc_cells - 1u);
    let node = cells[cell];
    let d = v - node.x;
    let line = cells[cell + select(2u, 1u, d < 0.0)];
    return select(line.xz + line.yw * d, node.yz, d == 0.0);
}

// Speed of the preceding vehicle `back` samples before sample t - 1, and a `fraction` of the step further.
fn looked_up(job: Job, t: u32, word: u32, i: u32) -> f32 {
    let last = i32(job.samples) - 1;
    let sample = i32(t) - 1 - bitcast<i32>(candidate_word(word, i));
    let older = samples[job.sample + u32(clamp(sample, 0, last)) * SAMPLE_WORDS].x;
    let younger = samples[job.sample + u32(clamp(sample + 1, 0, last)) * SAMPLE_WORDS].x;
    return older + (younger - older) * candidate(word + 1u, i);
}

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.y * groups.x * WORKGROUP + id.x;
    if (i >= chunk.candidates) {
        return;
    }
    opaque_zero = chunk.zero;
    set_zeros(chunk.even_zero, chunk.odd_zero);
    let n = chunk.stride;
    let p = load_params(i);
    let back = candidate_word(PARAMETERS, i);
    let fraction = candidate(PARAMETERS + 1u, i);
    let first = candidate_word(PARAMETERS + 2u, i);
    let job = jobs[candidate_word(PARAMETERS + 3u, i)];

    var now: Motion;
    var memory: Memory;
    var status = 0u;
    var cut_acc = 0u;
    var cut_dec = 0u;
    var error2 = Triple();
    var simulated2 = Triple();
    var relative2 = Triple();
    var floored2 = Triple();
    var block = vec2<f32>();
    var t = max(chunk.from_sample, first);
    if (chunk.from_sample == 0u) {
        for (var k = 0u; k < first; k++) {
            let at = job.sample + k * SAMPLE_WORDS;
            let x = Perceived(samples[at + 1u].w, samples[at].w, samples[at].x);
            now = at_rest_in(starting_spacing(p, x), x.v_f, samples[at + 1u].x);
            if (EXTENDED) {
                memory = initial_memory(samples[at].z, x.v_f, x.v_l, samples[at + 1u].x);
            }
            if (DELAY) {
                remember(k, i, now);
            }
            if (status == 0u && now.s <= 0.0) {
                status = FAILED | CRASH | k;
            }
        }
        if (!params_are_finite(p)) {
            status = FAILED | NOT_FINITE | first;
        }
    } else {
        if (states[i] != 0u) {
            return;
        }
        cut_acc = states[n + i];
        cut_dec = states[2u * n + i];
        now = load_motion(AT_MOTION, i);
        memory = load_memory(AT_MEMORY, i);
        error2 = load_triple(AT_ERROR, i);
        if (HAS_SIMULATED) {
            simulated2 = load_triple(AT_SIMULATED, i);
        }
        if (HAS_ALL) {
            relative2 = load_triple(AT_RELATIVE, i);
            floored2 = load_triple(AT_FLOORED, i);
        }
        if (OBSERVER) {
            block = vec2<f32>(saved(AT_BLOCK, i), saved(AT_BLOCK + 1u, i));
        }
        if (DELAY && !RING_IN_STATES) {
            for (var k = 0u; k < (RING | chunk.zero); k++) {
                ring[k] = vec2<f32>(saved(AT_RING + 2u * k, i), saved(AT_RING + 2u * k + 1u, i));
            }
        }
    }

    let to = min(chunk.to_sample, job.samples);
    var at = job.sample + t * SAMPLE_WORDS;
    // Speed of the preceding vehicle one sample before.
    var v_l = samples[at - SAMPLE_WORDS].x;
    for (; t < to && status == 0u; t++) {
        var x = Perceived(now.s, now.v_f, v_l);
        var given = Given();
        if (WORLD) {
            let known = sample(at - SAMPLE_WORDS + 3u);
            given.t = known.w;
            given.a_l = known.x;
            given.v_l2 = known.y;
            given.s_l2 = known.z;
            given.x_f = sample(at - SAMPLE_WORDS + 1u).y - now.s;
            if (job.period > 0.0) {
                given.x_f = given.x_f - job.period * floor(given.x_f * job.per_period);
            }
        }
        if (LOOKS_BACK) {
            given.v_l_then = looked_up(job, t, AT_LOOK_BACK, i);
            given.v_l_half = looked_up(job, t, AT_LOOK_BACK + 2u, i);
        }
        if (DELAY) {
            let older = t - 1u - back;
            let younger = min(older + 1u, t - 1u);
            let past = remembered(older, i);
            let by = (remembered(younger, i) - past) * fraction;
            let leader = past_sample(job.sample + older * SAMPLE_WORDS).x;
            x.s = past.x + by.x;
            x.v_f = past.y + by.y;
            x.v_l = leader + (past_sample(job.sample + younger * SAMPLE_WORDS).x - leader) * fraction;
            if (WORLD) {
                let ahead = past_sample(job.sample + older * SAMPLE_WORDS + 3u).xyz;
                let later = past_sample(job.sample + younger * SAMPLE_WORDS + 3u).xyz;
                given.a_l = ahead.x + (later.x - ahead.x) * fraction;
                given.v_l2 = ahead.y + (later.y - ahead.y) * fraction;
                given.s_l2 = ahead.z + (later.z - ahead.z) * fraction;
            }
        }
        var road = Road();
        if (GRADE) {
            road.sin_grade = sin_grade_at(job, sample(at - SAMPLE_WORDS + 1u).y, now.s);
        }
        if (MFC) {
            let bounds = mfc_bounds(job, now.v_f);
            road.a_dp = bounds.x;
            road.a_ap = bounds.y;
        }
        let here = sample(at);
        let measured = vec3<f32>(here.z, here.w, sample(at + 1u).x);
        let done = stepped(p, x, now, memory, job.m_0, job.phi_f, road, given, here.y, job.dt);
        // Before any clamp: a minimum or maximum would hide a NaN.
        let finite = is_finite(done.a_free);
        if (HAS_CUTS) {
            cut_acc += select(0u, 1u, finite && done.a < done.a_free);
            cut_dec += select(0u, 1u, finite && done.a > done.a_free);
        }
        now = done.next;
        memory = done.memory;
        // The first one that applies; a single branch, because each is expensive.
        let crashed = select(0u, FAILED | CRASH | t, now.s <= 0.0);
        let answered = select(FAILED | RADICAND | t, crashed, done.feasible);
        status = select(FAILED | NOT_FINITE | t, answered, finite);
        if (status != 0u) {
            break;
        }

        let simulated = vec3<f32>(now.s, now.v_f, now.a_f);
        let error = simulated - measured;
        var weighted = error;
        if (ACCUMULATION == RELATIVE) {
            weighted = error * sample(at + 2u).xyz;
        } else if (ACCUMULATION == FLOORED) {
            weighted.y = now.v_f - sample(at + 1u).z;
        }
        error2 = add(error2, weighted * weighted);
        if (LEAVES) {
            leave(t, i, weighted);
        }
        if (HAS_SIMULATED) {
            simulated2 = add(simulated2, simulated * simulated);
        }
        if (HAS_ALL) {
            let relative = error * sample(at + 2u).xyz;
            relative2 = add(relative2, relative * relative);
            let floored = vec3<f32>(error.x, now.v_f - sample(at + 1u).z, error.z);
            floored2 = add(floored2, floored * floored);
        }
        if (OBSERVER) {
            let by_s = vec3<f32>(
                candidate(AT_OBSERVER, i), candidate(AT_OBSERVER + 2u, i), candidate(AT_OBSERVER + 4u, i),
            );
            let by_v = vec3<f32>(
                candidate(AT_OBSERVER + 1u, i), candidate(AT_OBSERVER + 3u, i), candidate(AT_OBSERVER + 5u, i),
            );
            let correction = by_s * error.x + by_v * error.y;
            now.s = now.s - correction.x;
            now.v_f = max(now.v_f - correction.y, 0.0);
            memory = corrected(memory, correction.z);
            let white = vec2<f32>(
                candidate(AT_OBSERVER + 6u, i) * error.x,
                candidate(AT_OBSERVER + 7u, i) * error.x + candidate(AT_OBSERVER + 8u, i) * error.y,
            );
            block = block + white * white;
            if ((t + 1u) % chunk.block == 0u || t + 1u == job.samples) {
                let k = 2u * (t / chunk.block);
                blocks[k * n + i] = block.x;
                blocks[(k + 1u) * n + i] = block.y;
                block = vec2<f32>();
            }
        }
        if (DELAY) {
            remember(t, i, now);
        }
        v_l = here.x;
        at += SAMPLE_WORDS;
    }

    if (status == 0u && t < job.samples) {
        states[i] = 0u;
        states[n + i] = cut_acc;
        states[2u * n + i] = cut_dec;
        save_motion(AT_MOTION, i, now);
        save_memory(AT_MEMORY, i, memory);
        save_triple(AT_ERROR, i, error2);
        if (HAS_SIMULATED) {
            save_triple(AT_SIMULATED, i, simulated2);
        }
        if (HAS_ALL) {
            save_triple(AT_RELATIVE, i, relative2);
            save_triple(AT_FLOORED, i, floored2);
        }
        if (OBSERVER) {
            save(AT_BLOCK, i, block.x);
            save(AT_BLOCK + 1u, i, block.y);
        }
        if (DELAY && !RING_IN_STATES) {
            for (var k = 0u; k < (RING | chunk.zero); k++) {
                save(AT_RING + 2u * k, i, ring[k].x);
                save(AT_RING + 2u * k + 1u, i, ring[k].y);
            }
        }
        return;
    }
    // The run has ended; later chunks do not change it.
    states[i] = select(status, DONE, status == 0u);
    if (HAS_ALL) {
        results[i] = status;
        results[n + i] = cut_acc;
        results[2u * n + i] = cut_dec;
        result3(3u, i, total(error2));
        result3(6u, i, total(simulated2));
        result3(9u, i, total(relative2));
        results[12u * n + i] = bitcast<u32>(total(floored2).y);
        return;
    }
    if (status == 0u) {
        status = score(job, first, error2, simulated2);
        if (REJECT && cut_acc + cut_dec > 0u) {
            status = FAILED | REJECTED;
        }
    }
    results[i] = status;
}

fn result3(word: u32, i: u32, x: vec3<f32>) {
    let at = word * chunk.stride + i;
    results[at] = bitcast<u32>(x.x);
    results[at + chunk.stride] = bitcast<u32>(x.y);
    results[at + 2u * chunk.stride] = bitcast<u32>(x.z);
}

// The score, as 4 bytes.
fn score(job: Job, first: u32, error2: Triple, simulated2: Triple) -> u32 {
    let norm = norms[job.norm + first];
    var term = sqrt(total(error2) * norm.per_count) * norm.weight;
    if (ACCUMULATION == THEIL) {
        term = term / (sqrt(total(simulated2) * norm.per_count) + norm.rms_measured);
    }
    let value = (term.x + term.y) + term.z;
    return select(UNDEFINED, bitcast<u32>(value), is_finite(value));
}
