//! Result of an export: `loss.json`.

use super::{Comparison, Sumo, SumoError, VehicleType};
use crate::result::{DataEntry, ResultFile};
use crate::text::bounded::{self, RESULT_MAX};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::Path;

const SCHEMA_VERSION: u64 = 1;

/// An export to SUMO, in the form of `loss.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Export {
    pub schema_version: u64,
    /// SHA-256 of the result.json that was exported.
    pub result_sha256: String,
    pub variant: String,
    /// SUMO's model.
    pub model: String,
    /// The file with the vehicle type.
    pub file: String,
    /// Its attributes, in SUMO's units (m, s).
    pub attributes: BTreeMap<String, String>,
    /// Parts of the variant that the type lacks, one sentence each.
    pub lost: Vec<String>,
    /// Additional effects of the type, one sentence each.
    pub added: Vec<String>,
    /// Version of SUMO; none if it was not run.
    pub sumo: Option<String>,
    pub data: Vec<ExportedDrive>,
    /// Losses on each of them; empty if SUMO was not run.
    pub loss: Vec<Comparison>,
}

/// A drive that SUMO was run on.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ExportedDrive {
    /// The data file.
    pub path: String,
    /// Its SHA-256.
    pub sha256: String,
    /// 1 = right behind the platoon leader.
    pub follower: usize,
}

impl Export {
    /// An export of a result, with its loss per drive.
    pub fn new(
        (result, result_sha256): (&ResultFile, String),
        vtype: &VehicleType,
        file: &Path,
        sumo: Option<&Sumo>,
        loss: Vec<Comparison>,
    ) -> Export {
        let drive = |data: &DataEntry| ExportedDrive {
            path: data.path.clone(),
            sha256: data.sha256.clone(),
            follower: data.follower,
        };
        Export {
            schema_version: SCHEMA_VERSION,
            result_sha256,
            variant: result.model(),
            model: vtype.model.into_str().to_owned(),
            file: file.display().to_string(),
            attributes: vtype.attributes.iter().map(|(name, value)| ((*name).to_owned(), value.clone())).collect(),
            lost: vtype.lost.clone(),
            added: vtype.added.clone(),
            sumo: sumo.map(|sumo| sumo.version.clone()),
            data: result.data.iter().map(drive).collect(),
            loss,
        }
    }

    /// Reads `loss.json`; none without such a file. Fails if it is unreadable or of another version.
    pub fn read(path: &Path) -> Result<Option<Export>, SumoError> {
        let what = || format!("{}: expected what `leadlag export sumo` of this version wrote", path.display());
        let text = match bounded::read_to_string(path, RESULT_MAX) {
            Ok(text) => text,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(None),
            Err(source) => return Err(SumoError::Io { what: what(), source }),
        };
        let export: Export =
            serde_json::from_str(&text).map_err(|error| SumoError::Io { what: what(), source: error.into() })?;
        if export.schema_version != SCHEMA_VERSION {
            let found = format!("schema_version {SCHEMA_VERSION} expected, {} found", export.schema_version);
            return Err(SumoError::Io { what: what(), source: std::io::Error::other(found) });
        }
        Ok(Some(export))
    }
}
