//! `report.md`: the study, and its agreements with and differences from the paper, in plain words and numbers.

use super::Material;
use crate::statistics::spearman;
use crate::study::outcome::Ranking;
use crate::study::paper::Printed;
use std::fmt::Write;

pub fn write(material: &Material) -> String {
    let mut text = String::new();
    lines(material, &mut text).expect("a String takes all");
    text
}

fn lines(material: &Material, text: &mut String) -> std::fmt::Result {
    let own = material.own;
    let mut platoons: Vec<&str> = own.drives.iter().map(|d| d.platoon.as_str()).collect();
    platoons.dedup();
    let study = material.study;
    writeln!(text, "# {}{}\n", study.name, if material.is_beside_paper() { " beside the paper" } else { "" })?;
    writeln!(
        text,
        "{} variants on {} trajectories (platoons {}), {} replicates of at most {} evaluations each by `{}`, scored by {}, convention `{}`, \
         {}.{}",
        own.variants.len(),
        own.drives.len(),
        platoons.join(", "),
        study.replicates,
        study.max_evaluations,
        study.optimizer,
        own.gof,
        study.convention,
        study.program,
        if material.is_beside_paper() {
            " The paper: 90 variants on 28 trajectories, 10 replicates of 560,000 to 700,100 evaluations."
        } else {
            ""
        }
    )?;
    if !study.extensions.is_empty() {
        let names: Vec<&str> = study.extensions.iter().map(|extension| extension.name.as_str()).collect();
        writeln!(text, "\nEvery variant is extended by {}, which the paper does not have.", names.join(", "))?;
    }
    let (first, then) = super::page::answer(own, &Ranking::of(own, &|_| true));
    writeln!(text, "\n**{first}** {then}")?;
    writeln!(text, "\n| trajectory | vehicle | file | preparation |\n|---|---|---|---|")?;
    for drive in &study.drives {
        let notes = drive.notes.join("; ").replace('|', "/");
        writeln!(text, "| {} | {} | `{}` | {notes} |", drive.label(), drive.vehicle, drive.file)?;
    }
    if material.missing > 0 {
        let (missing, are) = (material.missing, if material.missing == 1 { "task is" } else { "tasks are" });
        writeln!(text, "\n**{missing} {are} missing: these numbers are preliminary.**")?;
    }
    if material.paper.is_empty() {
        writeln!(
            text,
            "\nThe following is for {}; the paper's Tables 4 and 5 are of NRMSE(s,v,a), so that its numbers are left out, and its statements about \
             them are not judged.",
            own.gof
        )?;
    }
    let judged = material.judged();
    if !judged.is_empty() {
        writeln!(text, "\n## Where it agrees with the paper, and where not\n")?;
        writeln!(text, "| | the paper says | this study | reason for a difference |\n|---|---|---|---|")?;
        for claim in judged {
            let mark = if claim.agrees == Some(true) { "agrees" } else { "**differs**" };
            writeln!(text, "| {mark} | {} | {} | {} |", claim.paper, claim.found, claim.why.as_deref().unwrap_or(""))?;
        }
    }
    if let Some(open) = material.open() {
        writeln!(text, "\n{open}")?;
    }
    if material.is_beside_paper() {
        correlations(material, text)?;
    }
    table4(material, text)?;
    writeln!(text, "\n## Files\n")?;
    writeln!(
        text,
        "`table4.csv`, `table5.csv`: every number{}. `figure4` to `figure7`: numbers as `.csv`, pictures as `.svg`. Columns: docs/STUDY.md of \
         leadlag.",
        if material.is_beside_paper() { " beside the paper's" } else { "" }
    )?;
    if material.is_beside_paper() {
        writeln!(text, "The paper's numbers are those printed in its Tables 4 and 5; its figures print no numbers.")?;
    }
    Ok(())
}

