//! Elementary functions of parts of the lanes, as laws of the catalogue need them.
use super::Part;

/// Functions made of the operations of a part.
pub trait Elementary: Part {
    /// tanh by exp(-2 abs(x)), odd by construction, absolute error below 1e-15.
    #[inline(always)]
    fn tanh(self) -> Self {
        let a = self.abs().min(Self::splat(20.0));
        let t = exp(a * Self::splat(-2.0));
        let one = Self::splat(1.0);
        ((one - t) / (one + t)).copy_sign(self)
    }

    /// exp for self <= 0, relative error below 1e-14; 0 to fifteen digits below -700.
    #[inline(always)]
    fn exp_below_zero(self) -> Self {
        exp(self.max(Self::splat(-700.0)))
    }

    /// Numerator and denominator of atan(self)/self for 0 <= self < 1e100, relative error of the quotient below 1e-15; the
    /// quotient is left to where others are made.
    ///
    /// atan x = y + atan t by one quotient t of three ranges, atan t = t + t^3 P(t^2)/Q(t^2) (Moshier, Cephes: atan.c).
    #[inline(always)]
    fn atan_fraction(self) -> [Self; 2] {
        let one = Self::splat(1.0);
        // 0 has the limit 1
        let x = self.max(Self::splat(1e-100));
        let (middle, high) = (Self::splat(0.66), Self::splat(1.0 + std::f64::consts::SQRT_2));
        let choose = |low, between, above| x.if_less(middle, low, x.if_less(high, between, above));
        let t = choose(x, x - one, -one) / choose(one, x + one, x);
        let y =
            choose(Self::zero(), Self::splat(std::f64::consts::FRAC_PI_4), Self::splat(std::f64::consts::FRAC_PI_2));
        let z = t * t;
        let (mut p, mut q) = (Self::splat(ATAN_P[0]), z + Self::splat(ATAN_Q[0]));
        for i in 1..5 {
            p = p.mul_add(z, Self::splat(ATAN_P[i]));
            q = q.mul_add(z, Self::splat(ATAN_Q[i]));
        }
        [(y + t).mul_add(q, t * z * p), x * q]
    }

    /// Sine, absolute error below 1e-14 for abs(self) < 1e6 with fused products, 1e-10 without.
    #[inline(always)]
    fn sin(self) -> Self {
        let k = (self * Self::splat(std::f64::consts::FRAC_1_PI)).round();
        let x = k.mul_add(Self::splat(-PI_HIGH), self);
        let x = k.mul_add(Self::splat(-PI_LOW), x);
        let x2 = x * x;
        let mut p = Self::splat(SINE[0]);
        for c in &SINE[1..] {
            p = p.mul_add(x2, Self::splat(*c));
        }
        // sin(x + k pi) = (-1)^k sin x; the parity of k from k/2 - round(k/2) = 0 or +/- 1/2
        let half = k * Self::splat(0.5);
        let odd = (half - half.round()).abs() * Self::splat(2.0);
        (x * p) * odd.mul_add(Self::splat(-2.0), Self::splat(1.0))
    }
}

impl<P: Part> Elementary for P {}

/// Coefficients of Cephes' atan, highest first; the first of Q is one.
const ATAN_P: [f64; 5] = [
    -8.750_608_600_031_904e-1,
    -1.615_753_718_733_365e1,
    -7.500_855_792_314_705e1,
    -1.228_866_684_490_136_2e2,
    -6.485_021_904_942_025e1,
];
const ATAN_Q: [f64; 5] = [
    2.485_846_490_142_306_3e1,
    1.650_270_098_316_988_5e2,
    4.328_810_604_912_902_7e2,
    4.853_903_996_359_137e2,
    1.945_506_571_482_614e2,
];
const PI_HIGH: f64 = std::f64::consts::PI;
const PI_LOW: f64 = 1.224_646_799_147_353_2e-16;
/// Taylor coefficients of sin(x)/x in x^2, highest first: 1e-16 at pi/2.
const SINE: [f64; 11] = [
    1.957_294_106_339_126_3e-20,
    -8.220_635_246_624_33e-18,
    2.811_457_254_345_520_6e-15,
    -7.647_163_731_819_816e-13,
    1.605_904_383_682_161_3e-10,
    -2.505_210_838_544_172e-8,
    2.755_731_922_398_589_3e-6,
    -1.984_126_984_126_984e-4,
    8.333_333_333_333_333e-3,
    -0.166_666_666_666_666_66,
    1.0,
];

/// exp for -700 < x <= 0: 2^n times a Taylor polynomial of the rest.
#[inline(always)]
fn exp<P: Part>(x: P) -> P {
    let n = (x * P::splat(std::f64::consts::LOG2_E)).round();
    let r = n.mul_add(P::splat(-0.693_147_180_369_123_8), x);
    let r = n.mul_add(P::splat(-1.908_214_929_270_587_7e-10), r);
    let mut p = P::splat(1.0 / 6_227_020_800.0);
    for k in
        [479_001_600.0, 39_916_800.0, 3_628_800.0, 362_880.0, 40_320.0, 5_040.0, 720.0, 120.0, 24.0, 6.0, 2.0, 1.0, 1.0]
    {
        p = p.mul_add(r, P::splat(1.0 / k));
    }
    p * n.exp2_whole()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Job, LANES, Lanes, Level, dispatch, level};

    struct Odd;
    impl Job for Odd {
        type Output = ();
        #[inline(always)]
        fn run<P: Part>(self) {
            let x = Lanes::from_fn(|i| -30.0 + 3.7 * i as f64);
            let mut y = Lanes::ZERO;
            for (f, g) in [(0, f64::tanh as fn(f64) -> f64), (1, f64::sin)] {
                for at in (0..LANES).step_by(P::WIDTH) {
                    let p = P::load(&x, at);
                    (if f == 0 { p.tanh() } else { p.sin() }).store(&mut y, at);
                }
                for i in 0..LANES {
                    assert!((y.0[i] - g(x.0[i])).abs() < 1e-14, "{} {} {}", x.0[i], y.0[i], g(x.0[i]));
                }
            }
        }
    }

    struct BelowZero;
    impl Job for BelowZero {
        type Output = ();
        #[inline(always)]
        fn run<P: Part>(self) {
            let x = Lanes::from_fn(|i| 0.003 * 2.3_f64.powi(i as i32));
            let (mut e, mut a) = (Lanes::ZERO, Lanes::ZERO);
            for at in (0..LANES).step_by(P::WIDTH) {
                let p = P::load(&x, at);
                (-p).exp_below_zero().store(&mut e, at);
                let [numerator, denominator] = p.atan_fraction();
                (numerator / denominator).store(&mut a, at);
            }
            for i in 0..LANES {
                assert!((e.0[i] / (-x.0[i]).exp() - 1.0).abs() < 1e-13 || x.0[i] > 700.0, "{} {}", x.0[i], e.0[i]);
                assert!((a.0[i] * x.0[i] / x.0[i].atan() - 1.0).abs() < 1e-15, "{} {}", x.0[i], a.0[i]);
            }
        }
    }

    #[test]
    fn exp_and_arc_tangent_agree_with_libm_at_every_level() {
        dispatch(Level::Portable, BelowZero);
        dispatch(level(), BelowZero);
    }

    #[test]
    fn tanh_and_sine_agree_with_libm_at_every_level() {
        dispatch(Level::Portable, Odd);
        dispatch(level(), Odd);
    }
}
