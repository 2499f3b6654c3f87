//! Sparse rows for one part of the lanes, made ready for the step loop: over the state, and over the input table.
use crate::numeric::place::{Place, STATES};
use crate::numeric::sparse_rows::COLUMNS;
use crate::rate::blocks::{Block, Blocks, Row};
use crate::simd::Part;
use std::marker::PhantomData;
use std::ops::Range;

/// Rows over the places of a [`State`] or a [`Table`] in blocks: what a place holds is loaded once for all rows of a block
/// that read it, a factor once for all that have it. Factors are contiguous in memory. Terms are summed one by
/// one in the order of their columns: a zero term changes no digit, whichever other vehicle needs it.
#[derive(Clone, Debug)]
pub struct Packed<P, V> {
    quads: Strips<P, 2, 2>,
    twins: Strips<P, 2, 1>,
    likes: Strips<P, 1, 2>,
    singles: Strips<P, 1, 1>,
    opposites: Vec<[Place<P>; 2]>,
    over: PhantomData<V>,
}

impl<P: Part, V: Places<P>> Packed<P, V> {
    /// The lanes of some rows from `at` on. Panics for places that are not there.
    pub fn new(rows: &[Row], at: usize) -> Self {
        Self::with(rows, at, 0..0)
    }

    fn with(rows: &[Row], at: usize, free: Range<usize>) -> Self {
        assert!(rows.iter().flat_map(|row| &row.1).all(|(place, _)| *place < V::COUNT), "a place that is not there");
        let Blocks { quads, twins, likes, singles, opposites } = Blocks::of(rows, free);
        Packed {
            quads: Strips::new::<V>(&quads, at),
            twins: Strips::new::<V>(&twins, at),
            likes: Strips::new::<V>(&likes, at),
            singles: Strips::new::<V>(&singles, at),
            opposites: opposites.iter().map(|ends| ends.map(Place::new)).collect(),
            over: PhantomData,
        }
    }

    /// to[..] = from[..] (or none) + the sum of every row.
    #[inline(always)]
    pub fn sums(&self, values: &V::Values, from: Option<&[P; STATES]>, to: &mut [P; STATES]) {
        self.quads.sums::<V>(values, from, to);
        self.twins.sums::<V>(values, from, to);
        self.likes.sums::<V>(values, from, to);
        self.singles.sums::<V>(values, from, to);
    }
}

impl<P: Part> Packed<P, State> {
    /// As `new`, with room for opposites in places behind the states.
    pub fn with_opposites(rows: &[Row], at: usize, behind: usize) -> Self {
        Self::with(rows, at, behind..STATES)
    }

    /// Puts opposites behind the states, before [`Packed::sums`].
    #[inline(always)]
    pub fn oppose(&self, x: &mut [P; STATES]) {
        for [of, to] in &self.opposites {
            to.put(x, -of.of(x));
        }
    }
}

impl<P: Part> Packed<P, Table> {
    /// At this speed [m/s], before [`Packed::sums`].
    #[inline(always)]
    pub fn set_speed(&mut self, speed: f64) {
        let speed = P::splat(speed);
        self.quads.set_speed(speed);
        self.twins.set_speed(speed);
        self.likes.set_speed(speed);
        self.singles.set_speed(speed);
    }
}

/// Blocks of N rows over M sets of places.
#[derive(Clone, Debug)]
struct Strips<P, const N: usize, const M: usize> {
    heads: Vec<Head<P, N, M>>,
    /// Steps of two terms: offsets (see [`Places`]), a factor per row.
    places: Vec<[[u32; M]; 2]>,
    factors: Vec<[[P; N]; 2]>,
    /// Those that the speed multiplies: step, term, factors at 1 m/s.
    moved: Vec<(usize, usize, [P; N])>,
}

/// A block: where its sums go and where they start from, and its number of steps.
#[derive(Clone, Debug)]
struct Head<P, const N: usize, const M: usize> {
    to: [[Place<P>; N]; M],
    from: [[Place<P>; N]; M],
    steps: u32,
}

impl<P: Part, const N: usize, const M: usize> Strips<P, N, M> {
    fn new<V: Places<P>>(blocks: &[Block<N, M>], at: usize) -> Self {
        let mut strips = Strips { heads: Vec::new(), places: Vec::new(), factors: Vec::new(), moved: Vec::new() };
        for block in blocks {
            let terms = block.factors.len();
            for first in (0..terms).step_by(2) {
                strips.push::<V>(block, first..(first + 2).min(terms), at);
            }
            let [to, from] = [0, 1].map(|end| block.ends.map(|rows| rows.map(|ends| Place::new(ends[end]))));
            strips.heads.push(Head { to, from, steps: terms.div_ceil(2) as u32 });
        }
        strips
    }

