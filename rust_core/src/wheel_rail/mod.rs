//! Wheelset and wheel-rail contact. Each module may use only those above it in this list.
pub mod contact;
pub mod wheelset;
