//! Sixteen numbers side by side: the only file that knows SIMD.
//!
//! A law is written once, generic over a [`Part`]; [`dispatch`] compiles it for each level of the machine.
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};
use std::sync::OnceLock;

/// Vehicles in one group.
pub const LANES: usize = 16;

/// One number per vehicle of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Lanes(pub [f64; LANES]);

impl Lanes {
    pub const ZERO: Lanes = Lanes([0.0; LANES]);

    pub fn splat(x: f64) -> Self {
        Lanes([x; LANES])
    }

    pub fn from_fn(f: impl FnMut(usize) -> f64) -> Self {
        Lanes(std::array::from_fn(f))
    }

    pub fn is_zero(&self) -> bool {
        self.0.iter().all(|x| *x == 0.0)
    }
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

    #[inline(always)]
    fn zero() -> Self {
        Self::splat(0.0)
    }

    #[inline(always)]
    fn clamp(self, limit: Self) -> Self {
        self.min(limit).max(-limit)
    }

    /// 1 / sqrt(self) for self > 0.
    #[inline(always)]
    fn rsqrt(self) -> Self {
        Self::splat(1.0) / self.sqrt()
    }

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

    /// atan(self)/self for self >= 0, 1 at 0: three times the half angle, then the series; relative error below 1e-14.
    #[inline(always)]
    fn atan_ratio(self) -> Self {
        let one = Self::splat(1.0);
        let (mut t, mut divisor) = (self, one);
        for _ in 0..3 {
            let d = one + t.mul_add(t, one).sqrt();
            t = t / d;
            divisor = divisor * d;
        }
        let t2 = t * t;
        let mut p = Self::splat(-1.0 / 23.0);
        for k in [21.0, -19.0, 17.0, -15.0, 13.0, -11.0, 9.0, -7.0, 5.0, -3.0, 1.0] {
            p = p.mul_add(t2, Self::splat(1.0 / k));
        }
        Self::splat(8.0) * p / divisor
    }

    /// Sine, absolute error below 1e-14 for abs(self) < 1e6.
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

/// Two to the 52 and a half: added to a number it leaves the whole part in the low bits.
const MAGIC: f64 = 6_755_399_441_055_744.0;

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

macro_rules! intel {
    ($name:ident, $reg:ty, $width:expr, $set1:ident, $load:ident, $store:ident, $add:ident, $sub:ident, $mul:ident,
     $div:ident, $fma:ident, $fnma:ident, $min:ident, $max:ident, $sqrt:ident) => {
        #[derive(Clone, Copy)]
        pub struct $name($reg);

        // SAFETY of every block below: a value of this type exists only inside `dispatch`,
        // which has asked the processor for the instructions.
        impl Add for $name {
            type Output = Self;
            #[inline(always)]
            fn add(self, o: Self) -> Self {
                $name(unsafe { $add(self.0, o.0) })
            }
        }
        impl Sub for $name {
            type Output = Self;
            #[inline(always)]
            fn sub(self, o: Self) -> Self {
                $name(unsafe { $sub(self.0, o.0) })
            }
        }
        impl Mul for $name {
            type Output = Self;
            #[inline(always)]
            fn mul(self, o: Self) -> Self {
                $name(unsafe { $mul(self.0, o.0) })
            }
        }
        impl Div for $name {
            type Output = Self;
            #[inline(always)]
            fn div(self, o: Self) -> Self {
                $name(unsafe { $div(self.0, o.0) })
            }
        }
        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                $name(unsafe { $sub($set1(-0.0), self.0) })
            }
        }

