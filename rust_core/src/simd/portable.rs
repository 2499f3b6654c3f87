//! Parts without vector instructions, as far as the compiler does not find some.
use super::{Lanes, MAGIC, Part, Work};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Four lanes in plain Rust, for machines without AVX2.
///
/// Every operation is straight code: `map` and `from_fn` of arrays are loops, of which the step loop, where all is inlined,
/// would have thousands, and compiling them took longer than all else.
#[derive(Clone, Copy)]
pub struct Portable([f64; 4]);

macro_rules! portable_op {
    ($trait:ident, $op:ident) => {
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $op(self, o: Self) -> Self {
                self.with(o, $trait::$op)
            }
        }
    };
}
portable_op!(Add, add);
portable_op!(Sub, sub);
portable_op!(Mul, mul);
portable_op!(Div, div);

impl Neg for Portable {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.each(|x| -x)
    }
}

impl Portable {
    #[inline(always)]
    fn each(self, f: impl Fn(f64) -> f64) -> Self {
        let [a, b, c, d] = self.0;
        Portable([f(a), f(b), f(c), f(d)])
    }

    #[inline(always)]
    fn with(self, o: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        let (a, b) = (self.0, o.0);
        Portable([f(a[0], b[0]), f(a[1], b[1]), f(a[2], b[2]), f(a[3], b[3])])
    }
}

impl Part for Portable {
    const WIDTH: usize = 4;
    type Single = Self;
    #[inline(never)]
    fn out_of_line(work: impl Work) {
        work.run();
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Portable([x; 4])
    }
    #[inline(always)]
    fn load(from: &Lanes, at: usize) -> Self {
        Portable(from.0[at..at + 4].try_into().expect("four lanes"))
    }
    #[inline(always)]
    fn store(self, to: &mut Lanes, at: usize) {
        to.0[at..at + 4].copy_from_slice(&self.0);
    }
    #[inline(always)]
    fn read(from: &[f64]) -> Self {
        Portable(from[..4].try_into().expect("four lanes"))
    }
    #[inline(always)]
    fn write(self, to: &mut [f64]) {
        to[..4].copy_from_slice(&self.0);
    }
    // without the hardware's instruction a fused product would be a call of libm
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        c - self * b
    }
    #[inline(always)]
    fn any_from(self, limit: Self) -> bool {
        let (a, b) = (self.0, limit.0);
        (a[0] >= b[0]) | (a[1] >= b[1]) | (a[2] >= b[2]) | (a[3] >= b[3])
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        self.with(o, |a, b| if a < b { a } else { b })
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        self.with(o, |a, b| if a > b { a } else { b })
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.each(f64::abs)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.each(f64::sqrt)
    }
    #[inline(always)]
    fn copy_sign(self, s: Self) -> Self {
        self.with(s, f64::copysign)
    }
    #[inline(always)]
    fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
        let one = |i: usize| if self.0[i] < limit.0[i] { yes.0[i] } else { no.0[i] };
        Portable([one(0), one(1), one(2), one(3)])
    }
    #[inline(always)]
    fn round(self) -> Self {
        self.each(|x| (x + MAGIC) - MAGIC)
    }
    #[inline(always)]
    fn exp2_whole(self) -> Self {
        self.each(|x| f64::from_bits((x + (MAGIC + 1023.0)).to_bits() << 52))
    }
}
