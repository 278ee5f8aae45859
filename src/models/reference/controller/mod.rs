//! Controllers: from perceived signals to the commanded acceleration. One file per row of the catalog.

use super::types::Perceived;
use crate::catalog::{Controller, controller_parts};
use crate::symbols::Parameters;

/// Output of a controller.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// a_cmd \[m/s²\].
    pub a_cmd: f64,
    /// False if the controller's own equation has no solution (Gipps' radicand).
    pub feasible: bool,
}

impl Command {
    fn of(a_cmd: f64) -> Command {
        Command { a_cmd, feasible: true }
    }
}

/// `(p, x, s_des, v_f)` to the command; `v_f` is the undelayed speed.
pub(super) type CommandedAcceleration = fn(&Parameters, &Perceived, f64, f64) -> Command;

macro_rules! declare {
    ($folder:ident, $doc:literal; $($part:ident, $file:ident, $paper:literal, [$($symbol:ident),*];)*) => {
        $(mod $file;)*

        pub(super) fn pick(part: Controller) -> CommandedAcceleration {
            match part { $(Controller::$part => $file::commanded_acceleration),* }
        }
    };
}
controller_parts!(declare);
