//! A law in a file outside of this folder, which `RAILUI_EFFECT` names when the kernel is built: a trial, a law of one's own.
include!(concat!(env!("OUT_DIR"), "/more.rs"));
