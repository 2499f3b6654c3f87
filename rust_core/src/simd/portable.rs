//! Parts without vector instructions, as far as the compiler does not find some.
use super::{Lanes, MAGIC, Part};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Four lanes in plain Rust, for machines without AVX2.
#[derive(Clone, Copy)]
pub struct Portable([f64; 4]);

macro_rules! portable_op {
    ($trait:ident, $op:ident) => {
        impl $trait for Portable {
            type Output = Self;
            #[inline(always)]
            fn $op(self, o: Self) -> Self {
                let (a, b) = (self.0, o.0);
                Portable([
                    $trait::$op(a[0], b[0]),
                    $trait::$op(a[1], b[1]),
                    $trait::$op(a[2], b[2]),
                    $trait::$op(a[3], b[3]),
                ])
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
        Portable(self.0.map(|x| -x))
    }
}

impl Portable {
    #[inline(always)]
    fn with(self, o: Self, f: impl Fn(f64, f64) -> f64) -> Self {
        Portable(std::array::from_fn(|i| f(self.0[i], o.0[i])))
    }
}

impl Part for Portable {
    const WIDTH: usize = 4;
    type Single = Self;
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
        self.0.iter().zip(&limit.0).any(|(a, b)| a >= b)
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
        Portable(self.0.map(f64::abs))
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Portable(self.0.map(f64::sqrt))
    }
    #[inline(always)]
    fn copy_sign(self, s: Self) -> Self {
        self.with(s, f64::copysign)
    }
    #[inline(always)]
    fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
        Portable(std::array::from_fn(|i| if self.0[i] < limit.0[i] { yes.0[i] } else { no.0[i] }))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Portable(self.0.map(|x| (x + MAGIC) - MAGIC))
    }
    #[inline(always)]
    fn exp2_whole(self) -> Self {
        Portable(self.0.map(|x| f64::from_bits((x + (MAGIC + 1023.0)).to_bits() << 52)))
    }
}
