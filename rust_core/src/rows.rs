//! Sparse rows of sixteen vehicles: forces that are linear in the state and in the track.
use crate::lanes::{Lanes, Part};
use std::marker::PhantomData;

/// Columns of the input table; behind them stand those that the speed multiplies.
pub const COLUMNS: usize = 64;

/// Terms of one kind, row after row.
#[derive(Clone, Debug, Default)]
struct Terms {
    places: Vec<u32>,
    factors: Vec<Lanes>,
    /// Where each row ends.
    ends: Vec<usize>,
}

impl Terms {
    fn push(&mut self, terms: Vec<(usize, Lanes)>) {
        for (place, factor) in terms.into_iter().filter(|(_, factor)| !factor.is_zero()) {
            self.places.push(place as u32);
            self.factors.push(factor);
        }
        self.ends.push(self.places.len());
    }

    fn row(&self, row: usize) -> std::ops::Range<usize> {
        row.checked_sub(1).map_or(0, |before| self.ends[before])..self.ends[row]
    }

    fn of(&self, row: usize) -> impl Iterator<Item = (usize, &Lanes)> {
        let range = self.row(row);
        self.places[range.clone()].iter().map(|i| *i as usize).zip(&self.factors[range])
    }

    /// start + the sum of a row.
    #[inline(always)]
    fn sum<P: Part>(&self, at: usize, row: usize, start: P, value: impl Fn(usize) -> P) -> P {
        let range = self.row(row);
        let mut sum = start;
        for (place, factor) in self.places[range.clone()].iter().zip(&self.factors[range]) {
            sum = P::load(factor, at).mul_add(value(*place as usize), sum);
        }
        sum
    }
}

/// Rows over the state, and over columns of the input table.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    state: Terms,
    inputs: Terms,
}

impl Rows {
    /// The terms of the next row: of the state, of columns, of columns that the speed multiplies (the lane's share of
    /// the speed in the factor). Those that are zero in every lane are left out.
    pub fn push(&mut self, state: Vec<(usize, Lanes)>, inputs: Vec<(usize, Lanes)>, rates: Vec<(usize, Lanes)>) {
        let moved = rates.into_iter().map(|(column, factor)| (column + COLUMNS, factor));
        self.state.push(state);
        self.inputs.push(inputs.into_iter().chain(moved).collect());
    }

    /// The terms of all rows over the state: row, place, factor.
    pub fn state(&self) -> impl Iterator<Item = (usize, usize, &Lanes)> {
        (0..self.state.ends.len()).flat_map(move |row| self.state.of(row).map(move |(i, factor)| (row, i, factor)))
    }

    /// The terms of one row over the state.
    pub fn state_of(&self, row: usize) -> impl Iterator<Item = (usize, &Lanes)> {
        self.state.of(row)
    }

    /// The terms of one row over the input table, as [`Table`] counts its places.
    pub fn inputs_of(&self, row: usize) -> impl Iterator<Item = (usize, &Lanes)> {
        self.inputs.of(row)
    }

    /// Does the track move anything but the wheelsets?
    pub fn is_driven(&self) -> bool {
        !self.inputs.places.is_empty()
    }

    /// forces[from ..] = the force of every row.
    #[inline(always)]
    pub fn forces<P: Part>(&self, at: usize, x: &[P; 64], table: &[f64], from: usize, forces: &mut [P; 64]) {
        let moving = |column: usize| moving(table, column);
        for row in 0..self.state.ends.len() {
            let mut force = self.state.sum(at, row, P::zero(), |i| x[i & 63]);
            if self.is_driven() {
                force = self.inputs.sum(at, row, force, |column| P::splat(moving(column)));
            }
            forces[(from + row) & 63] = force;
        }
    }
}

/// What stands in a column of the input table, or its product with the speed.
#[inline(always)]
fn moving(table: &[f64], column: usize) -> f64 {
    table[column % COLUMNS] * if column < COLUMNS { 1.0 } else { table[1] }
}

