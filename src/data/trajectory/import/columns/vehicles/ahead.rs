//! Order of the vehicles in a lane, at each row.

use super::super::role::Role;
use super::Long;
use std::collections::HashMap;

/// Instead of a row: the vehicle ahead is named, but absent at this time.
pub(super) const ABSENT: u32 = u32::MAX;

impl Long<'_> {
    /// The vehicle that each row names, and its row at the same time; and how many vehicles follow one that the table does not have.
    pub(super) fn named_ahead(&self) -> (Vec<Option<(u32, u32)>>, usize) {
        let ahead = self.table.names(Role::Ahead).expect("a map without it is refused, or searches");
        // Several vehicles may have the same number, one after the other.
        let mut bearers: HashMap<(u32, u32), Vec<u32>> = HashMap::new();
        for (vehicle, one) in (0..).zip(&self.vehicles) {
            bearers.entry(one.key).or_default().push(vehicle);
        }
        let nobody: Vec<bool> = self.table.dictionary.iter().map(|name| self.map.nobody.contains(name)).collect();
        let mut found = vec![None; self.time.len()];
        let mut absent = vec![false; self.vehicles.len()];
        for (ego, vehicle) in (0..).zip(&self.vehicles) {
            for &row in vehicle.rows.iter().filter(|&&row| !nobody[ahead[row] as usize]) {
                absent[ego as usize] |= !bearers.contains_key(&(vehicle.key.0, ahead[row]));
                let bearers = bearers.get(&(vehicle.key.0, ahead[row])).map(Vec::as_slice).unwrap_or_default();
                let t = self.time[row];
                // The one at its time; they do not overlap.
                let is_there = |lead: &&u32| {
                    let rows = &self.vehicles[**lead as usize].rows;
                    let [first, last] =
                        [rows.first(), rows.last()].map(|row| row.map_or(f64::NAN, |&row| self.time[row]));
                    (first..=last).contains(&t)
                };
                found[row] = bearers.iter().filter(|lead| **lead != ego).find(is_there).map(|&lead| {
                    let rows = &self.vehicles[lead as usize].rows;
                    let at = rows.binary_search_by(|&other| self.time[other].total_cmp(&t));
                    (lead, at.map_or(ABSENT, |at| rows[at] as u32))
                });
            }
        }
        (found, absent.into_iter().filter(|absent| *absent).count())
    }

    /// The nearest vehicle in front in the same lane and group at the same time, which drives in the same direction.
    pub(super) fn nearest_in_front(&self) -> Vec<Option<(u32, u32)>> {
        let lane = self.table.names(Role::Lane);
        let mut rows: Vec<(u32, usize, f64)> = Vec::with_capacity(self.time.len());
        for (number, vehicle) in (0..).zip(&self.vehicles) {
            let front = |&row: &usize| Some((number, row, self.front(vehicle, row).filter(|x| x.is_finite())?));
            rows.extend(vehicle.rows.iter().filter_map(front));
        }
        let place = |&(vehicle, row, _): &(u32, usize, f64)| {
            let vehicle = &self.vehicles[vehicle as usize];
            (vehicle.key.0, lane.map_or(0, |lane| lane[row]), vehicle.sign > 0.0, self.time[row].to_bits())
        };
        rows.sort_by(|a, b| place(a).cmp(&place(b)).then(a.2.total_cmp(&b.2)));
        let mut found = vec![None; self.time.len()];
        for together in rows.chunk_by(|a, b| place(a) == place(b)) {
            for pair in together.windows(2) {
                found[pair[0].1] = Some((pair[1].0, pair[1].1 as u32));
            }
            // On a closed track the last one in front follows the first one.
            if let (Some(_), [first, .., last]) = (self.map.lap_length, together) {
                found[last.1] = Some((first.0, first.1 as u32));
            }
        }
        found
    }
}
