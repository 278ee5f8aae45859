// The time loop: one invocation, one candidate. `src/lanes/run.rs` does the same, operation for operation, on the CPU; the
// tests compare every bit. Generated in front of this file, as constants of the pipeline: DELAY, GRADE, MFC, REJECT,
// COMPENSATED, OBSERVER (bool), ACCUMULATION (src/score.rs; ALL: everything the measures need, for `evaluate`), RING and
// WORKGROUP (u32), PARAMETERS (u32, words of one candidate's Params); and `load_params`.

// Values of ACCUMULATION.
const SQUARED = 0u;
const RELATIVE = 1u;
const THEIL = 2u;
const FLOORED = 3u;
const ALL = 4u;

// One candidate population on one trajectory.
struct Job {
    // First of its entries in `samples`, in vec4, and how many samples there are.
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
    // Where the tables begin, and their cells per metre, or per m/s.
    grade_origin: f32,
    grade_per_width: f32,
    mfc_origin: f32,
    mfc_per_width: f32,
}

// How a score follows from the sums, for spacing, speed and acceleration (src/score.rs, `Norm`).
struct Norm {
    per_count: vec3<f32>,
    weight: vec3<f32>,
    rms_measured: vec3<f32>,
}

// What one submission does: samples from_sample to to_sample - 1 of every candidate.
struct Chunk {
    from_sample: u32,
    to_sample: u32,
    // Candidates in this dispatch, and the distance of two words of one candidate in `candidates`, `states` and `results`.
    candidates: u32,
    stride: u32,
    // Zero; see opaque.wgsl.
    zero: u32,
}

// Correction of the state by the residuals r of each sample, s -= gain.x r_s + gain.y r_v, v -= gain.z r_s + gain.w r_v, and
// sums of whitened squares per block of samples: (whitening.x r_s)^2 and (whitening.y r_s + whitening.z r_v)^2.
struct Observer {
    gain: vec4<f32>,
    whitening: vec3<f32>,
    block: u32,
}

// Two vec4 per sample (v_l, dx_l, s, v_f) (a_f, x_road, v_denominator, s_start); a third one with 1/denominator of s, v, a
// where ACCUMULATION is RELATIVE or ALL.
@group(0) @binding(0) var<storage, read> jobs: array<Job>;
@group(0) @binding(1) var<storage, read> samples: array<vec4<f32>>;
@group(0) @binding(2) var<storage, read> norms: array<Norm>;
@group(0) @binding(3) var<storage, read> cells: array<vec4<f32>>;
// Per candidate its Params, then back and fraction of the delay, first sample, job.
@group(0) @binding(4) var<storage, read> candidates: array<f32>;
@group(0) @binding(5) var<storage, read_write> states: array<f32>;
@group(0) @binding(6) var<storage, read_write> results: array<u32>;
@group(0) @binding(7) var<storage, read_write> blocks: array<f32>;
@group(0) @binding(8) var<uniform> chunk: Chunk;
@group(0) @binding(9) var<uniform> observer: Observer;

const SAMPLE_WORDS: u32 = select(2u, 3u, ACCUMULATION == RELATIVE || ACCUMULATION == ALL);

// Status of a run: 0 while it goes well, else the top bit, the kind, and the sample.
const FAILED: u32 = 0x80000000u;
const CRASH: u32 = 0u << 28u;
const RADICAND: u32 = 1u << 28u;
const NOT_FINITE: u32 = 2u << 28u;
const REJECTED: u32 = 3u << 28u;
// The score of a complete run whose goodness of fit is undefined.
const UNDEFINED: u32 = 0x7fc00000u;

// A comparison with itself does not find a NaN on every driver; the bits do.
fn is_finite(x: f32) -> bool {
    return (bitcast<u32>(x) & 0x7f800000u) != 0x7f800000u;
}

// Sums of one signal triple, with what f32 rounds away.
struct Triple {
    high: vec3<f32>,
    low: vec3<f32>,
}

fn opaque3(x: vec3<f32>) -> vec3<f32> {
    return bitcast<vec3<f32>>(bitcast<vec3<u32>>(x) ^ vec3<u32>(opaque_zero));
}

fn add(sum: Triple, term: vec3<f32>) -> Triple {
    if (!COMPENSATED) {
        return Triple(sum.high + term, sum.low);
    }
    let high = opaque3(sum.high + term);
    let term_seen = opaque3(high - sum.high);
    let sum_seen = opaque3(high - term_seen);
    return Triple(high, sum.low + ((sum.high - sum_seen) + (term - term_seen)));
}

fn total(sum: Triple) -> vec3<f32> {
    if (!COMPENSATED) {
        return sum.high;
    }
    return sum.high + sum.low;
}

// Sine of the grade under a follower with spacing s, where a follower with spacing 0 would be at x_road.
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

