//! A case for other programs: `benches/peers` runs the same drive and candidates in other programs and compares scores and
//! speeds.

use super::{BenchError, Drive, candidates};
use crate::catalog::Variant;
use crate::evaluator::{Evaluator, Score};
use crate::reference::Reference;
use crate::score::GoodnessOfFit;
use std::fmt::Write;
use std::path::Path;

/// Candidates written: as many as the largest population of a peer on the CPU; those on a GPU take them several times.
const CANDIDATES: usize = 4096;

/// Writes `drive.csv` (v_l_mps, dx_l_m, s_m, v_f_mps, a_f_mps2; the state at the first line is where a run starts, the others
/// are scored) and `candidates.csv` (the parameters of variant 1 and the score NRMSE(s,v,a) that the reference gives them, empty if the run
/// failed). Floats in shortest form that reads back the same.
pub fn export(drive: &Drive, folder: &Path) -> Result<(), BenchError> {
    let variant = Variant::from_id(1)?;
    let case = drive.case(variant)?;
    let mut table = String::from("v_l_mps,dx_l_m,s_m,v_f_mps,a_f_mps2\n");
    for i in 0..case.s.len() {
        let dx_l = if i == 0 { 0.0 } else { case.x_l[i] - case.x_l[i - 1] };
        // Writing to a String cannot fail.
        let _ = writeln!(table, "{:?},{dx_l:?},{:?},{:?},{:?}", case.v_l[i], case.s[i], case.v_f[i], case.a_f[i]);
    }
    let write = |name: &str, text: &str| {
        let path = folder.join(name);
        let failed = |source| BenchError::Write { path: path.display().to_string(), source };
        crate::whole::write(&path, text.as_bytes()).map_err(failed)
    };
    write("drive.csv", &table)?;

    let population = candidates(&drive.space(variant)?, CANDIDATES);
    let mut scores = vec![Score::Rejected; CANDIDATES];
    Reference::new(vec![case], GoodnessOfFit::NRMSE_SVA).evaluate(&population, &mut scores)?;
    let names: Vec<&str> = population.symbols().iter().map(|symbol| symbol.name()).collect();
    let mut table = names.join(",") + ",nrmse_sva\n";
    for (i, score) in scores.iter().enumerate() {
        let values: Vec<String> = population.values(i).iter().map(|value| format!("{value:?}")).collect();
        let score = if let Score::Value(value) = score { format!("{value:?}") } else { String::new() };
        let _ = writeln!(table, "{},{score}", values.join(","));
    }
    write("candidates.csv", &table)
}
