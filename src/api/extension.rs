//! Extensions on the command line: names of built-in ones, or files.

use super::error::{Usage, refuse};
use crate::catalog::Variant;
use crate::extension::Extension;
use crate::text::option::EXTEND;
use crate::text::spelling::did_you_mean;
use crate::wgsl::{extension_named, library, read_extension};
use anyhow::Context;
use std::path::Path;

/// A variant with extensions, each given by name or file.
pub fn extend(variant: Variant, extensions: &[String]) -> anyhow::Result<Variant> {
    extensions.iter().try_fold(variant, |variant, given| {
        if given.contains(',') && !Path::new(given).exists() {
            let each: Vec<String> = given.split(',').map(|one| format!("{EXTEND} {}", one.trim())).collect();
            refuse!("{EXTEND} {given}: expected one extension; give {EXTEND} several times: {}", each.join(" "));
        }
        let extension = find(given)?;
        variant.with(extension).map_err(|conflict| Usage(format!("{EXTEND} {given}: {conflict}")).into())
    })
}

/// An extension by the name of a built-in one, or by its file.
pub fn find(given: &str) -> anyhow::Result<&'static Extension> {
    if Path::new(given).extension().is_none_or(|e| e != "wgsl") {
        let names = || library().iter().filter(|e| e.cause.is_some()).map(|e| e.name.as_str());
        return extension_named(given).ok_or_else(|| {
            let message = format!(
                "no built-in extension is called `{given}`{}\n`leadlag list causes` shows them; your own file ends \
                 in .wgsl",
                did_you_mean(given, names())
            );
            Usage(message).into()
        });
    }
    let text = crate::text::bounded::read_to_string(given.as_ref(), crate::text::bounded::TEXT_MAX)
        .with_context(|| format!("{given}: cannot be read"))?;
    Ok(read_extension(given, &text)?)
}
