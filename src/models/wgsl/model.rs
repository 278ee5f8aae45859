//! A model by its name for users, whose base model may be a law in a file of their own.

use super::check::ShaderError;
use super::extension::read_extension;
use crate::catalog::{UnknownVariant, Variant};
use crate::extension::Extension;
use crate::text::bounded::{TEXT_MAX, read_to_string};
use std::path::Path;

/// Ending of a file with a law.
const ENDING: &str = ".wgsl";

/// A model that does not exist.
#[derive(Debug, thiserror::Error)]
pub enum ModelError {
    #[error(transparent)]
    Unknown(#[from] UnknownVariant),
    #[error("{file}: cannot be read")]
    File { file: String, source: std::io::Error },
    #[error(transparent)]
    Shader(#[from] ShaderError),
    #[error(
        "{file} is an extension: it has no function `{name}_law`. Give a base model and add the file to it, such as `--model idm --extend {file}`"
    )]
    NoLaw { file: String, name: String },
}

/// The file at the start of a model's name and the parts after it: `my_law.wgsl` and `+delay`. `None` if it does not begin with a file.
pub fn law_file(model: &str) -> Option<(&str, &str)> {
    let model = model.trim();
    let mut ends = model.match_indices(ENDING).map(|(at, _)| at + ENDING.len());
    let end = ends.find(|end| matches!(model.as_bytes().get(*end), None | Some(b'+')))?;
    Some(model.split_at(end))
}

/// Reads a law; messages use `file`, and the law is named after it, without folder and ending. Fails for an
/// extension, and for an invalid text.
pub fn read_law(file: &str, text: &str) -> Result<&'static Extension, ModelError> {
    let read = read_extension(file, text)?;
    let no_law = || ModelError::NoLaw { file: file.to_owned(), name: read.name.clone() };
    read.is_law().then_some(read).ok_or_else(no_law)
}

/// A law followed by parts, such as `+delay+linear`.
pub fn law_with(law: &'static Extension, parts: &str) -> Result<Variant, UnknownVariant> {
    Variant::named(&format!("{}{parts}", law.name), &[law])
}

/// A model by its id, its name, or the file of a law: `31`, `gipps+delay`, `my_law.wgsl+delay`.
pub fn read_model(model: &str) -> Result<Variant, ModelError> {
    let Some((file, parts)) = law_file(model) else { return Ok(model.parse()?) };
    let text = read_to_string(Path::new(file), TEXT_MAX)
        .map_err(|source| ModelError::File { file: file.to_owned(), source })?;
    Ok(law_with(read_law(file, &text)?, parts)?)
}

#[cfg(test)]
mod tests {
    use super::law_file;

    #[test]
    fn files_are_told_from_names() {
        assert_eq!(law_file("idm+delay"), None);
        assert_eq!(law_file("a.wgsl"), Some(("a.wgsl", "")));
        assert_eq!(law_file(" laws/a+b.wgsl+delay+linear"), Some(("laws/a+b.wgsl", "+delay+linear")));
        assert_eq!(law_file("x.wgsl.d/a.wgsl+delay"), Some(("x.wgsl.d/a.wgsl", "+delay")));
        assert_eq!(law_file("a.wgslx"), None);
    }
}
