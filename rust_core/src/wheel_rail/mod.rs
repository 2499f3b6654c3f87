//! Wheelset and wheel-rail contact. Each module may use only those above it in this list.
pub mod coefficients;
pub mod contact;
pub mod wheelset;
pub mod rail;
pub mod guiding;
pub mod equilibrium;
