//! Measured drives.

use super::diagnosis::Source;
use super::error::{Error, refuse};
use super::loading::{Input, Loaded};
use super::reading::Reading;
use crate::catalog::Variant;
use crate::synthetic::{self, Scenario};
use crate::trajectory::{Recording as Read, Trajectory, is_nameless};
use std::path::Path;
use std::sync::Arc;

/// Reads a file of measured trajectories: the layouts that leadlag knows, with gzip or as Parquet, too. For other tables, other gaps or
/// resampling see [`Reading`].
///
/// # Errors
/// When it cannot be read, with line and column of the first problems of the file.
pub fn read(path: impl AsRef<Path>) -> Result<Recording, Error> {
    Reading::default().file(path)
}

/// A synthetic drive of one car behind another, as from a file, to try things without data. The same seed gives the same drive.
///
/// # Errors
/// When the duration \[s\] is not one of 20 s to some hours.
pub fn synthetic(seed: u64, duration_s: f64) -> Result<Recording, Error> {
    let platoon = synthetic::run(&Scenario { seed, duration_s, ..Scenario::default() }).map_err(anyhow::Error::from)?;
    let mut text = Vec::new();
    synthetic::write_pair(&platoon, 1, &mut text).map_err(anyhow::Error::from)?;
    Reading::default().text(&text, &format!("synthetic_{seed}.csv"))
}

/// A measured file: cars that drive one behind the other, or many pairs of them.
#[derive(Debug, Clone)]
pub struct Recording {
    pub(super) read: Arc<Read>,
    pub(super) reading: Arc<Reading>,
}

/// One measured follower behind its leader, prepared: gaps filled, one segment, one time step.
#[derive(Debug, Clone)]
pub struct Drive {
    pub(super) recording: Recording,
    pub(super) trajectory: Arc<Trajectory>,
    warnings: Vec<String>,
}

impl Reading {
    /// Reads a file.
    ///
    /// # Errors
    /// When it cannot be read, with line and column of the first problems of the file.
    pub fn file(&self, path: impl AsRef<Path>) -> Result<Recording, Error> {
        self.recording(Input::File(path.as_ref()))
    }

    /// Reads a table from memory, as from a file; `name` stands for the file in messages and results.
    ///
    /// # Errors
    /// As [`Reading::file`].
    pub fn text(&self, text: &[u8], name: &str) -> Result<Recording, Error> {
        self.recording(Input::Text(text, name))
    }

    fn recording(&self, input: Input<'_>) -> Result<Recording, Error> {
        Ok(Recording { read: Arc::new(self.open(input)?), reading: Arc::new(self.clone()) })
    }
}

impl Recording {
    /// The followers, by the numbers and names that [`Recording::follower`] takes; for a table of many pairs, those of the first pair.
    #[must_use]
    pub fn followers(&self) -> Vec<(usize, String)> {
        let cars = self.read.platoons[0].cars.iter().filter(|car| car.number > 1);
        cars.map(|car| (car.number - 1, car.name.clone())).collect()
    }

    /// The ids of its trajectories, of those that [`Reading::trajectory`] names if it names any; `None` for one without an id.
    #[must_use]
    pub fn trajectories(&self) -> Vec<Option<String>> {
        let wanted = self.reading.ids(&self.read);
        let ids = self.read.platoons.iter().map(|platoon| platoon.id.clone());
        ids.filter(|id| wanted.is_empty() || id.as_ref().is_some_and(|id| wanted.contains(id))).collect()
    }

    /// The drive of a follower: 1 is right behind the platoon leader.
    ///
    /// # Errors
    /// For an unknown follower, or if none of its segments is long enough.
    pub fn follower(&self, number: usize) -> Result<Drive, Error> {
        self.drive(Some(&number.to_string()))
    }

    /// The drive of a follower by its number or name, or by the id of its vehicle in a table with a column map; `None`: the only one.
    ///
    /// # Errors
    /// As [`Recording::follower`], and when several followers match.
    pub fn drive(&self, follower: Option<&str>) -> Result<Drive, Error> {
        let mut read = (*self.read).clone();
        let number = self.reading.chosen(&mut read, follower)?;
        let ids = self.reading.ids(&read);
        if let [_, another, ..] = ids.as_slice() {
            refuse!("a drive has one trajectory, but {another} is requested, too");
        }
        let mut warnings = Vec::new();
        let id = ids.first().map(String::as_str);
        let trajectory = self.reading.trajectory_of(&read, number, id, &mut |text| warnings.push(text))?;
        // A drive from a table of thousands of pairs keeps only its own pair.
        read.platoons.retain(|platoon| trajectory.id.is_none() || platoon.id == trajectory.id);
        let recording = Recording { read: Arc::new(read), reading: Arc::clone(&self.reading) };
        Ok(Drive { recording, trajectory: Arc::new(trajectory), warnings })
    }
}

