//! A part that counts what is asked of it.
use super::{Lanes, MAGIC, Part};
use std::cell::Cell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Instructions of arithmetic on parts of the lanes. Signs (negation, magnitude, the sign of another number) are not
/// counted: mostly they come with another instruction.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Counts {
    /// a b + c or c - a b
    pub fused: u64,
    pub products: u64,
    /// Sums and differences; the steps to a nearest whole number among them.
    pub sums: u64,
    /// The lesser, the greater, a comparison with or without a choice that follows.
    pub choices: u64,
    pub roots: u64,
    pub quotients: u64,
}

impl Counts {
    pub const NONE: Counts = Counts { fused: 0, products: 0, sums: 0, choices: 0, roots: 0, quotients: 0 };

    /// All of them, each counted as one.
    pub fn all(&self) -> u64 {
        self.fused + self.products + self.sums + self.choices + self.roots + self.quotients
    }

    /// These and so many times others.
    pub fn and(self, times: u64, others: Counts) -> Self {
        Counts {
            fused: self.fused + times * others.fused,
            products: self.products + times * others.products,
            sums: self.sums + times * others.sums,
            choices: self.choices + times * others.choices,
            roots: self.roots + times * others.roots,
            quotients: self.quotients + times * others.quotients,
        }
    }
}

thread_local! {
    static SO_FAR: Cell<Counts> = const { Cell::new(Counts::NONE) };
}

/// Count the operations of some work on [`Counted`] numbers on this thread.
pub fn counting(work: impl FnOnce()) -> Counts {
    SO_FAR.set(Counts::NONE);
    work();
    SO_FAR.get()
}

fn one_more(of: impl FnOnce(&mut Counts) -> &mut u64) {
    let mut counts = SO_FAR.get();
    *of(&mut counts) += 1;
    SO_FAR.set(counts);
}

/// One lane, whose operations count as those of a register.
#[derive(Clone, Copy, Debug)]
pub struct Counted(f64);

macro_rules! counted_op {
    ($trait:ident, $op:ident, $count:ident) => {
        impl $trait for Counted {
            type Output = Self;
            fn $op(self, o: Self) -> Self {
                one_more(|c| &mut c.$count);
                Counted($trait::$op(self.0, o.0))
            }
        }
    };
}
counted_op!(Add, add, sums);
counted_op!(Sub, sub, sums);
counted_op!(Mul, mul, products);
counted_op!(Div, div, quotients);

impl Neg for Counted {
    type Output = Self;
    fn neg(self) -> Self {
        Counted(-self.0)
    }
}

impl Part for Counted {
    const WIDTH: usize = 1;
    type Single = Self;
    fn splat(x: f64) -> Self {
        Counted(x)
    }
    fn load(from: &Lanes, at: usize) -> Self {
        Counted(from.0[at])
    }
    fn store(self, to: &mut Lanes, at: usize) {
        to.0[at] = self.0;
    }
    fn read(from: &[f64]) -> Self {
        Counted(from[0])
    }
    fn write(self, to: &mut [f64]) {
        to[0] = self.0;
    }
    fn mul_add(self, b: Self, c: Self) -> Self {
        one_more(|c| &mut c.fused);
        Counted(self.0 * b.0 + c.0)
    }
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        one_more(|c| &mut c.fused);
        Counted(c.0 - self.0 * b.0)
    }
    fn min(self, o: Self) -> Self {
        one_more(|c| &mut c.choices);
        Counted(self.0.min(o.0))
    }
    fn max(self, o: Self) -> Self {
        one_more(|c| &mut c.choices);
        Counted(self.0.max(o.0))
    }
    fn abs(self) -> Self {
        Counted(self.0.abs())
    }
    fn sqrt(self) -> Self {
        one_more(|c| &mut c.roots);
        Counted(self.0.sqrt())
    }
    fn copy_sign(self, s: Self) -> Self {
        Counted(self.0.copysign(s.0))
    }
    fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
        one_more(|c| &mut c.choices);
        if self.0 < limit.0 { yes } else { no }
    }
    fn any_from(self, limit: Self) -> bool {
        one_more(|c| &mut c.choices);
        self.0 >= limit.0
    }
    fn round(self) -> Self {
        (self + Counted(MAGIC)) - Counted(MAGIC)
    }
    fn exp2_whole(self) -> Self {
        one_more(|c| &mut c.sums);
        Counted(self.0.exp2())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Elementary;

    #[test]
    fn every_operation_of_an_expression_is_counted_once() {
        let (a, b) = (Counted(3.0), Counted(-4.0));
        let mut value = 0.0;
        let counts = counting(|| {
            let length = a.mul_add(a, b * b).sqrt();
            value = (-(length + b)).abs().clamp(a).if_less(b, a, length / b - a).0;
        });
        assert_eq!(counts, Counts { fused: 1, products: 1, sums: 2, choices: 3, roots: 1, quotients: 1 });
        assert_eq!((counts.all(), value), (9, 5.0 / -4.0 - 3.0));
        assert_eq!(counting(|| {}), Counts::NONE);
    }

    #[test]
    fn a_number_that_counts_is_the_number() {
        let x = Counted(-1.3);
        let (tanh, sin, exp) = (x.tanh().0, x.sin().0, x.exp_below_zero().0);
        assert!((tanh + 1.3_f64.tanh()).abs() < 1e-15 && (sin + 1.3_f64.sin()).abs() < 1e-14);
        assert!((exp / (-1.3_f64).exp() - 1.0).abs() < 1e-14);
    }
}
