//! The likelihood of the data under a model: the observer, the model inside it, its fit, and the score.

pub mod descent;
pub mod fit;
pub mod fold;
pub mod model;
pub mod normal_equations;
pub mod observer;
pub mod robust;
pub mod space;
pub mod streams;
