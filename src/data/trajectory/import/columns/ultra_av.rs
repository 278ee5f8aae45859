//! What Ultra-AV and Open-PAV tables say about the cars of a pair besides signals.

use super::role::Role;
use super::rows::Table;
use crate::trajectory::import::{driver_modes, median};
use crate::trajectory::{Note, Platoon};

/// Names in the order of the layout's map.
const LEAD_ID: usize = 0;
const LEAD_TYPE: usize = 1;
const OWN_ID: usize = 2;

/// Lengths and names of the cars, and the driver of the follower.
pub(super) fn complete(platoon: &mut Platoon, table: &Table) {
    let rows: Vec<usize> = platoon.lines.iter().filter_map(|line| table.lines.binary_search(line).ok()).collect();
    let Platoon { cars, notes, t, .. } = platoon;
    let [.., lead, own] = cars.as_mut_slice() else { return };
    // Centre to centre minus bumper to bumper is the mean of the two lengths; the files contain no more.
    let headway = table.numbers(Role::Headway);
    let gap = own.gap.iter().flatten();
    let length = headway.and_then(|headway| median(rows.iter().zip(gap).map(|(&row, gap)| headway[row] - gap)));
    let length = length.filter(|&length| length > 0.0);
    if let Some(length_m) = length {
        let from = "headway and gap, for cars of equal length".to_owned();
        notes.push(Note::LengthDerived { car: 1, length_m, from });
    }
    (lead.length, own.length) = (length, length);
    notes.extend(driver_modes(2, t.first().map(|&t_s| (t_s, "automated")).into_iter()));
    let name = |place| table.name(place, rows[0]);
    let vehicle = |id: &str| format!("automated vehicle {id}").trim().to_owned();
    let is_human = name(LEAD_TYPE) == "0" || name(LEAD_ID) == "-1";
    lead.name = if is_human { "human-driven".to_owned() } else { vehicle(name(LEAD_ID)) };
    own.name = vehicle(name(OWN_ID));
}
