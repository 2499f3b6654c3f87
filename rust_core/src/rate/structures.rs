//! Structures whose rows are compiled as straight code: those of the files in `rust_core/structures`.
//!
//! `build.rs` writes a function per file and list of blocks; a test holds the files to the bundled vehicles.
use crate::rate::fused::{AnyStructure, Packed, State, Structure, Table};
use crate::rate::plan::Block;
use crate::simd::{Part, STATES};
use std::borrow::Cow;

/// A structure that is compiled: its size, and the blocks of the wheelsets, of all else, of the track.
pub struct Known {
    pub name: &'static str,
    pub size: (usize, usize),
    pub blocks: [&'static [Block]; 3],
}

/// Work that is compiled for every structure.
pub trait ForStructure {
    fn run<S: Structure + 'static>(self);
}

include!(concat!(env!("OUT_DIR"), "/structures.rs"));
