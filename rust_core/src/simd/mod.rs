//! Sixteen numbers side by side: the only folder that knows SIMD.
//!
//! A law is written once, generic over a [`Part`]; [`dispatch`] compiles it for each level of the machine.
#[cfg(test)]
mod counted;
mod dual;
mod elementary;
mod lanes;
mod level;
pub mod peak;
mod portable;
#[cfg(target_arch = "x86_64")]
mod registers;

#[cfg(test)]
pub use counted::{Counted, Counts, counting};
pub use dual::Dual;
pub use elementary::Elementary;
pub(crate) use lanes::coefficients;
pub use lanes::{LANES, Lanes};
pub use level::{Job, Level, dispatch, level};
pub use portable::Portable;
use std::marker::PhantomData;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Work that is compiled once for a kind of part. `run` must be `#[inline(always)]`, and all it calls too.
pub trait Work {
    fn run(self);
}

/// A few lanes at once, as wide as the machine takes them.
pub trait Part:
    Copy + 'static + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self> + Neg<Output = Self>
{
    const WIDTH: usize;
    /// A part of one register per number.
    type Single: Part;
    fn splat(x: f64) -> Self;
    /// Lanes `at .. at + WIDTH`.
    fn load(from: &Lanes, at: usize) -> Self;
    fn store(self, to: &mut Lanes, at: usize);
    /// The first `WIDTH` numbers of a slice.
    fn read(from: &[f64]) -> Self;
    fn write(self, to: &mut [f64]);
    /// self * b + c
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// c - self * b
    fn neg_mul_add(self, b: Self, c: Self) -> Self;
    fn min(self, other: Self) -> Self;
    fn max(self, other: Self) -> Self;
    fn abs(self) -> Self;
    fn sqrt(self) -> Self;
    fn copy_sign(self, sign: Self) -> Self;
    /// `yes` where self < limit, else `no`.
    fn if_less(self, limit: Self, yes: Self, no: Self) -> Self;
    /// Is any lane at or above the limit?
    fn any_from(self, limit: Self) -> bool;
    /// Nearest whole number; abs(self) < 2^51.
    fn round(self) -> Self;
    /// 2^self for a whole number between -1000 and 1000.
    fn exp2_whole(self) -> Self;

    /// Runs work that would only swell the forms of the step loop if each had a copy.
    #[inline(always)]
    fn out_of_line(work: impl Work) {
        work.run();
    }

    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    #[inline(always)]
    fn clamp(self, limit: Self) -> Self {
        self.min(limit).max(-limit)
    }
}

/// Room for the state of one vehicle.
pub const STATES: usize = 64;

/// A place of the state of a part of the lanes, ready to be read and written.
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

/// 1.5 times two to the 52: added to a number it leaves the whole part in the low bits.
const MAGIC: f64 = 6_755_399_441_055_744.0;
