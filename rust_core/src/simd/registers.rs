//! Parts of one register, AVX2 and AVX-512, and of two.
use super::{LANES, Lanes, MAGIC, Part, Work};
use std::arch::x86_64::*;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A method of as many parts as it has names.
macro_rules! by_instruction {
    ($name:ident: $($method:ident($($o:ident),*) = $instruction:ident)*) => {
        $(#[inline(always)]
        fn $method(self, $($o: Self),*) -> Self {
            $name(unsafe { $instruction(self.0, $($o.0),*) })
        })*
    };
}

macro_rules! register {
    ($name:ident($register:ty, $width:expr, $features:tt): $set1:ident, $load:ident, $store:ident;
     $($trait:ident $operator:ident $instruction:ident,)*; { $($methods:tt)* } { $($bits:item)* }) => {
        #[derive(Clone, Copy)]
        pub struct $name($register);

        // SAFETY of every block here: a value of this type exists only inside `dispatch`,
        // which has asked the processor for the instructions.
        $(impl $trait for $name {
            type Output = Self;
            by_instruction!($name: $operator(o) = $instruction);
        })*
        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                Self::splat(-0.0) - self
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
            fn round(self) -> Self {
                (self + Self::splat(MAGIC)) - Self::splat(MAGIC)
            }
            by_instruction!($name: $($methods)*);
            $($bits)*
        }
    };
}

register! {
    V3(__m256d, 4, "avx2,fma"): _mm256_set1_pd, _mm256_loadu_pd, _mm256_storeu_pd;
    Add add _mm256_add_pd, Sub sub _mm256_sub_pd, Mul mul _mm256_mul_pd, Div div _mm256_div_pd,;
    {
        mul_add(b, c) = _mm256_fmadd_pd
        neg_mul_add(b, c) = _mm256_fnmadd_pd
        min(o) = _mm256_min_pd
        max(o) = _mm256_max_pd
        sqrt() = _mm256_sqrt_pd
    }
    {
        #[inline(always)]
        fn abs(self) -> Self {
            V3(unsafe { _mm256_andnot_pd(_mm256_set1_pd(-0.0), self.0) })
        }
        #[inline(always)]
        fn copy_sign(self, s: Self) -> Self {
            V3(unsafe { _mm256_or_pd(self.abs().0, _mm256_and_pd(_mm256_set1_pd(-0.0), s.0)) })
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
    }
}

register! {
    V4(__m512d, 8, "avx512f,avx512dq,avx2,fma"): _mm512_set1_pd, _mm512_loadu_pd, _mm512_storeu_pd;
    Add add _mm512_add_pd, Sub sub _mm512_sub_pd, Mul mul _mm512_mul_pd, Div div _mm512_div_pd,;
    {
        mul_add(b, c) = _mm512_fmadd_pd
        neg_mul_add(b, c) = _mm512_fnmadd_pd
        min(o) = _mm512_min_pd
        max(o) = _mm512_max_pd
        sqrt() = _mm512_sqrt_pd
        abs() = _mm512_abs_pd
    }
    {
        #[inline(always)]
        fn copy_sign(self, s: Self) -> Self {
            V4(unsafe { _mm512_or_pd(self.abs().0, _mm512_and_pd(_mm512_set1_pd(-0.0), s.0)) })
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
    }
}

/// Two registers as one part: independent work to fill the latency of each other.
#[derive(Clone, Copy)]
pub struct Pair<P>(P, P);

/// Methods that do to each register what they do to both.
macro_rules! of_each {
    ($($method:ident($($o:ident),*))*) => {
        $(#[inline(always)]
        fn $method(self, $($o: Self),*) -> Self {
            Pair(self.0.$method($($o.0),*), self.1.$method($($o.1),*))
        })*
    };
}

macro_rules! pair_operators {
    ($($trait:ident $method:ident($($o:ident)?),)*) => {
        $(impl<P: Part> $trait for Pair<P> {
            type Output = Self;
            of_each!($method($($o)?));
        })*
    };
}
pair_operators!(Add add(o), Sub sub(o), Mul mul(o), Div div(o), Neg neg(),);

impl<P: Part<Single = P>> Part for Pair<P> {
    const WIDTH: usize = 2 * P::WIDTH;
    type Single = P;
    of_each!(mul_add(b, c) neg_mul_add(b, c) min(o) max(o) abs() sqrt() copy_sign(s) if_less(limit, yes, no) round() exp2_whole());
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
    fn any_from(self, limit: Self) -> bool {
        self.0.any_from(limit.0) | self.1.any_from(limit.1)
    }
}