impl Drive {
    /// The drive with a name for its follower, if the file has none.
    #[must_use]
    pub fn named(mut self, name: &str) -> Drive {
        if !is_nameless(&self.trajectory.name) {
            return self;
        }
        let number = self.trajectory.follower + 1;
        for platoon in &mut Arc::make_mut(&mut self.recording.read).platoons {
            let cars = platoon.cars.iter_mut().filter(|car| car.number == number && is_nameless(&car.name));
            cars.for_each(|car| name.clone_into(&mut car.name));
        }
        name.clone_into(&mut Arc::make_mut(&mut self.trajectory).name);
        self
    }

    /// The part between two times of the file \[s\], both included; times outside the drive are ignored. It is prepared without the
    /// measurements outside.
    ///
    /// # Errors
    /// When it is too short.
    pub fn between(&self, from: f64, to: f64) -> Result<Drive, Error> {
        let Trajectory { t, id, follower, .. } = &*self.trajectory;
        let Recording { read, reading } = &self.recording;
        // The part lies within one of the segments of the file.
        let reading = Reading {
            from: Some(from.max(t[0])),
            to: Some(to.min(t[t.len() - 1])),
            segment: None,
            ..(**reading).clone()
        };
        let trajectory = reading.trajectory_of(read, Some(*follower), id.as_deref(), &mut |_| {})?;
        let recording = Recording { read: Arc::clone(read), reading: Arc::new(reading) };
        Ok(Drive { recording, trajectory: Arc::new(trajectory), warnings: self.warnings.clone() })
    }

    /// The drive; if `wanted`, reading it again corrects faults of its data.
    pub(super) fn corrected(&self, wanted: bool) -> Drive {
        let mut drive = self.clone();
        Arc::make_mut(&mut drive.recording.reading).correct |= wanted;
        drive
    }

    /// The id of its trajectory, in files that hold several.
    #[must_use]
    pub fn trajectory(&self) -> Option<&str> {
        self.trajectory.id.as_deref()
    }

    /// `FILE follower N`, with trajectory id and segment if there are several.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.trajectory.label
    }

    /// Name of the follower as in the file.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.trajectory.name
    }

    /// Number of samples.
    #[must_use]
    #[expect(clippy::len_without_is_empty, reason = "a drive has at least two samples")]
    pub fn len(&self) -> usize {
        self.trajectory.len()
    }

    /// Time step \[s\].
    #[must_use]
    pub fn time_step(&self) -> f64 {
        self.trajectory.dt
    }

    /// Times \[s\], as in the file.
    #[must_use]
    pub fn time(&self) -> &[f64] {
        &self.trajectory.t
    }

    /// Bumper-to-bumper spacing \[m\].
    #[must_use]
    pub fn spacing(&self) -> &[f64] {
        &self.trajectory.s
    }

    /// Speed of the follower \[m/s\].
    #[must_use]
    pub fn speed(&self) -> &[f64] {
        &self.trajectory.v_f
    }

    /// Speed of the preceding vehicle \[m/s\].
    #[must_use]
    pub fn lead_speed(&self) -> &[f64] {
        &self.trajectory.v_l
    }

    /// Position of the follower along the road \[m\].
    #[must_use]
    pub fn position(&self) -> &[f64] {
        &self.trajectory.x_f
    }

    /// Position of the preceding vehicle \[m\]: of its rear bumper if its length is not known.
    #[must_use]
    pub fn lead_position(&self) -> &[f64] {
        &self.trajectory.x_l
    }

    /// True if other files were read with the one that holds the drive.
    #[must_use]
    pub fn has_companions(&self) -> bool {
        !self.recording.read.companions.is_empty()
    }

    /// Changes to the data, one line each: filled, cut, smoothed, resampled.
    #[must_use]
    pub fn preparation(&self) -> Vec<String> {
        self.trajectory.preparation().map(ToString::to_string).collect()
    }

    /// Doubtful values of the data, one line each.
    #[must_use]
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// The drive for a model: with the car, if the model needs one.
    pub(super) fn for_model(&self, model: &Variant) -> anyhow::Result<Loaded> {
        let vehicle = self.recording.reading.vehicle_for(&self.trajectory, model)?;
        let twin = self.recording.reading.twin(&self.recording.read, &self.trajectory);
        Ok(Loaded { trajectory: (*self.trajectory).clone(), vehicle, twin })
    }

    /// The drive with all measured signals around it.
    pub(super) fn source(&self) -> Source<'_> {
        let Recording { read, reading } = &self.recording;
        let Trajectory { follower, id, .. } = &*self.trajectory;
        Source { recording: (**read).clone(), reading, follower: *follower, id: id.clone() }
    }
}
