//! `leadlag synth`: a synthetic platoon whose truth is known.

use super::change::Change;
use super::folder::finish;
use super::output;
use crate::api::error::refuse;
use crate::api::values::{real, seed, whole};
use crate::synthetic::{
    Base, Effect, EffectError, EffectKind, Gusts, Noise, Profile, Scenario, Synthetic, at_amplitude, drawn,
    run as drive, write_openacc, write_pair, write_slope,
};
use crate::text::spelling::did_you_mean;
use crate::trajectory::{Preparation, Trajectory, import, prepare};
use anyhow::Context;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::path::{Path, PathBuf};
use strum::VariantArray;

/// Largest number of followers of a platoon.
const FOLLOWERS: u8 = 4;

#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:
  leadlag synth --out drive --pairs
  leadlag synth --out drive --base idm --effect grade --amplitude medium
  leadlag synth -o drive --effect actuation_lag:ta=0.6 --leader stop-and-go
  leadlag synth --list-effects")]
pub struct Args {
    /// Folder for platoon.csv (layout astazero-rebuilt), Slope.csv (the road) and truth.json
    #[arg(short, long, value_name = "DIR", required_unless_present = "list_effects")]
    pub out: Option<PathBuf>,
    /// Seed of all random numbers
    #[arg(long, default_value_t = 1, value_parser = seed, allow_negative_numbers = true)]
    pub seed: u64,
    /// Seed of the road, instead of --seed; drives with the same road seed share the road
    #[arg(long, value_name = "SEED", value_parser = seed, allow_negative_numbers = true)]
    pub road_seed: Option<u64>,
    /// Length of the drive in s [default: 600, or as long as the record of --leader]
    #[arg(long, value_name = "S", value_parser = real(Scenario::DURATION_S, "s"), allow_negative_numbers = true)]
    pub duration: Option<f64>,
    /// Draw the follower's parameters from the seed instead of taking those of the default platoon
    #[arg(long, value_parser = bases())]
    pub base: Option<Base>,
    /// Follower for --base, --effect and --gusts; 1 is directly behind the platoon leader
    #[arg(long, default_value_t = 1, value_parser = whole(1_u8, FOLLOWERS), allow_negative_numbers = true)]
    pub follower: u8,
    /// Effect to plant, with its parameters or of medium size; may be repeated
    #[arg(long, value_name = "NAME[:P=V,...]", value_parser = effect)]
    pub effect: Vec<Effect>,
    /// Scale each effect so that it changes the follower's speed by this amount
    #[arg(long, value_name = "weak|medium|M/S", value_parser = amplitude, requires = "effect",
          allow_negative_numbers = true)]
    pub amplitude: Option<f64>,
    /// How the platoon leader drives: cruise, stop-and-go, restless, or as the first car of a measured FILE
    #[arg(long, value_name = "KIND|FILE", default_value = "cruise")]
    pub leader: String,
    /// Standard deviation of the spacing noise in m [default: 0.0005]
    #[arg(long, value_name = "M", conflicts_with = "no_noise", value_parser = real(Scenario::NOISE, "m"),
          allow_negative_numbers = true)]
    pub gap_noise: Option<f64>,
    /// Standard deviation of the noise of all speeds in m/s [default: 0.003]
    #[arg(long, value_name = "M/S", conflicts_with = "no_noise", value_parser = real(Scenario::NOISE, "m/s"),
          allow_negative_numbers = true)]
    pub speed_noise: Option<f64>,
    /// Without sensor noise
    #[arg(long)]
    pub no_noise: bool,
    /// Random accelerations of the follower: standard deviation in m/s², time constant in s
    #[arg(long, value_name = "SIGMA,TAU", value_parser = gusts, allow_hyphen_values = true)]
    pub gusts: Option<Gusts>,
    /// Also write a pair file for each follower: pair_follower1.csv, ...
    #[arg(long)]
    pub pairs: bool,
    /// List the effects with their parameters and exit
    #[arg(long)]
    pub list_effects: bool,
}

/// The bases of synthetic cars, for the command line.
fn bases() -> impl TypedValueParser<Value = Base> {
    let names = Base::VARIANTS.iter().map(|base| <&str>::from(*base));
    PossibleValuesParser::new(names).map(|name| name.parse().expect("one of them"))
}

/// An effect; for an unknown name, the nearest one.
pub fn effect(text: &str) -> Result<Effect, String> {
    text.parse().map_err(|error| match &error {
        EffectError::Unknown { found } => {
            let names = EffectKind::VARIANTS.iter().map(EffectKind::into_str);
            format!("{error}{}", did_you_mean(found, names))
        }
        EffectError::Parameter { effect, found } => {
            let names = effect.parameters().iter().map(|parameter| parameter.name);
            format!("{error}{}", did_you_mean(found, names))
        }
        EffectError::Range { .. } | EffectError::Twice { .. } => error.to_string(),
    })
}

fn amplitude(text: &str) -> Result<f64, String> {
    match text {
        "weak" => Ok(0.03),
        "medium" => Ok(0.10),
        _ => text.parse().ok().filter(|v: &f64| *v > 0.0 && v.is_finite()).ok_or_else(|| {
            "expected weak (0.03 m/s), medium (0.10 m/s) or a root mean square above 0 in m/s".to_owned()
        }),
    }
}

