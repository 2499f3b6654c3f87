//! Parts of one register: AVX2 and AVX-512.
use super::{LANES, Lanes, MAGIC, Part, Work};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

macro_rules! intel {
    ($name:ident, $features:tt, $reg:ty, $width:expr, $set1:ident, $load:ident, $store:ident, $add:ident, $sub:ident, $mul:ident,
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
            fn out_of_line(work: impl Work) {
                #[inline(never)]
                #[target_feature(enable = $features)]
                unsafe fn apart(work: impl Work) {
                    work.run();
                }
                unsafe { apart(work) }
            }
            #[inline(always)]
            fn splat(x: f64) -> Self {
                $name(unsafe { $set1(x) })
            }
            #[inline(always)]
            fn load(from: &Lanes, at: usize) -> Self {
                // the mask bounds the index: no check, no branch
                $name(unsafe { $load(from.0.as_ptr().add(at & (LANES - $width))) })
            }
            #[inline(always)]
            fn store(self, to: &mut Lanes, at: usize) {
                unsafe { $store(to.0.as_mut_ptr().add(at & (LANES - $width)), self.0) }
            }
            #[inline(always)]
            fn read(from: &[f64]) -> Self {
                let from = &from[..$width];
                $name(unsafe { $load(from.as_ptr()) })
            }
            #[inline(always)]
            fn write(self, to: &mut [f64]) {
                let to = &mut to[..$width];
                unsafe { $store(to.as_mut_ptr(), self.0) }
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
    "avx2,fma",
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
    "avx512f,avx512dq,avx2,fma",
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