        impl Part for $name {
            const WIDTH: usize = $width;
            type Single = Self;
            #[inline(always)]
            fn splat(x: f64) -> Self {
                $name(unsafe { $set1(x) })
            }
            #[inline(always)]
            fn load(from: &Lanes, at: usize) -> Self {
                // the mask keeps the read inside: no check, no branch
                $name(unsafe { $load(from.0.as_ptr().add(at & (LANES - $width))) })
            }
            #[inline(always)]
            fn store(self, to: &mut Lanes, at: usize) {
                unsafe { $store(to.0.as_mut_ptr().add(at & (LANES - $width)), self.0) }
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                $name(unsafe { $fma(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn neg_mul_add(self, b: Self, c: Self) -> Self {
                $name(unsafe { $fnma(self.0, b.0, c.0) })
            }
            #[inline(always)]
            fn min(self, o: Self) -> Self {
                $name(unsafe { $min(self.0, o.0) })
            }
            #[inline(always)]
            fn max(self, o: Self) -> Self {
                $name(unsafe { $max(self.0, o.0) })
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                $name(unsafe { $sqrt(self.0) })
            }
            #[inline(always)]
            fn round(self) -> Self {
                (self + Self::splat(MAGIC)) - Self::splat(MAGIC)
            }
            intel_bits!($name);
        }
    };
}

macro_rules! intel_bits {
    (V3) => {
        #[inline(always)]
        fn abs(self) -> Self {
            V3(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
        }
        #[inline(always)]
        fn copy_sign(self, s: Self) -> Self {
            V3(unsafe {
                let sign = _mm256_set1_pd(-0.0);
                _mm256_or_pd(_mm256_andnot_pd(sign, self.0), _mm256_and_pd(sign, s.0))
            })
        }
        #[inline(always)]
        fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
            V3(unsafe { _mm256_blendv_pd(no.0, yes.0, _mm256_cmp_pd::<_CMP_LT_OQ>(self.0, limit.0)) })
        }
        #[inline(always)]
        fn any_from(self, limit: Self) -> bool {
            unsafe { _mm256_movemask_pd(_mm256_cmp_pd::<_CMP_GE_OQ>(self.0, limit.0)) != 0 }
        }
        #[inline(always)]
        fn exp2_whole(self) -> Self {
            let shifted = self + Self::splat(MAGIC + 1023.0);
            V3(unsafe { _mm256_castsi256_pd(_mm256_slli_epi64::<52>(_mm256_castpd_si256(shifted.0))) })
        }
    };
    (V4) => {
        #[inline(always)]
        fn abs(self) -> Self {
            V4(unsafe { _mm512_abs_pd(self.0) })
        }
        #[inline(always)]
        fn copy_sign(self, s: Self) -> Self {
            V4(unsafe {
                let sign = _mm512_castpd_si512(_mm512_set1_pd(-0.0));
                let (a, b) = (_mm512_castpd_si512(self.0), _mm512_castpd_si512(s.0));
                _mm512_castsi512_pd(_mm512_or_si512(_mm512_andnot_si512(sign, a), _mm512_and_si512(sign, b)))
            })
        }
        #[inline(always)]
        fn if_less(self, limit: Self, yes: Self, no: Self) -> Self {
            V4(unsafe { _mm512_mask_blend_pd(_mm512_cmp_pd_mask::<_CMP_LT_OQ>(self.0, limit.0), no.0, yes.0) })
        }
        #[inline(always)]
        fn any_from(self, limit: Self) -> bool {
            unsafe { _mm512_cmp_pd_mask::<_CMP_GE_OQ>(self.0, limit.0) != 0 }
        }
        #[inline(always)]
        fn exp2_whole(self) -> Self {
            let shifted = self + Self::splat(MAGIC + 1023.0);
            V4(unsafe { _mm512_castsi512_pd(_mm512_slli_epi64::<52>(_mm512_castpd_si512(shifted.0))) })
        }
    };
}

intel!(
    V3,
    __m256d,
    4,
    _mm256_set1_pd,
    _mm256_loadu_pd,
    _mm256_storeu_pd,
    _mm256_add_pd,
    _mm256_sub_pd,
    _mm256_mul_pd,
    _mm256_div_pd,
    _mm256_fmadd_pd,
    _mm256_fnmadd_pd,
    _mm256_min_pd,
    _mm256_max_pd,
    _mm256_sqrt_pd
);
intel!(
    V4,
    __m512d,
    8,
    _mm512_set1_pd,
    _mm512_loadu_pd,
    _mm512_storeu_pd,
    _mm512_add_pd,
    _mm512_sub_pd,
    _mm512_mul_pd,
    _mm512_div_pd,
    _mm512_fmadd_pd,
    _mm512_fnmadd_pd,
    _mm512_min_pd,
    _mm512_max_pd,
    _mm512_sqrt_pd
);

/// What the processor offers; digits may differ in the last place between levels, never within one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    Portable,
    V3,
    V4,
}

impl Level {
    pub fn name(self) -> &'static str {
        match self {
            Level::Portable => "portable",
            Level::V3 => "v3",
            Level::V4 => "v4",
        }
    }

    fn best() -> Self {
        if is_x86_feature_detected!("avx512f") && is_x86_feature_detected!("avx512dq") {
            Level::V4
        } else if is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma") {
            Level::V3
        } else {
            Level::Portable
        }
    }
}

/// The level in use: the best the processor has, or the one that RAILUI_SIMD forces (if it has that).
pub fn level() -> Level {
    static LEVEL: OnceLock<Level> = OnceLock::new();
    *LEVEL.get_or_init(|| {
        let best = Level::best();
        match std::env::var("RAILUI_SIMD").as_deref() {
            Ok("portable") => Level::Portable,
            Ok("v3") if best != Level::Portable => Level::V3,
            _ => best,
        }
    })
}

/// Work that is compiled once per level. `run` must be `#[inline(always)]`, and all it calls per step too.
pub trait Job {
    type Output;
    /// Is it compiled for machines without AVX2?
    const PORTABLE: bool = true;
    fn run<P: Part>(self) -> Self::Output;
}

#[target_feature(enable = "avx2,fma")]
unsafe fn on_v3<J: Job>(job: J) -> J::Output {
    job.run::<Pair<V3>>()
}

#[target_feature(enable = "avx512f,avx512dq,avx2,fma")]
unsafe fn on_v4<J: Job>(job: J) -> J::Output {
    job.run::<Pair<V4>>()
}

/// Run a job at the level given; a level the processor lacks is never handed out by [`level`].
pub fn dispatch<J: Job>(level: Level, job: J) -> J::Output {
    match level {
        Level::Portable if J::PORTABLE => job.run::<Portable>(),
        Level::Portable => unreachable!("a job that is not compiled for this machine"),
        // SAFETY: `level` has asked the processor
        Level::V3 => unsafe { on_v3(job) },
        Level::V4 => unsafe { on_v4(job) },
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Elementary;
    impl Job for Elementary {
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
                p.atan_ratio().store(&mut a, at);
            }
            for i in 0..LANES {
                assert!((e.0[i] / (-x.0[i]).exp() - 1.0).abs() < 1e-13 || x.0[i] > 700.0, "{} {}", x.0[i], e.0[i]);
                assert!((a.0[i] * x.0[i] / x.0[i].atan() - 1.0).abs() < 1e-14, "{} {}", x.0[i], a.0[i]);
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
        dispatch(Level::Portable, Elementary);
        dispatch(level(), Elementary);
    }
}