fn gusts(text: &str) -> Result<Gusts, String> {
    let numbers = text.split_once(',').and_then(|(a, b)| Some((a.trim().parse().ok()?, b.trim().parse().ok()?)));
    let expected = || "expected SIGMA,TAU: standard deviation in m/s² and time constant in s, such as 0.05,2";
    let (sigma_mps2, time_constant_s) = numbers.ok_or_else(expected)?;
    Ok(Gusts { sigma_mps2, time_constant_s })
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    if args.list_effects {
        return output::print(&effects());
    }
    let out = args.out.as_deref().expect("clap wants it");
    let synthetic = drive(&scenario(args)?)?;
    let names = write(&synthetic, out, args.pairs)?;
    output::print(&names.iter().map(|name| out.join(name).display().to_string() + "\n").collect::<String>())
}

/// Writes the files of a drive, which together replace those of an earlier one; returns their names.
pub fn write(drive: &Synthetic, out: &Path, pairs: bool) -> anyhow::Result<Vec<String>> {
    let pair = |follower: usize| format!("pair_follower{follower}.csv");
    let mut change = Change::begin(out)?;
    let mut names = Vec::new();
    let mut save = |name: String, content: Vec<u8>| {
        change.write(&name, &content)?;
        names.push(name);
        anyhow::Ok(())
    };
    let mut platoon = Vec::new();
    write_openacc(drive, &mut platoon)?;
    save("platoon.csv".to_owned(), platoon)?;
    let mut slope = Vec::new();
    write_slope(drive, &mut slope)?;
    save("Slope.csv".to_owned(), slope)?;
    for follower in (1..drive.v.len()).filter(|_| pairs) {
        let mut content = Vec::new();
        write_pair(drive, follower, &mut content)?;
        save(pair(follower), content)?;
    }
    save("truth.json".to_owned(), (serde_json::to_string_pretty(&drive.truth)? + "\n").into_bytes())?;
    finish(change, out, (1..=FOLLOWERS).map(|follower| pair(follower.into())).collect())?;
    Ok(names)
}

/// The requested drives.
fn scenario(args: &Args) -> anyhow::Result<Scenario> {
    let mut scenario = Scenario { seed: args.seed, road_seed: args.road_seed, ..Scenario::default() };
    scenario.profile = match LEADERS.into_iter().find(|(name, _)| *name == args.leader) {
        Some((_, profile)) => profile,
        None => {
            let lead = recorded(Path::new(&args.leader))?;
            scenario.duration_s = (lead.len() - 1) as f64 * lead.dt;
            Profile::Recorded { dt: lead.dt, v: lead.v_l }
        }
    };
    if let Some(duration) = args.duration {
        scenario.duration_s = duration;
    }
    if args.no_noise {
        scenario.noise = Noise::NONE;
    }
    scenario.noise.gap_m = args.gap_noise.unwrap_or(scenario.noise.gap_m);
    scenario.noise.speed_mps = args.speed_noise.unwrap_or(scenario.noise.speed_mps);

    let number = usize::from(args.follower);
    if let Some(base) = args.base {
        scenario.followers.truncate(number);
        scenario.followers[number - 1] = drawn(base, args.seed, number);
    }
    let follower = &mut scenario.followers[number - 1];
    follower.gusts = args.gusts;
    for effect in &args.effect {
        if follower.effects.iter().any(|known| known.kind() == effect.kind()) {
            refuse!("--effect {} is given twice", effect.kind());
        }
        follower.effects.push(effect.clone());
    }
    match args.amplitude {
        Some(rms) => Ok(at_amplitude(&scenario, number, rms)?),
        None => Ok(scenario),
    }
}

/// Manoeuvres of a platoon leader.
const LEADERS: [(&str, Profile); 3] =
    [("cruise", Profile::Cruise), ("stop-and-go", Profile::StopAndGo), ("restless", Profile::Restless)];

/// The first two cars of a measured file.
fn recorded(file: &Path) -> anyhow::Result<Trajectory> {
    let given = file.to_string_lossy();
    if !file.exists() && file.extension().is_none() {
        let kinds = LEADERS.map(|(name, _)| name);
        refuse!(
            "--leader {given}: expected {} or a measured file, found no such file{}",
            kinds.join(", "),
            did_you_mean(&given, kinds)
        );
    }
    let recording = import::read(file, None).with_context(|| format!("--leader {given}: cannot be read"))?;
    Ok(Trajectory::longest(prepare(&recording, 1, &Preparation::default())?))
}

/// A table of the effects.
fn effects() -> String {
    let mut text = String::new();
    for kind in EffectKind::VARIANTS {
        text += &format!("{kind}: {}\n", kind.meaning());
        for p in kind.parameters() {
            let unit = if p.unit == "-" { "" } else { p.unit };
            text += format!("    {:<5}{} to {} {unit}, medium {}", p.name, p.lower, p.upper, p.medium).trim_end();
            text += "\n";
        }
    }
    text
}
