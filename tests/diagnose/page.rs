//! The tables of docs/DIAGNOSIS.md and docs/benchmark/likelihood.md are those of the code. A failure prints the missing table, ready to paste.

use leadlag::internal::diagnose::answer::VERDICTS;
use leadlag::internal::diagnose::data::{FindingKind, LIMITS};
use leadlag::internal::diagnose::search::search_budget::SearchBudget;
use leadlag::internal::diagnose::{Effort, POLICY};
use strum::IntoEnumIterator;

const PAGE: &str = include_str!("../../docs/DIAGNOSIS.md");
const NUMBERS: &str = include_str!("../../docs/benchmark/likelihood.md");
const SOUNDNESS: &str = include_str!("../../docs/SOUNDNESS.md");

fn stands_there(head: &str, rows: impl Iterator<Item = String>) {
    stands_in(PAGE, head, rows);
}

fn stands_in(page: &str, head: &str, rows: impl Iterator<Item = String>) {
    let columns = head.matches('|').count() - 1;
    let rule = format!("|{}", "---|".repeat(columns));
    let table = [head.to_owned(), rule].into_iter().chain(rows).collect::<Vec<_>>().join("\n");
    assert!(page.contains(&table), "the page lacks this table:\n{table}");
}

fn row(number: leadlag::internal::diagnose::policy::Number) -> String {
    let unit = if number.unit == "-" { String::new() } else { format!(" {}", number.unit) };
    format!("| `{}` | {}{unit} | {} |", number.name, number.value, number.reason)
}

#[test]
fn every_fault_of_the_data_and_its_limits() {
    let kind = |kind: FindingKind| {
        format!("| `{}` | {} | {} | {} |", kind.into_str(), kind.effect(), kind.false_alarms(), kind.remedy())
    };
    let head = "| kind | what it does to parameters | false alarms in 1,000 | remedy |";
    stands_in(SOUNDNESS, head, FindingKind::iter().map(kind));
    stands_in(SOUNDNESS, "| limit | value | what it decides |", LIMITS.numbers().into_iter().map(row));
}

#[test]
fn every_number_that_decides() {
    stands_in(NUMBERS, "| number | value | what it decides |", POLICY.numbers().into_iter().map(row));
}

#[test]
fn every_verdict() {
    let row = |(verdict, when, _): &leadlag::internal::diagnose::answer::Line| {
        format!("| `{}` | {when} |", verdict.into_str())
    };
    let last = "| `nothing` | else |".to_owned();
    stands_there("| verdict | when |", VERDICTS.iter().map(row).chain([last]));
}

#[test]
fn what_an_effort_buys() {
    let row = |effort: Effort| {
        let budget = SearchBudget::of(effort);
        let enough = if budget.enough == u64::MAX { "no limit".to_owned() } else { budget.enough.to_string() };
        let (name, population, hints) = (effort.into_str(), budget.population, budget.hints);
        format!("| `{name}` | {population} | {hints} | {} | {enough} |", budget.short_list)
    };
    let head = "| effort | random bases | places per cause and drive | causes judged | simulations after which no round begins |";
    stands_there(head, [Effort::Quick, Effort::Normal, Effort::Thorough].into_iter().map(row));
}
