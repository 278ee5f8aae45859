//! The tables of docs/DIAGNOSIS.md are those of the code: where one is missing, the message has it ready to be pasted.

use leadlag::internal::diagnose::answer::VERDICTS;
use leadlag::internal::diagnose::search::search_budget::SearchBudget;
use leadlag::internal::diagnose::{Effort, POLICY};

const PAGE: &str = include_str!("../../docs/DIAGNOSIS.md");

fn stands_there(head: &str, rows: impl Iterator<Item = String>) {
    let columns = head.matches('|').count() - 1;
    let rule = format!("|{}", "---|".repeat(columns));
    let table = [head.to_owned(), rule].into_iter().chain(rows).collect::<Vec<_>>().join("\n");
    assert!(PAGE.contains(&table), "docs/DIAGNOSIS.md lacks this table:\n{table}");
}

#[test]
fn every_number_that_decides() {
    let row = |number: leadlag::internal::diagnose::policy::Number| {
        let unit = if number.unit == "-" { String::new() } else { format!(" {}", number.unit) };
        format!("| `{}` | {}{unit} | {} |", number.name, number.value, number.reason)
    };
    stands_there("| number | value | what it decides |", POLICY.numbers().into_iter().map(row));
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