    /// A step of one term or two.
    fn push<V: Places<P>>(&mut self, block: &Block<N, M>, terms: Range<usize>, at: usize) {
        let (step, last) = (self.places.len(), terms.end - 1);
        let places = |term: usize| block.places.each_ref().map(|places| places[term]);
        self.places.push([terms.start, last].map(|term| places(term).map(|i| (V::still(i) * V::SIZE) as u32)));
        self.factors.push([[P::zero(); N]; 2]);
        for (k, term) in terms.enumerate() {
            let factors = block.factors[term].each_ref().map(|factor| P::load(factor, at));
            self.factors[step][k] = factors;
            if places(term).iter().any(|place| V::still(*place) != *place) {
                self.moved.push((step, k, factors));
            }
        }
    }

    #[inline(always)]
    fn set_speed(&mut self, speed: P) {
        for (step, k, factors) in &self.moved {
            for (to, factor) in self.factors[*step][*k].iter_mut().zip(factors) {
                *to = speed * *factor;
            }
        }
    }

    // adapters and closures of the library need not be compiled for the level: plain loops over indices are
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn sums<V: Places<P>>(&self, values: &V::Values, from: Option<&[P; STATES]>, to: &mut [P; STATES]) {
        let (mut places, mut factors) = (self.places.as_ptr(), self.factors.as_ptr());
        for head in &self.heads {
            let mut sums = [[P::zero(); N]; M];
            if let Some(from) = from {
                for m in 0..M {
                    for n in 0..N {
                        sums[m][n] = head.from[m][n].of(from);
                    }
                }
            }
            for _ in 0..head.steps {
                // SAFETY: the heads count as many steps as there are
                let (places_of, factors_of) = unsafe { (&*places, &*factors) };
                for k in 0..2 {
                    for m in 0..M {
                        let value = V::at(values, places_of[k][m]);
                        for n in 0..N {
                            sums[m][n] = factors_of[k][n].mul_add(value, sums[m][n]);
                        }
                    }
                }
                (places, factors) = unsafe { (places.add(1), factors.add(1)) };
            }
            for m in 0..M {
                for n in 0..N {
                    head.to[m][n].put(to, sums[m][n]);
                }
            }
        }
    }
}

/// Kind of vector that the columns of a row refer to.
pub trait Places<P> {
    type Values: ?Sized;
    /// Bytes from one place to the next.
    const SIZE: usize;
    /// Number of columns.
    const COUNT: usize;
    /// Index of the value that a column times the speed refers to.
    fn still(place: usize) -> usize {
        place
    }
    /// So many bytes behind the first place.
    fn at(values: &Self::Values, offset: u32) -> P;
}

/// Positions and velocities.
#[derive(Clone, Debug)]
pub struct State;

impl<P: Part> Places<P> for State {
    type Values = [P; STATES];
    const SIZE: usize = size_of::<P>();
    const COUNT: usize = STATES;

    #[inline(always)]
    fn at(values: &[P; STATES], offset: u32) -> P {
        // SAFETY: `Packed::with` refuses places from COUNT on; a mask would be vectorised, at a cost
        debug_assert!((offset as usize) < size_of_val(values));
        unsafe { *values.as_ptr().byte_add(offset as usize) }
    }
}

/// A row of the input table. Products with the speed are one row length further on at most: their factors carry
/// the speed, see [`Packed::set_speed`].
#[derive(Clone, Debug)]
pub struct Table;

impl Table {
    /// The place of a column times the speed.
    pub const fn moved(column: usize) -> usize {
        column + COLUMNS
    }
}

impl<P: Part> Places<P> for Table {
    type Values = [f64];
    const SIZE: usize = size_of::<f64>();
    const COUNT: usize = 2 * COLUMNS;

    fn still(place: usize) -> usize {
        place % COLUMNS
    }

    #[inline(always)]
    fn at(row: &[f64], offset: u32) -> P {
        P::splat(row[offset as usize / size_of::<f64>()])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{LANES, Lanes, Portable};

    /// Lanes that differ, times a factor.
    fn lanes(factor: f64) -> Lanes {
        Lanes::from_fn(|l| factor * (1.0 + l as f64 / 7.0))
    }

    fn summed(rows: &[Row], x: &mut [Portable; STATES]) -> [[f64; LANES]; STATES] {
        let packed = Packed::<Portable, State>::with_opposites(rows, 0, 40);
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
        let found = Blocks::of(&rows, 40..STATES);
        assert_eq!((found.quads.len(), found.likes.len(), found.opposites), (1, 1, vec![[1, 40]]));
    }
}
