//! `cargo bench`: measurements of `leadlag bench`, on the synthetic drive. `cargo bench -- --quick` takes under a minute.

use leadlag::internal::bench::{Drive, Effort, run, table};

fn main() {
    let quick = std::env::args().any(|argument| argument == "--quick");
    let effort = if quick { Effort::Quick } else { Effort::Full };
    let report = Drive::synthetic().and_then(|drive| run(&drive, effort, &mut |what| eprintln!("{what}")));
    match report {
        Ok(report) => print!("{}", table(&report)),
        Err(error) => panic!("{error}"),
    }
}
