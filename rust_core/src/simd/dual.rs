//! A number with its derivative: any rate of change that runs on it is linearised exactly.
use super::{Lanes, Part, Portable};
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A part of the lanes and its derivative with respect to one variable, lane by lane.
///
/// At a kink of two branches the derivative is their mean, as of a central difference. The root of zero has derivative zero:
/// that of a magnitude in a product that vanishes with it.
#[derive(Clone, Copy, Debug)]
pub struct Dual<P> {
    pub value: P,
    pub slope: P,
}

impl<P: Part> Dual<P> {
    pub fn new(value: P, slope: P) -> Self {
        Dual { value, slope }
    }

    fn constant(value: P) -> Self {
        Dual { value, slope: P::zero() }
    }

    /// The sign, of zero too.
    fn sign(self) -> P {
        P::splat(1.0).copy_sign(self.value)
    }

    /// The slope of the lesser of two, half that of both where they are equal.
    fn slope_of_lesser(self, other: Self) -> P {
        let mean = P::splat(0.5) * (self.slope + other.slope);
        let others = other.value.if_less(self.value, other.slope, mean);
        self.value.if_less(other.value, self.slope, others)
    }
}

impl Dual<Portable> {
    /// Independent variables at zero, each of a lane of its own: a result has its derivatives side by side.
    pub fn variables<const N: usize>() -> [Self; N] {
        std::array::from_fn(|variable| {
            let one = Lanes::from_fn(|l| f64::from(l == variable));
            Dual::new(Portable::zero(), Portable::load(&one, 0))
        })
    }

    /// Derivatives with respect to N [`Dual::variables`].
    pub fn derivatives<const N: usize>(self) -> [f64; N] {
        let mut slopes = Lanes::ZERO;
        self.slope.store(&mut slopes, 0);
        std::array::from_fn(|variable| slopes.0[variable])
    }
}

// calls, for an inlined rate would be long to compile
impl<P: Part> Add for Dual<P> {
    type Output = Self;
    #[inline(never)]
    fn add(self, o: Self) -> Self {
        Dual::new(self.value + o.value, self.slope + o.slope)
    }
}

impl<P: Part> Sub for Dual<P> {
    type Output = Self;
    #[inline(never)]
    fn sub(self, o: Self) -> Self {
        Dual::new(self.value - o.value, self.slope - o.slope)
    }
}

impl<P: Part> Mul for Dual<P> {
    type Output = Self;
    #[inline(never)]
    fn mul(self, o: Self) -> Self {
        Dual::new(self.value * o.value, self.slope.mul_add(o.value, self.value * o.slope))
    }
}

impl<P: Part> Div for Dual<P> {
    type Output = Self;
    #[inline(never)]
    fn div(self, o: Self) -> Self {
        let quotient = self.value / o.value;
        Dual::new(quotient, quotient.neg_mul_add(o.slope, self.slope) / o.value)
    }
}

impl<P: Part> Neg for Dual<P> {
    type Output = Self;
    fn neg(self) -> Self {
        Dual::new(-self.value, -self.slope)
    }
}

