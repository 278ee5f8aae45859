//! Texts in another front end than the command line, which names options by other words.

use super::common::small;
use leadlag::internal::text::option::{Opt, flag, word_options};
use leadlag::{Fleet, Pairs};

#[test]
fn a_table_and_a_command_in_a_message_name_flags_in_every_front_end() {
    let study = small("front_end");
    let drive = leadlag::synthetic(1, 60.0).expect("a drive").follower(1).expect("it has one follower");
    let fleet = Fleet::of(&["idm+nonlinear"]).expect("a model");
    word_options(Opt::id);
    let refused = leadlag::cli::merge(&study);
    let table = fleet.run(&Pairs::of_drives(&[&drive]));
    word_options(flag);
    let refused = refused.expect_err("no task is done").to_string();
    assert!(refused.contains(" --partial` merges without them"), "{refused}");
    let table = table.expect("a row with a reason");
    let reason = table.columns.iter().find(|column| column.name == "reason").expect("a column").values.text(0);
    assert!(reason.contains("give --vehicle NAME"), "{reason}");
}
