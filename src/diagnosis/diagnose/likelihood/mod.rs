//! How likely a model makes the data: the observer, the model that runs inside it, its fit, and what is scored.

pub mod descent;
pub mod fit;
pub mod fold;
pub mod model;
pub mod normal_equations;
pub mod observer;
pub mod robust;
pub mod space;
pub mod streams;
