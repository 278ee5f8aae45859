//! Rates of right names, for `leadlag bench diagnosis --page`: a part of a Markdown page, and two pictures.

mod page;
mod pictures;

pub use page::{BEGIN, END, PageError, Provenance, into_page, part};
pub use pictures::{names, power};
