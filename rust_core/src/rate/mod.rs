//! Rates of change of the states of a group, in the forms that suit its structure.
//! Each module may use only those above it in this list.
pub mod general;
pub mod bogie;
pub mod fused;
pub mod plan;
pub mod packing;
pub mod structures;
pub mod accelerations;
pub mod input_table;
pub mod forms;

use crate::simd::{Part, STATES};

/// A group in the step loop: its size, known when compiled or not, and its rate of change.
pub trait Rate<P: Part> {
    /// Degrees of freedom and states.
    fn size(&self) -> (usize, usize);
    /// Rate at a row of the input table with this index; entries of x behind the states are free.
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]);
}