@compute @workgroup_size(WORKGROUP)
fn main(@builtin(global_invocation_id) id: vec3<u32>, @builtin(num_workgroups) groups: vec3<u32>) {
    let i = id.y * groups.x * WORKGROUP + id.x;
    if (i >= chunk.candidates) {
        return;
    }
    opaque_zero = chunk.zero;
    let n = chunk.stride;
    let p = load_params(i, n);
    let back = bitcast<u32>(candidates[PARAMETERS * n + i]);
    let fraction = candidates[(PARAMETERS + 1u) * n + i];
    let first = bitcast<u32>(candidates[(PARAMETERS + 2u) * n + i]);
    let job = jobs[bitcast<u32>(candidates[(PARAMETERS + 3u) * n + i])];

    var now: Motion;
    var status = 0u;
    var cut_acc = 0u;
    var cut_dec = 0u;
    var error2 = Triple();
    var simulated2 = Triple();
    var relative2 = Triple();
    var floored2 = Triple();
    var block = vec2<f32>();
    var ring_s: array<f32, RING>;
    var ring_v: array<f32, RING>;
    var t = chunk.from_sample;
    let to = min(chunk.to_sample, job.samples);
    if (t == 0u) {
        for (; t < first; t++) {
            let at = job.sample + t * SAMPLE_WORDS;
            let x = Perceived(samples[at + 1u].w, samples[at].w, samples[at].x);
            now = at_rest_in(starting_spacing(p, x), x.v_f, samples[at + 1u].x);
            if (DELAY) {
                ring_s[t % RING] = now.s;
                ring_v[t % RING] = now.v_f;
            }
            if (status == 0u && now.s <= 0.0) {
                status = FAILED | CRASH | t;
            }
        }
        if (!params_are_finite(p)) {
            status = FAILED | NOT_FINITE | first;
        }
    } else {
        // @load: generated
        status = bitcast<u32>(states[i]);
        // ... the rest is generated: see src/gpu/state.rs
    }

    for (; t < to && status == 0u; t++) {
        let at = job.sample + t * SAMPLE_WORDS;
        let before = at - SAMPLE_WORDS;
        var x = Perceived(now.s, now.v_f, samples[before].x);
        if (DELAY) {
            let older = t - 1u - back;
            let younger = min(older + 1u, t - 1u);
            let leader = samples[job.sample + older * SAMPLE_WORDS].x;
            x.s = ring_s[older % RING] + (ring_s[younger % RING] - ring_s[older % RING]) * fraction;
            x.v_f = ring_v[older % RING] + (ring_v[younger % RING] - ring_v[older % RING]) * fraction;
            x.v_l = leader + (samples[job.sample + younger * SAMPLE_WORDS].x - leader) * fraction;
        }
        var road = Road();
        if (GRADE) {
            road.sin_grade = sin_grade_at(job, samples[before + 1u].y, now.s);
        }
        if (MFC) {
            let bounds = mfc_bounds(job, now.v_f);
            road.a_dp = bounds.x;
            road.a_ap = bounds.y;
        }
        let here = samples[at];
        let measured = vec3<f32>(here.z, here.w, samples[at + 1u].x);
        let done = step(p, x, now, job.m_0, job.phi_f, road, here.y, job.dt);
        // Before any clamp: a minimum or maximum would hide a NaN.
        if (!is_finite(done.a_free)) {
            status = FAILED | NOT_FINITE | t;
            break;
        }
        cut_acc += select(0u, 1u, done.a < done.a_free);
        cut_dec += select(0u, 1u, done.a > done.a_free);
        now = done.next;
        if (!done.feasible) {
            status = FAILED | RADICAND | t;
            break;
        }
        if (now.s <= 0.0) {
            status = FAILED | CRASH | t;
            break;
        }

        let simulated = vec3<f32>(now.s, now.v_f, now.a_f);
        let error = simulated - measured;
        if (ACCUMULATION == RELATIVE) {
            let relative = error * samples[at + 2u].xyz;
            error2 = add(error2, relative * relative);
        } else if (ACCUMULATION == FLOORED) {
            let floored = vec3<f32>(error.x, now.v_f - samples[at + 1u].z, error.z);
            error2 = add(error2, floored * floored);
        } else {
            error2 = add(error2, error * error);
        }
        if (ACCUMULATION == THEIL || ACCUMULATION == ALL) {
            simulated2 = add(simulated2, simulated * simulated);
        }
        if (ACCUMULATION == ALL) {
            let relative = error * samples[at + 2u].xyz;
            relative2 = add(relative2, relative * relative);
            let floored = vec3<f32>(error.x, now.v_f - samples[at + 1u].z, error.z);
            floored2 = add(floored2, floored * floored);
        }
        if (OBSERVER) {
            let gain = observer.gain;
            now.s = now.s - (gain.x * error.x + gain.y * error.y);
            now.v_f = max(now.v_f - (gain.z * error.x + gain.w * error.y), 0.0);
            let white = vec2<f32>(
                observer.whitening.x * error.x,
                observer.whitening.y * error.x + observer.whitening.z * error.y,
            );
            block = block + white * white;
            if ((t + 1u) % observer.block == 0u || t + 1u == job.samples) {
                let k = 2u * (t / observer.block);
                blocks[k * n + i] = block.x;
                blocks[(k + 1u) * n + i] = block.y;
                block = vec2<f32>();
            }
        }
        if (DELAY) {
            ring_s[t % RING] = now.s;
            ring_v[t % RING] = now.v_f;
        }
    }
    // Then either the state goes back into `states`, or, at the end of the trajectory or after a failure, the result
    // into `results` (finish).
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
