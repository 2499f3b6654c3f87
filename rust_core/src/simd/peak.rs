//! Peak arithmetic of a core: chains of operations that never leave its registers.
use crate::simd::{Job, Part, dispatch, level};
use std::hint::black_box;

/// Independent chains: enough to cover the latency of one, few enough for the registers of AVX2.
const CHAIN_COUNT: usize = 12;

/// Operation that the chains consist of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Links {
    Fused,
    Roots,
}

struct Chains {
    links: Links,
    rounds: usize,
}

impl Job for Chains {
    type Output = u64;

    #[inline(always)]
    fn run<P: Part>(self) -> u64 {
        let one = P::Single::splat(black_box(1.0));
        let half = P::Single::splat(black_box(0.5));
        // values that differ, or the compiler would make one chain of all; they stay between 1 and 2
        let mut chains = [one; CHAIN_COUNT];
        for (i, chain) in chains.iter_mut().enumerate() {
            *chain = P::Single::splat(black_box(1.0 + i as f64 / CHAIN_COUNT as f64));
        }
        match self.links {
            Links::Fused => {
                for _ in 0..self.rounds {
                    for chain in &mut chains {
                        *chain = chain.mul_add(half, half);
                    }
                }
            }
            Links::Roots => {
                for _ in 0..self.rounds {
                    for chain in &mut chains {
                        *chain = (*chain + one).sqrt();
                    }
                }
            }
        }
        let mut sum = one;
        for chain in chains {
            sum = sum + chain;
        }
        black_box(sum);
        (self.rounds * CHAIN_COUNT * P::Single::WIDTH) as u64
    }
}

/// Run chains of so many rounds at the level in use; returns how many links they had in all lanes together.
pub fn chains(links: Links, rounds: usize) -> u64 {
    dispatch(level(), Chains { links, rounds })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, Portable};

    #[test]
    fn links_are_those_of_all_lanes() {
        let found = chains(Links::Fused, 100);
        assert!((1..=LANES as u64).any(|width| found == 100 * CHAIN_COUNT as u64 * width), "{found}");
        let portable = Chains { links: Links::Roots, rounds: 7 }.run::<Portable>();
        assert_eq!(portable, 7 * 12 * 4);
    }
}
