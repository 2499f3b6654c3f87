//! The vehicle kernel of railui. The modules, ground floor first; each may use only those above it in this list.
pub mod assemble;
pub mod compare;
pub mod effects;
pub mod error;
pub mod integrate;
pub mod lanes;
pub mod many;
#[cfg(feature = "python")]
mod python;
pub mod ride;
pub mod vehicle;
pub mod wheelset;
