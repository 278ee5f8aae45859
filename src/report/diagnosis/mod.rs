//! A diagnosis for people: text of 80 columns, and pictures.

pub mod causes;
pub mod pictures;
pub mod short;
pub mod text;
