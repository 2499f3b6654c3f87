//! Which instructions the machine has, and work compiled for each.
use super::Part;
use super::portable::Portable;
#[cfg(target_arch = "x86_64")]
use super::registers::{Pair, V3, V4};
use std::sync::OnceLock;

/// SIMD level of the processor; digits may differ in the last place between levels, not within one.
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

    /// The level at which so few lanes ride: four fill a register of AVX2, and half of one is no quicker than the whole.
    pub fn filled(self, lanes: usize) -> Self {
        if self == Level::V4 && lanes <= 4 { Level::V3 } else { self }
    }

    /// Lanes of one register.
    pub fn register(self) -> usize {
        match self {
            Level::Portable => Portable::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Level::V3 => V3::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Level::V4 => V4::WIDTH,
            #[cfg(not(target_arch = "x86_64"))]
            Level::V3 | Level::V4 => unreachable!("instructions of x86-64"),
        }
    }

    /// Lanes of its widest part.
    pub fn widest(self) -> usize {
        match self {
            Level::Portable => Portable::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Level::V3 => Pair::<V3>::WIDTH,
            #[cfg(target_arch = "x86_64")]
            Level::V4 => Pair::<V4>::WIDTH,
            #[cfg(not(target_arch = "x86_64"))]
            Level::V3 | Level::V4 => unreachable!("instructions of x86-64"),
        }
    }

    #[cfg(not(target_arch = "x86_64"))]
    fn best() -> Self {
        Level::Portable
    }

    #[cfg(target_arch = "x86_64")]
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

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma")]
unsafe fn on_v3<J: Job>(job: J) -> J::Output {
    job.run::<Pair<V3>>()
}

#[cfg(target_arch = "x86_64")]
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
        #[cfg(target_arch = "x86_64")]
        Level::V3 => unsafe { on_v3(job) },
        #[cfg(target_arch = "x86_64")]
        Level::V4 => unsafe { on_v4(job) },
        #[cfg(not(target_arch = "x86_64"))]
        Level::V3 | Level::V4 => unreachable!("instructions of x86-64"),
    }
}
