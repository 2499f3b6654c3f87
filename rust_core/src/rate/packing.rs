//! Rows of a plan made ready for one part of the lanes.
use crate::rate::fused::{Head, Packed, Places};
use crate::rate::plan::{Block, Plan};
use crate::simd::{Part, Place};
use std::marker::PhantomData;

impl<P: Part, const N: usize, const M: usize> Head<P, N, M> {
    fn of(blocks: &[Block]) -> Vec<Self> {
        let fits = |block: &&Block| (block.rows, block.times()) == (N, M);
        let ends = |block: &Block, end: usize| {
            std::array::from_fn(|m| std::array::from_fn(|n| Place::new(block.ends[m * N + n][end])))
        };
        let steps = |block: &Block| (block.places.len() / M).div_ceil(2);
        let head = |block| Head { to: ends(block, 0), from: ends(block, 1), steps: steps(block) };
        blocks.iter().filter(fits).map(head).collect()
    }
}

impl<P: Part, V: Places<P>> Packed<P, V> {
    /// The lanes of a plan from `at` on; opposites are held in places from `behind` on. Panics for places that are not there.
    pub fn new(plan: &Plan, behind: usize, at: usize) -> Self {
        let Plan { blocks, factors } = plan;
        let (mut offsets, mut moved, mut opposites) = (Vec::new(), Vec::new(), Vec::<isize>::new());
        let mut first = 0;
        for block in &blocks[..] {
            for (term, places) in block.places.chunks_exact(block.times()).enumerate() {
                for place in places {
                    let seen = opposites.iter().position(|other| other == place).unwrap_or(opposites.len());
                    if *place < 0 && seen == opposites.len() {
                        opposites.push(*place);
                    }
                    let index = if *place < 0 { behind + seen } else { *place as usize };
                    assert!(index < V::COUNT, "a place that is not there");
                    offsets.push((V::still(index) * V::SIZE) as u32);
                    if V::still(index) != index {
                        let rows = first + term * block.rows;
                        moved.extend((rows..rows + block.rows).map(|i| (i, P::load(&factors[i], at))));
                    }
                }
            }
            let terms = block.places.len() / block.times();
            first += terms.next_multiple_of(2) * block.rows;
            if !terms.is_multiple_of(2) {
                offsets.extend_from_within(offsets.len() - block.times()..);
            }
        }
        let factors = factors.iter().map(|factor| P::load(factor, at)).collect();
        let opposites = (behind..).zip(opposites).map(|(to, of)| [Place::new(!of as usize), Place::new(to)]).collect();
        let (quads, twins, likes, singles) = (Head::of(blocks), Head::of(blocks), Head::of(blocks), Head::of(blocks));
        Packed { factors, offsets, quads, twins, likes, singles, moved, opposites, over: PhantomData }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rate::fused::State;
    use crate::rate::plan::Row;
    use crate::simd::STATES;
    use crate::simd::{LANES, Lanes, Portable};

    /// Lanes that differ, times a factor.
    fn lanes(factor: f64) -> Lanes {
        Lanes::from_fn(|l| factor * (1.0 + l as f64 / 7.0))
    }

    fn summed(rows: &[Row], x: &mut [Portable; STATES]) -> [[f64; LANES]; STATES] {
        let packed = Packed::<Portable, State>::new(&Plan::of(rows, STATES - 40), 40, 0);
        let mut sums = [Portable::zero(); STATES];
        packed.oppose(x);
        packed.sums(x, None, &mut sums);
        sums.map(|sum| {
            let mut all = Lanes::ZERO;
            sum.store(&mut all, 0);
            all.0
        })
    }

    #[test]
    fn rows_that_are_alike_or_opposite_at_a_place_have_the_digits_that_each_has_alone() {
        let bogie = |side: f64, first: usize| {
            let body = [(0, lanes(0.3)), (1, lanes(side * 9.5))];
            let lateral = [&body[..], &[(first, lanes(-1.7)), (first + 1, lanes(0.9))]].concat();
            let rolling =
                [&body[..], &[(first, lanes(0.4)), (first + 1, lanes(-3.1)), (first + 2, lanes(0.1))]].concat();
            [([first, 0], lateral), ([first + 1, 0], rolling), ([first + 2, 0], vec![(first + 2, lanes(5.0))])]
        };
        let rows = [bogie(1.0, 3), bogie(-1.0, 6)].concat();
        let mut x = std::array::from_fn(|i| Portable::splat((1.3 * i as f64).sin()));
        let together = summed(&rows, &mut x);
        for row in &rows {
            let place = row.0[0];
            assert_eq!(summed(std::slice::from_ref(row), &mut x)[place], together[place], "{place}");
        }
        let blocks = Plan::of(&rows, STATES - 40).blocks;
        let shapes: Vec<_> = blocks.iter().map(|block| (block.rows, block.times())).collect();
        assert_eq!(shapes, [(2, 2), (1, 2)]);
        assert!(blocks[0].places.contains(&!1));
    }
}
