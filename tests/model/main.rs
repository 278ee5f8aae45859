//! Tests that do not compare evaluators: the catalog, the reference, searches, identification of parameters, synthetic drives.

#[path = "../common/mod.rs"]
mod common;

mod calibration;
mod catalog;
mod causes_of_laws;
mod course;
mod derivatives;
mod exact_times;
mod functions;
mod identify;
mod observer;
mod optimize;
mod options;
mod reference_paper;
mod refused_extensions;
mod revision;
mod svg;
mod synthetic;
mod synthetic_effects;
mod wgsl;
