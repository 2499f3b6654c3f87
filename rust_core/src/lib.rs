//! The vehicle kernel of railui. The modules, ground floor first; each may use only those above it in this list.
pub mod error;
pub mod spline;
pub mod sections;
pub mod lanes;
pub mod peak;
pub mod profile;
pub mod effects;
pub mod wheelset;
pub mod assemble;
pub mod bodies;
pub mod kinds;
pub mod contact;
pub mod plain;
pub mod rows;
pub mod reading;
pub mod vehicle;
pub mod structure;
pub mod steps;
pub mod grouping;
pub mod blocks;
pub mod straight;
pub mod packed;
pub mod coach;
pub mod suspension;
pub mod fused;
pub mod course;
pub mod forms;
pub mod curve;
pub mod ride;
pub mod watch;
pub mod stepping;
pub mod integrate;
pub mod arithmetic;
pub mod compare;
pub mod many;

/// Hash of the sources that this kernel was built from.
pub const SOURCES: &str = env!("RAILUI_SOURCES");
