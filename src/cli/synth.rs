//! `leadlag synth`: a synthetic platoon whose truth is known.

use super::output;
use leadlag::plant::{Noise, Scenario, run as drive, write_openacc, write_pair, write_slope};
use std::path::PathBuf;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Folder for platoon.csv (OpenACC layout), Slope.csv (the road) and truth.json
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// The one seed of all random numbers
    #[arg(long, default_value_t = 1)]
    pub seed: u64,
    /// Length of the drive in s
    #[arg(long, value_name = "S")]
    pub duration: Option<f64>,
    /// Without sensor noise
    #[arg(long)]
    pub no_noise: bool,
    /// Also write a pair file for each follower: pair_follower1.csv, ...
    #[arg(long)]
    pub pairs: bool,
}

pub fn run(args: &Args) -> anyhow::Result<()> {
    let mut scenario = Scenario { seed: args.seed, ..Scenario::default() };
    if let Some(duration) = args.duration {
        scenario.duration_s = duration;
    }
    if args.no_noise {
        scenario.noise = Noise::NONE;
    }
    let synthetic = drive(&scenario)?;
    output::make_folder(&args.out)?;
    let mut written = Vec::new();
    let mut save = |name: String, content: Vec<u8>| {
        let path = args.out.join(name);
        output::write_file(&path, &content)?;
        written.push(path.display().to_string());
        anyhow::Ok(())
    };
    let mut platoon = Vec::new();
    write_openacc(&synthetic, &mut platoon)?;
    save("platoon.csv".to_owned(), platoon)?;
    let mut slope = Vec::new();
    write_slope(&synthetic, &mut slope)?;
    save("Slope.csv".to_owned(), slope)?;
    save("truth.json".to_owned(), (serde_json::to_string_pretty(&synthetic.truth)? + "\n").into_bytes())?;
    if args.pairs {
        for follower in 1..synthetic.v.len() {
            let mut pair = Vec::new();
            write_pair(&synthetic, follower, &mut pair)?;
            save(format!("pair_follower{follower}.csv"), pair)?;
        }
    }
    output::print(&(written.join("\n") + "\n"))
}