/// Rows for one part of the lanes, two by two where they read the same places: what a place holds is loaded once for both.
/// Every factor stands beside the next in memory. Terms are summed one by one in the order of their places: so one that is
/// zero moves no digit, whichever vehicle beside it needs it.
#[derive(Clone, Debug)]
pub struct Packed<P> {
    twins: Strips<P, 2>,
    singles: Strips<P, 1>,
}

/// Rows in groups of N over the same places.
#[derive(Clone, Debug)]
struct Strips<P, const N: usize> {
    heads: Vec<Head<P, N>>,
    /// Terms in steps of two: an offset each (see [`Places`]), a factor per row.
    places: Vec<[u32; 2]>,
    factors: Vec<[[P; N]; 2]>,
}

/// A group of rows: where the sums go and where they start from, and its number of steps.
#[derive(Clone, Debug)]
struct Head<P, const N: usize> {
    to: [Place<P>; N],
    from: [Place<P>; N],
    steps: u32,
}

/// A place of a state, ready to be read.
#[derive(Clone, Copy, Debug)]
pub struct Place<P>(u32, PhantomData<P>);

impl<P: Part> Place<P> {
    pub fn new(index: usize) -> Self {
        assert!(index < 64);
        Place((index * size_of::<P>()) as u32, PhantomData)
    }

    #[inline(always)]
    pub fn of(self, x: &[P; 64]) -> P {
        // SAFETY: a place is made below 64 alone; an index would have to be masked and shifted
        unsafe { *x.as_ptr().byte_add(self.0 as usize) }
    }

    #[inline(always)]
    pub fn put(self, x: &mut [P; 64], value: P) {
        // SAFETY: as above
        unsafe { *x.as_mut_ptr().byte_add(self.0 as usize) = value }
    }
}

impl<P: Part, const N: usize> Strips<P, N> {
    fn new(groups: &[[&Row<P>; N]], size: usize) -> Self {
        let mut strips = Strips { heads: Vec::new(), places: Vec::new(), factors: Vec::new() };
        for rows in groups {
            let places = together(rows);
            let factor = |row: &Row<P>, place: usize| -> P {
                row.1.iter().find(|(other, _)| *other == place).map_or(P::zero(), |(_, factor)| *factor)
            };
            for step in places.chunks(2) {
                let last = step[step.len() - 1];
                strips.places.push([step[0], last].map(|place| (place * size) as u32));
                let factors = |k: usize, place: usize| {
                    rows.map(|row| if k < step.len() { factor(row, place) } else { P::zero() })
                };
                strips.factors.push([factors(0, step[0]), factors(1, last)]);
            }
            let [to, from] = [0, 1].map(|end| rows.map(|row| Place::new(row.0[end])));
            strips.heads.push(Head { to, from, steps: places.len().div_ceil(2) as u32 });
        }
        strips
    }

    // adapters and closures of the library need not be compiled for the level: plain loops over indices are
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn sums(&self, values: &impl Places<P>, from: Option<&[P; 64]>, to: &mut [P; 64]) {
        let (mut places, mut factors) = (self.places.as_ptr(), self.factors.as_ptr());
        for head in &self.heads {
            let mut sums = [P::zero(); N];
            if let Some(from) = from {
                for n in 0..N {
                    sums[n] = head.from[n].of(from);
                }
            }
            for _ in 0..head.steps {
                // SAFETY: the heads count as many steps as there are
                let (places_of, factors_of) = unsafe { (&*places, &*factors) };
                for k in 0..2 {
                    let value = values.at(places_of[k]);
                    for n in 0..N {
                        sums[n] = factors_of[k][n].mul_add(value, sums[n]);
                    }
                }
                (places, factors) = unsafe { (places.add(1), factors.add(1)) };
            }
            for n in 0..N {
                head.to[n].put(to, sums[n]);
            }
        }
    }
}