impl<P: Part> Part for Dual<P> {
    const WIDTH: usize = P::WIDTH;
    type Single = Self;
    fn splat(x: f64) -> Self {
        Dual::constant(P::splat(x))
    }
    fn load(from: &Lanes, at: usize) -> Self {
        Dual::constant(P::load(from, at))
    }
    /// The value alone.
    fn store(self, to: &mut Lanes, at: usize) {
        self.value.store(to, at);
    }
    fn read(from: &[f64]) -> Self {
        Dual::constant(P::read(from))
    }
    /// The value alone.
    fn write(self, to: &mut [f64]) {
        self.value.write(to);
    }
    #[inline(never)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        let slope = self.slope.mul_add(b.value, self.value.mul_add(b.slope, c.slope));
        Dual::new(self.value.mul_add(b.value, c.value), slope)
    }
    #[inline(never)]
    fn neg_mul_add(self, b: Self, c: Self) -> Self {
        let slope = self.slope.neg_mul_add(b.value, self.value.neg_mul_add(b.slope, c.slope));
        Dual::new(self.value.neg_mul_add(b.value, c.value), slope)
    }
    #[inline(never)]
    fn min(self, o: Self) -> Self {
        Dual::new(self.value.min(o.value), self.slope_of_lesser(o))
    }
    #[inline(never)]
    fn max(self, o: Self) -> Self {
        Dual::new(self.value.max(o.value), -(-self).slope_of_lesser(-o))
    }
    fn abs(self) -> Self {
        Dual::new(self.value.abs(), self.slope * self.sign())
    }
    #[inline(never)]
    fn sqrt(self) -> Self {
        let (root, none) = (self.value.sqrt(), P::zero());
        Dual::new(root, none.if_less(root, self.slope / (root + root), none))
    }
    #[inline(never)]
    fn copy_sign(self, s: Self) -> Self {
        Dual::new(self.value.copy_sign(s.value), self.slope * self.sign() * s.sign())
    }
    #[inline(never)]
    fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
        let choose = |yes, no| self.value.if_less(limit.value, yes, no);
        Dual::new(choose(yes.value, no.value), choose(yes.slope, no.slope))
    }
    fn any_from(self, limit: Self) -> bool {
        self.value.any_from(limit.value)
    }
    fn round(self) -> Self {
        Dual::constant(self.value.round())
    }
    fn exp2_whole(self) -> Self {
        Dual::constant(self.value.exp2_whole())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::Elementary;

    /// The value and the derivative of a function at four places.
    fn at(places: [f64; 4], f: impl Fn(Dual<Portable>) -> Dual<Portable>) -> ([f64; 4], [f64; 4]) {
        let mut from = Lanes::ZERO;
        from.0[..4].copy_from_slice(&places);
        let result = f(Dual::new(Portable::load(&from, 0), Portable::splat(1.0)));
        let first_four = |part: Portable| {
            let mut to = Lanes::ZERO;
            part.store(&mut to, 0);
            std::array::from_fn(|l| to.0[l])
        };
        (first_four(result.value), first_four(result.slope))
    }

    #[test]
    fn elementary_functions_have_their_derivatives() {
        let x = [-1.3, -0.2, 0.4, 2.1];
        let (_, tanh) = at(x, |x| x.tanh());
        let (_, sin) = at(x, |x| x.sin());
        let (_, rational) = at(x, |x| (x.abs().sqrt() + x * x) / (x * x + Dual::splat(2.0)));
        for (i, x) in x.into_iter().enumerate() {
            assert!((tanh[i] - x.cosh().powi(-2)).abs() < 1e-14 && (sin[i] - x.cos()).abs() < 1e-14, "{x}");
            let (p, q) = (x.abs().sqrt() + x * x, x * x + 2.0);
            let expected = ((0.5 * x.signum() / x.abs().sqrt() + 2.0 * x) * q - p * 2.0 * x) / (q * q);
            assert!((rational[i] - expected).abs() < 1e-14, "{x}");
        }
    }

    #[test]
    fn a_law_at_rest_has_the_slope_of_a_central_difference() {
        let half = Dual::splat(0.5);
        let (_, tanh) = at([0.0, -0.0, 0.5, -0.5], |x| x.tanh());
        assert_eq!(tanh[..2], [1.0, 1.0]);
        // one-sided, beyond a clearance, and a magnitude times what vanishes
        assert_eq!(at([0.0, 1.0, -1.0, 2.0], |x| x.max(Dual::zero())).1, [0.5, 1.0, 0.0, 1.0]);
        assert_eq!(at([0.0, 0.5, -2.0, 0.7], |x| x - x.clamp(half)).1, [0.0, 0.5, 1.0, 1.0]);
        assert_eq!(at([0.0; 4], |x| (x * x).sqrt() * x).1, [0.0; 4]);
    }
}
