//! Places in the state of a part of the lanes, ready to be read and written.
use crate::simd::Part;
use std::marker::PhantomData;

/// Room for the state of one vehicle.
pub const STATES: usize = 64;

/// A place of a state, ready to be read.
#[derive(Clone, Copy, Debug)]
pub struct Place<P>(u32, PhantomData<P>);

impl<P: Part> Place<P> {
    /// Panics from [`STATES`] on.
    pub fn new(index: usize) -> Self {
        assert!(index < STATES, "a place that is not there");
        Place((index * size_of::<P>()) as u32, PhantomData)
    }

    #[inline(always)]
    pub fn of(self, x: &[P; STATES]) -> P {
        // SAFETY: a place is made below STATES alone; an index would have to be masked and shifted
        unsafe { *x.as_ptr().byte_add(self.0 as usize) }
    }

    #[inline(always)]
    pub fn put(self, x: &mut [P; STATES], value: P) {
        // SAFETY: as above
        unsafe { *x.as_mut_ptr().byte_add(self.0 as usize) = value }
    }
}