/// The places that any of these rows reads, in order.
fn together<P>(rows: &[&Row<P>]) -> Vec<usize> {
    let mut places: Vec<_> = rows.iter().flat_map(|row| row.1.iter().map(|(place, _)| *place)).collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// A row: where its sum goes and where it starts from, its terms.
pub type Row<P> = ([usize; 2], Vec<(usize, P)>);

/// What the places of a row hold.
pub trait Places<P> {
    /// Bytes from one place to the next.
    const SIZE: usize;
    /// How many places there are.
    const COUNT: usize;
    /// So many bytes behind the first place.
    fn at(&self, offset: u32) -> P;
}

/// Positions and velocities.
pub struct State<'a, P>(pub &'a [P; 64]);

impl<P: Part> Places<P> for State<'_, P> {
    const SIZE: usize = size_of::<P>();
    const COUNT: usize = 64;

    #[inline(always)]
    fn at(&self, offset: u32) -> P {
        // SAFETY: `Packed::new` refuses places from 64 on; a mask would be vectorised, at a cost
        debug_assert!((offset as usize) < size_of_val(self.0));
        unsafe { *self.0.as_ptr().byte_add(offset as usize) }
    }
}

/// A row of the input table, and behind it its products with the speed.
pub struct Table([f64; 2 * COLUMNS]);

impl Default for Table {
    fn default() -> Self {
        Table([0.0; 2 * COLUMNS])
    }
}

impl Table {
    /// The place of a column times the speed.
    pub fn moved(column: usize) -> usize {
        column + COLUMNS
    }

    #[inline(always)]
    pub fn read(&mut self, row: &[f64]) {
        let (plain, moving) = self.0.split_at_mut(COLUMNS);
        for i in 0..row.len().min(COLUMNS) {
            (plain[i], moving[i]) = (row[i], row[1] * row[i]);
        }
    }
}

impl<P: Part> Places<P> for Table {
    const SIZE: usize = size_of::<f64>();
    const COUNT: usize = 2 * COLUMNS;

    #[inline(always)]
    fn at(&self, offset: u32) -> P {
        // SAFETY: as for the state, from twice COLUMNS on
        debug_assert!((offset as usize) < size_of_val(&self.0));
        P::splat(unsafe { *self.0.as_ptr().byte_add(offset as usize) })
    }
}

impl<P: Part> Packed<P> {
    /// From rows over the places of a [`State`] or a [`Table`], which they are summed over later. Panics for other places.
    pub fn new<V: Places<P>>(rows: &[Row<P>]) -> Self {
        assert!(rows.iter().flat_map(|row| &row.1).all(|(place, _)| *place < V::COUNT), "a place that is not there");
        let places = |rows: &[&Row<P>]| together(rows).len();
        let mut left: Vec<_> = rows.iter().collect();
        let mut twins = Vec::new();
        // a row apart loads a place and a factor per term, two together load a place and two factors; to begin and to end
        // a sum costs as much as two terms
        let cost = |rows: &[&Row<P>]| (1 + rows.len()) * (places(rows) + 2);
        let spared = |a: &Row<P>, b: &Row<P>| (cost(&[a]) + cost(&[b])) as isize - cost(&[a, b]) as isize;
        while let Some((_, i, j)) = (0..left.len())
            .flat_map(|j| (0..j).map(move |i| (i, j)))
            .map(|(i, j)| (spared(left[i], left[j]), i, j))
            .filter(|(spared, ..)| *spared > 0)
            .max_by_key(|(spared, i, j)| (*spared, usize::MAX - i, usize::MAX - j))
        {
            let (second, first) = (left.remove(j), left.remove(i));
            twins.push([first, second]);
        }
        let singles: Vec<_> = left.into_iter().map(|row| [row]).collect();
        Packed { twins: Strips::new(&twins, V::SIZE), singles: Strips::new(&singles, V::SIZE) }
    }

    /// to[..] = from[..] (or none) + the sum of every row.
    #[inline(always)]
    pub fn sums(&self, values: &impl Places<P>, from: Option<&[P; 64]>, to: &mut [P; 64]) {
        self.twins.sums(values, from, to);
        self.singles.sums(values, from, to);
    }
}
