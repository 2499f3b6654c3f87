//! Numerical building blocks. Each module may use only those above it in this list.
pub mod spline;
pub mod biquad;
pub mod profile_table;
pub mod profile_spline;
pub mod sparse_rows;