/// Spearman's rank correlation between ours and the paper's, over all variants and within each base model.
fn correlations(material: &Material, text: &mut String) -> std::fmt::Result {
    let variants = &material.own.variants;
    type Ours<'a> = Box<dyn Fn(usize) -> Option<f64> + 'a>;
    type Theirs = fn(&Printed) -> Option<f64>;
    let (four, five) = (&material.four, &material.five);
    let rows: [(&str, Ours, Theirs); 6] = [
        ("median normalised error (Table 4)", Box::new(|v| four[v].median), |p| Some(p.median)),
        ("change against the base model (Table 4)", Box::new(|v| four[v].change), |p| p.change),
        ("change of NRMSE(s,v,a), calibration (Table 5)", Box::new(|v| five[v].calibration[3]), |p| p.calibration[3]),
        ("change of NRMSE(s,v,a), validation (Table 5)", Box::new(|v| five[v].validation[3]), |p| p.validation[3]),
        ("change of RMSE(s), calibration (Table 5)", Box::new(|v| five[v].calibration[0]), |p| p.calibration[0]),
        (
            "collisions (Table 5)",
            Box::new(|v| (five[v].runs > 0).then(|| five[v].collisions as f64 / five[v].runs as f64)),
            |p| Some(p.collisions),
        ),
    ];
    writeln!(text, "\n## Rank correlation with the paper over the variants\n")?;
    writeln!(text, "Spearman's rho; 1 means the same order, `-` too few or all equal.\n")?;
    let bases = ["idm", "gipps", "l-cth", "l-idm", "l-gipps"];
    writeln!(text, "| | all | {} |\n|---|---|{}", bases.join(" | "), "---|".repeat(bases.len()))?;
    for (name, ours, theirs) in rows {
        let rho = |base: Option<&str>| {
            let pairs: Vec<(f64, f64)> = (0..variants.len())
                .filter(|&v| base.is_none_or(|base| variants[v].base.name == base))
                .filter_map(|v| Some((ours(v)?, theirs(material.paper.get(&variants[v].id())?)?)))
                .collect();
            spearman(&pairs).map_or("-".to_owned(), |rho| format!("{rho:.2}"))
        };
        let columns: Vec<String> = bases.iter().map(|base| rho(Some(base))).collect();
        writeln!(text, "| {name} | {} | {} |", rho(None), columns.join(" | "))?;
    }
    Ok(())
}

fn table4(material: &Material, text: &mut String) -> std::fmt::Result {
    let shown = |x: Option<f64>, digits: usize| x.map_or("-".to_owned(), |x| format!("{x:.digits$}"));
    let signed = |x: Option<f64>| x.map_or("-".to_owned(), |x| format!("{x:+.0}"));
    let own = material.own;
    writeln!(text, "\n## The variants: Table 4, and the collisions of Table 5\n")?;
    writeln!(
        text,
        "Medians over the trajectories. The share above the best is the score over the lowest one of all variants on the same trajectory, minus 1 \
         (Eq. 19); its change is against the same share of the base model, so that small shares change by many percent.\n"
    )?;
    // The paper's numbers stand in columns of their own, if at all.
    let line = |cells: [(String, Option<String>); 6]| {
        let cells =
            cells.into_iter().flat_map(|(own, paper)| [Some(own), paper.filter(|_| material.is_beside_paper())]);
        format!("| {} |", cells.flatten().collect::<Vec<_>>().join(" | "))
    };
    let paper = || Some("paper".to_owned());
    let head = line([
        ("id".to_owned(), None),
        ("variant".to_owned(), None),
        (own.gof.clone(), None),
        ("share above the best".to_owned(), paper()),
        ("change of this share %".to_owned(), paper()),
        ("collisions".to_owned(), paper()),
    ]);
    writeln!(text, "{head}\n|{}", "---|".repeat(head.matches(" | ").count() + 1))?;
    for (v, variant) in own.variants.iter().enumerate() {
        let scores: Vec<f64> = own.cells[v].iter().filter_map(|cell| cell.score).collect();
        let (four, five, printed) = (&material.four[v], &material.five[v], material.printed(variant));
        let collisions = printed.map_or("-".to_owned(), |paper| format!("{:.0}/168", paper.collisions));
        let cells = [
            (variant.shown_id(), None),
            (format!("`{variant}`"), None),
            (shown(crate::statistics::median(&scores), 4), None),
            (shown(four.median, 3), Some(shown(printed.map(|paper| paper.median), 3))),
            (signed(four.change), Some(signed(printed.and_then(|paper| paper.change)))),
            (format!("{}/{}", five.collisions, five.runs), Some(collisions)),
        ];
        writeln!(text, "{}", line(cells))?;
    }
    Ok(())
}
