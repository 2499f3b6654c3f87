//! Rows at columns that are known when compiled: products without index look-up.
use crate::numeric::place::STATES;
use crate::numeric::sparse_rows::COLUMNS;
use crate::rate::blocks::Row;
use crate::simd::{Lanes, Part};

/// A place of the state, or a column of the input table (see `packed::Table::moved`); below zero: the opposite of what
/// is there.
pub type Signed = isize;

/// Most terms that a row has.
const TERMS: usize = 14;

/// N rows of K terms, the same over several sets of places.
#[derive(Clone, Debug)]
pub struct UnrolledRows<P, const K: usize, const N: usize>(pub [[P; N]; K]);

impl<P: Part, const K: usize, const N: usize> UnrolledRows<P, K, N> {
    /// The lanes from `at` on. The terms at these places leave the rows that go to `to`; none where a row is not there, or
    /// where the rows of two sets differ.
    pub fn taken<const M: usize>(
        rows: &mut [Row],
        to: [[Signed; N]; M],
        places: &[[Signed; K]; M],
        at: usize,
    ) -> Option<Self> {
        const { assert!(K <= TERMS) };
        let mut factors = [[P::zero(); N]; K];
        for (k, factors) in factors.iter_mut().enumerate() {
            for (n, to_part) in factors.iter_mut().enumerate() {
                let [first, others @ ..] =
                    &(0..M).map(|m| factor(rows, to[m][n], places[m][k])).collect::<Vec<_>>()[..]
                else {
                    return None;
                };
                let first = first.filter(|first| others.iter().all(|other| *other == Some(*first)))?;
                *to_part = P::load(&first, at);
            }
        }
        Some(UnrolledRows(factors))
    }

    /// start + the sum of every row, term by term.
    #[inline(always)]
    pub fn sums<const M: usize>(
        &self,
        places: &[[Signed; K]; M],
        start: [[P; N]; M],
        values: &impl Values<P>,
    ) -> [[P; N]; M] {
        let mut sums = start;
        // one by one: the compiler would not unroll a loop of many terms
        macro_rules! terms {
            ($($k:literal)*) => {
                $(if $k < K {
                    let factors = self.0[$k % K];
                    for m in 0..M {
                        let place = places[m][$k % K];
                        let value = values.at(place.unsigned_abs() % COLUMNS);
                        for n in 0..N {
                            let (factor, sum) = (factors[n], sums[m][n]);
                            sums[m][n] =
                                if place < 0 { factor.neg_mul_add(value, sum) } else { factor.mul_add(value, sum) };
                        }
                    }
                })*
            };
        }
        terms!(0 1 2 3 4 5 6 7 8 9 10 11 12 13);
        sums
    }
}

/// The factor of a row at a place, which leaves the row: zero where it has none.
fn factor(rows: &mut [Row], to: Signed, place: Signed) -> Option<Lanes> {
    let (_, terms) = rows.iter_mut().find(|(ends, _)| ends[0] == to.unsigned_abs())?;
    let found = terms.iter().position(|(i, _)| *i == place.unsigned_abs());
    let factor = found.map_or(Lanes::ZERO, |i| terms.remove(i).1);
    Some(if place < 0 { Lanes(factor.0.map(|a| -a)) } else { factor })
}

/// Values at the columns.
pub trait Values<P> {
    fn at(&self, place: usize) -> P;
}

/// The state.
impl<P: Part> Values<P> for [P; STATES] {
    #[inline(always)]
    fn at(&self, place: usize) -> P {
        self[place]
    }
}

/// A row of the input table, as far as it is read.
impl<P: Part, const READ: usize> Values<P> for [f64; READ] {
    #[inline(always)]
    fn at(&self, place: usize) -> P {
        P::splat(self[place])
    }
}
