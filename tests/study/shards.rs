//! The merged bytes are the same for any division of the tasks.

use super::common::{
    expected, fails, files, merged, ok, part_names, plan_by, planned, refused, same, scratch, small, stderr, succeeds,
    text,
};
use super::common::{leadlag, number_before};
use leadlag::internal::catalog::Variant;
use leadlag::internal::study::{Shard, Task};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

#[test]
fn one_two_and_five_shards_in_any_order_merge_to_the_same_bytes() {
    shards_merge_to(expected(), "ga", 300);
}

/// Its generations differ in size, some are scored in f64, and its searches end at different times.
#[test]
fn so_they_do_with_the_default_optimiser() {
    let study = planned("shards_auto", &plan_by("auto", 2, 600));
    ok(&["study", "run", text(&study)]);
    shards_merge_to(&merged(&study, &[]), "auto", 600);
}

/// Computes the small plan in shards, by an optimiser.
fn shards_merge_to(expected: &BTreeMap<String, Vec<u8>>, optimizer: &str, evaluations: u32) {
    for (n, order) in [(1, vec![1]), (2, vec![2, 1]), (5, vec![4, 1, 5, 3, 2])] {
        let study = planned(&format!("shards_{optimizer}{n}"), &plan_by(optimizer, 2, evaluations));
        let mut computed = Vec::new();
        for i in order {
            // Threads and batches differ as well.
            let (shard, batch, threads) = (format!("{i}/{n}"), (1 + 3 * i).to_string(), (1 + i % 2).to_string());
            let run = ["study", "run", text(&study), "--shard", &shard, "--batch", &batch, "--threads", &threads];
            let output = succeeds(&run);
            computed.push(number_before(&stderr(&output), "computed"));
        }
        assert_eq!(computed.iter().sum::<usize>(), 24, "{computed:?}");
        assert!(computed.iter().all(|&count| count > 0), "a shard without work: {computed:?}");
        same(&merged(&study, &[]), expected, &format!("{optimizer}, {n} shards"));
    }
}

#[test]
fn single_tasks_in_reverse_order_merge_to_the_same_bytes() {
    let study = small("tasks");
    let tasks = fs::read_to_string(study.join("tasks.jsonl")).unwrap();
    for line in tasks.lines().rev() {
        let task: serde_json::Value = serde_json::from_str(line).unwrap();
        ok(&["study", "run", text(&study), "--task", &task["id"].as_str().unwrap()[..12]]);
    }
    same(&merged(&study, &[]), expected(), "one task at a time");
}

#[test]
fn several_tasks_are_computed_at_once() {
    let study = small("some_tasks");
    let tasks = fs::read_to_string(study.join("tasks.jsonl")).unwrap();
    let ids: Vec<String> = tasks.lines().map(|line| serde_json::from_str::<Task>(line).unwrap().id).collect();
    // In any order, one of them twice.
    let words = ["--task", &ids[9], "--task", &ids[2], "--task", &ids[23], "--task", &ids[2]];
    let said = stderr(&leadlag(&[&["study", "run", text(&study)], &words[..]].concat()));
    assert_eq!(number_before(&said, "computed"), 3, "{said}");
    let mut names = part_names(&study);
    names.sort();
    let mut expected = [9, 2, 23].map(|i: usize| format!("{}.json", ids[i]));
    expected.sort();
    assert_eq!(names, expected);
    refused(2, &["study", "run", text(&study), "--task", &ids[0], "--task", "nonsense"])
        .says("task `nonsense`: 0 tasks");
}

#[test]
fn shards_computed_in_several_folders_are_merged_from_all_of_them() {
    let (here, there) = (small("here"), small("there"));
    ok(&["study", "run", text(&here), "--shard", "1/2"]);
    ok(&["study", "run", text(&there), "--shard", "2/2"]);
    refused(1, &["study", "merge", text(&here)]).says("of 24 tasks are missing");
    let further = there.join("parts");
    same(&merged(&here, &["--parts", text(&further)]), expected(), "two folders");
    assert!(part_names(&here).len() < 24, "merging computes nothing and copies nothing");
}

#[test]
fn the_data_may_move() {
    let study = small("moved");
    let elsewhere = scratch("moved_data");
    for name in ["one", "two"] {
        fs::create_dir_all(elsewhere.join(name)).unwrap();
        for (file, bytes) in files(&super::common::data().join(name)) {
            fs::write(elsewhere.join(name).join(file), bytes).unwrap();
        }
    }
    ok(&["study", "run", text(&study), "--data", text(&elsewhere)]);
    same(&merged(&study, &[]), expected(), "data elsewhere");
}

#[test]
fn data_that_have_changed_are_noticed() {
    let study = small("changed");
    let elsewhere = scratch("changed_data");
    for name in ["one", "two"] {
        fs::create_dir_all(elsewhere.join(name)).unwrap();
        for (file, bytes) in files(&super::common::data().join(name)) {
            let mut content = String::from_utf8(bytes).unwrap();
            if name == "two" && file == "platoon.csv" {
                let last = content.trim_end().rfind('\n').unwrap();
                content.truncate(last + 1);
            }
            fs::write(elsewhere.join(name).join(file), content).unwrap();
        }
    }
    refused(1, &["study", "run", text(&study), "--data", text(&elsewhere)])
        .says("24 of 24 tasks are not those that were planned");
    // The same numbers in other bytes: a part holds the checksum of every file that it is validated on.
    let given = fs::read_to_string(super::common::data().join("two/platoon.csv")).unwrap();
    fs::write(elsewhere.join("two/platoon.csv"), given.replace('\n', "\r\n")).unwrap();
    let (_, said) = fails(&["study", "run", text(&study), "--data", text(&elsewhere)]);
    assert!(said.contains("24 of 24 tasks are not those that were planned"), "checksums count: {said}");
}

