//! The command line: arguments, library call, report.

fn main() {}
