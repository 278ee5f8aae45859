//! The check of the data: silent on clean drives, and planted faults are found, named and sized.

mod common;

use leadlag::diagnose::data::check;
use leadlag::plant::{self, Noise, Profile, Scenario};
use leadlag::trajectory::{Recording, import};

/// A synthetic platoon, imported as any file.
fn drive(seed: u64, noise: Noise, profile: Profile) -> Recording {
    let scenario = Scenario { seed, noise, profile, ..Scenario::default() };
    let synthetic = plant::run(&scenario).expect("the default platoon drives");
    let mut file = Vec::new();
    plant::write_openacc(&synthetic, &mut file).expect("memory takes all");
    import::read_bytes(&file, "synthetic.csv", None).expect("what we wrote can be read")
}

const SENSOR: Noise = Noise { speed_mps: 0.02, gap_m: 0.02 };

fn noises() -> [Noise; 2] {
    [SENSOR, Noise::default()]
}

#[test]
fn clean_drives_are_clean() {
    let mut found = Vec::new();
    let mut links = 0;
    for seed in 1..=12 {
        for (noise, profile) in noises().into_iter().flat_map(|noise| {
            [Profile::Cruise, Profile::StopAndGo, Profile::Restless].map(|profile| (noise, profile))
        }) {
            let recording = drive(seed, noise, profile.clone());
            for follower in 1..=4 {
                let soundness = check(&recording, 0, follower).expect("the follower is there");
                links += 1;
                for finding in soundness.findings {
                    found.push(format!("seed {seed} {profile:?} {noise:?} follower {follower}: {}", finding.sentence));
                }
            }
        }
    }
    assert!(found.is_empty(), "{} findings in {links} clean links:\n{}", found.len(), found.join("\n"));
}

#[test]
#[ignore = "prints what the real files say"]
fn show_real() {
    let Some(shared) = common::shared("show_real") else { return };
    for folder in ["astazero_rebuilt", "astazero_c2art", "raw_openacc/Vicolungo", "raw_openacc/Casale", "raw_openacc/ZalaZONE", "raw_openacc/JRC_low_speed"] {
        let mut files: Vec<_> = std::fs::read_dir(shared.join("data").join(folder)).unwrap().map(|e| e.unwrap().path()).collect();
        files.sort();
        for file in files.iter().filter(|f| f.to_string_lossy().contains("part") || f.to_string_lossy().contains("platoon")) {
            let recording = import::read(file, None).unwrap();
            for follower in 1..=8 {
                let Ok(soundness) = check(&recording, 0, follower) else { continue };
                println!("{} {follower} rate {:?}", file.file_name().unwrap().to_string_lossy(), soundness.rate_rms_mps);
                for f in soundness.findings {
                    println!("    {} {:?} {} {:.5} {:?}: {}", f.kind.name(), f.car, f.signal, f.value, f.interval, f.sentence);
                }
            }
        }
    }
}
