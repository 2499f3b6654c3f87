//! Integration over an input table: number of steps, RK4, recorded channels, ride statistics, comparison.
//! Each module may use only those above it in this list.
pub mod step_count;
pub mod ride_statistics;
pub mod recorder;
pub mod sample;
pub mod sampling;
pub mod rk4;
pub mod steps;
pub mod run;
pub mod comparison;
