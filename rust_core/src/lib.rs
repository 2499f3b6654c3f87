//! The vehicle kernel of railui. Each module may use only those above it in this list; so may those of a folder.
pub mod error;
pub mod simd;
pub mod numeric;
pub mod effects;
pub mod wheel_rail;
pub mod vehicle;
pub mod rate;
pub mod integrate;
pub mod curving;
pub mod batch;
#[cfg(test)]
mod operations;

/// Hash of the sources that this kernel was built from.
pub const SOURCES: &str = env!("RAILUI_SOURCES");
