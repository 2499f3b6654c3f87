//! Two registers per number.
use super::{Lanes, Part, Work};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Two narrow parts as one: independent work to fill the latency of each other.
#[derive(Clone, Copy)]
pub struct Pair<P>(P, P);

macro_rules! pair_op {
    ($trait:ident, $op:ident) => {
        impl<P: Part> $trait for Pair<P> {
            type Output = Self;
            #[inline(always)]
            fn $op(self, o: Self) -> Self {
                Pair($trait::$op(self.0, o.0), $trait::$op(self.1, o.1))
            }
        }
    };
}
pair_op!(Add, add);
pair_op!(Sub, sub);
pair_op!(Mul, mul);
pair_op!(Div, div);

impl<P: Part> Neg for Pair<P> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Pair(-self.0, -self.1)
    }
}

impl<P: Part<Single = P>> Part for Pair<P> {
    const WIDTH: usize = 2 * P::WIDTH;
    type Single = P;
    #[inline(always)]
    fn out_of_line(work: impl Work) {
        P::out_of_line(work);
    }
    #[inline(always)]
    fn splat(x: f64) -> Self {
        Pair(P::splat(x), P::splat(x))
    }
    #[inline(always)]
    fn load(from: &Lanes, at: usize) -> Self {
        Pair(P::load(from, at), P::load(from, at + P::WIDTH))
    }
    #[inline(always)]
    fn store(self, to: &mut Lanes, at: usize) {
        self.0.store(to, at);
        self.1.store(to, at + P::WIDTH);
    }
    #[inline(always)]
    fn read(from: &[f64]) -> Self {
        Pair(P::read(from), P::read(&from[P::WIDTH..]))
    }
    #[inline(always)]
    fn write(self, to: &mut [f64]) {
        self.0.write(to);
        self.1.write(&mut to[P::WIDTH..]);
    }
    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        Pair(self.0.mul_add(b.0, c.0), self.1.mul_add(b.1, c.1))
    }
    #[inline(always)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        Pair(self.0.neg_mul_add(b.0, c.0), self.1.neg_mul_add(b.1, c.1))
    }
    #[inline(always)]
    fn any_from(self, limit: Self) -> bool {
        self.0.any_from(limit.0) | self.1.any_from(limit.1)
    }
    #[inline(always)]
    fn min(self, o: Self) -> Self {
        Pair(self.0.min(o.0), self.1.min(o.1))
    }
    #[inline(always)]
    fn max(self, o: Self) -> Self {
        Pair(self.0.max(o.0), self.1.max(o.1))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Pair(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        Pair(self.0.sqrt(), self.1.sqrt())
    }
    #[inline(always)]
    fn copy_sign(self, s: Self) -> Self {
        Pair(self.0.copy_sign(s.0), self.1.copy_sign(s.1))
    }
    #[inline(always)]
    fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
        Pair(self.0.if_less(limit.0, yes.0, no.0), self.1.if_less(limit.1, yes.1, no.1))
    }
    #[inline(always)]
    fn round(self) -> Self {
        Pair(self.0.round(), self.1.round())
    }
    #[inline(always)]
    fn exp2_whole(self) -> Self {
        Pair(self.0.exp2_whole(), self.1.exp2_whole())
    }
}
