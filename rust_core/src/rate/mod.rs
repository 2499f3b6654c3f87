//! Rates of change of the states of a group, in the forms that suit its structure.
//! Each module may use only those above it in this list.
pub mod blocks;
pub mod unrolled;
pub mod packed;
pub mod coach;
pub mod suspension;
pub mod fused;
pub mod input_table;
pub mod forms;