#[test]
fn a_shard_that_is_none_is_refused() {
    let study = small("no_shard");
    for (shard, found) in [("0/2", "0/2"), ("3/2", "3/2"), ("two", "two"), ("1/0", "1/0")] {
        refused(2, &["study", "run", text(&study), "--shard", shard])
            .says(&format!("expected I/N with I from 1 to N, such as 2/5, found `{found}`"));
    }
    refused(2, &["study", "run", text(&study), "--task", "nonsense"])
        .says("task `nonsense`: 0 tasks of this study begin with this id, expected one");
}

#[test]
fn the_beginning_of_several_ids_names_them() {
    let study = small("several");
    let tasks = fs::read_to_string(study.join("tasks.jsonl")).unwrap();
    let ids: Vec<String> = tasks.lines().map(|line| serde_json::from_str::<Task>(line).unwrap().id).collect();
    // 24 ids begin with 16 digits.
    let mut groups = BTreeMap::<&str, Vec<&str>>::new();
    ids.iter().for_each(|id| groups.entry(&id[..1]).or_default().push(id));
    let (digit, several) = groups.into_iter().max_by_key(|(_, ids)| ids.len()).unwrap();
    let (code, said) = fails(&["study", "run", text(&study), "--task", digit]);
    assert_eq!(code, 2);
    let listed = several[..several.len().min(5)].join(", ");
    assert!(
        said.contains(&format!("{} tasks of this study begin with this id, expected one: {listed}", several.len())),
        "{said}"
    );
}

#[test]
fn shares_count_from_one_and_share_out_everything() {
    for (number, count) in [(0, 0), (0, 2), (1, 0), (3, 2)] {
        let message = Shard::new(number, count).expect_err("no share").to_string();
        assert_eq!(message, format!("expected I/N with I from 1 to N, such as 2/5, found `{number}/{count}`"));
    }
    assert_eq!("2/5".parse::<Shard>(), Shard::new(2, 5));
    let tasks = fs::read_to_string(small("shares").join("tasks.jsonl")).unwrap();
    let tasks: Vec<Task> = tasks.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    for count in [1, 2, 5, 30] {
        let shares: Vec<Vec<usize>> =
            (1..=count).map(|number| Shard::new(number, count).expect("a share").of(&tasks)).collect();
        let sizes = || shares.iter().map(Vec::len);
        assert!(sizes().max().unwrap() - sizes().min().unwrap() <= 1, "{count}: {:?}", sizes().collect::<Vec<_>>());
        let mut all: Vec<usize> = shares.into_iter().flatten().collect();
        all.sort_unstable();
        assert_eq!(all, (0..tasks.len()).collect::<Vec<_>>(), "{count}");
    }
}

#[test]
fn an_adapter_for_a_plan_that_computes_on_the_cpu_is_refused() {
    refused(2, &["study", "run", text(&small("adapter")), "--gpu", "0"]).says("--gpu: this plan computes on the CPU");
}

/// Table 1 has a period of 3 and of 18, and the cost of a task follows it.
#[test]
fn no_share_of_the_papers_study_is_all_of_one_kind() {
    let task = |variant: &Variant, follower: usize| Task {
        id: format!("{}-{follower}", variant.id()),
        platoon: "P3".to_owned(),
        follower,
        model_id: variant.id(),
        variant: variant.name(),
        gof: "nrmse-sva".to_owned(),
        replicate: 0,
    };
    let variants: Vec<Variant> = Variant::all().collect();
    let tasks: Vec<Task> =
        variants.iter().flat_map(|variant| (1..=4).map(|follower| task(variant, follower))).collect();
    for count in [3, 18] {
        for number in 1..=count {
            let share = Shard::new(number, count).unwrap().of(&tasks);
            let places: BTreeSet<u32> = share.iter().map(|&i| (tasks[i].model_id - 1) % 18).collect();
            let constraints: BTreeSet<u32> = places.iter().map(|place| place % 3).collect();
            assert!(places.len() > 2 && constraints.len() > 1, "{number}/{count}: {places:?}");
            // Whole variants, except for those at its edges.
            let cut = |id: u32| share.iter().filter(|&&i| tasks[i].model_id == id).count() % 4 != 0;
            assert!(variants.iter().filter(|variant| cut(variant.id())).count() <= 2, "{number}/{count}");
        }
    }
}

#[test]
fn who_did_a_share_is_sent_to_the_others_and_who_did_the_last_one_to_merge() {
    let study = small("go_on");
    let shown = text(&study).to_owned();
    let said = |shard: &str| stderr(&leadlag(&["study", "run", &shown, "--shard", shard]));
    assert!(said("1/2").contains(&format!("continue with: leadlag study status {shown}")));
    assert!(said("2/2").contains(&format!("continue with: leadlag study merge {shown}")));
}
