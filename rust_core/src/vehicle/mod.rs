//! Vehicles: assembled matrices, kinds, bodies and joints, and groups of vehicles in lanes.
//! Each module may use only those above it in this list.
pub mod assembly;
pub mod line;
pub mod bodies;
pub mod kinds;
pub mod plain_bogie;
pub mod channels;
pub mod group;
pub mod structure;
pub mod grouping;
