//! Sparse rows of sixteen vehicles: forces that are linear in the state and in the track.
use crate::lanes::{Lanes, Part};

/// Columns of the input table; behind them stand those that the speed multiplies.
const COLUMNS: usize = 64;

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

    /// The terms of one row over the input table, as [`Packed::over_table`] counts its places.
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

/// Rows for one part of the lanes, their terms two by two and every factor beside the next in memory: one short loop,
/// which stays in the cache of decoded instructions.
#[derive(Clone, Debug)]
pub struct Packed<P> {
    places: Vec<[u8; 2]>,
    factors: Vec<[P; 2]>,
    /// Where the sum of each row goes, where it starts from, and how many pairs of terms it has.
    rows: Vec<[u8; 3]>,
}

/// A row: where its sum goes and where it starts from, its terms.
pub type Row<P> = ([usize; 2], Vec<(usize, P)>);

/// What the places of a row hold.
pub trait Places<P> {
    fn at(&self, place: u8) -> P;
}

/// Positions and velocities.
pub struct State<'a, P>(pub &'a [P; 64]);

impl<P: Part> Places<P> for State<'_, P> {
    #[inline(always)]
    fn at(&self, place: u8) -> P {
        // SAFETY: `Packed::new` is given places below 64 alone; a mask would be vectorised, at a cost
        debug_assert!((place as usize) < self.0.len());
        unsafe { *self.0.get_unchecked(place as usize) }
    }
}

/// A row of the input table, and behind it its products with the speed.
pub struct Table([f64; 2 * COLUMNS]);

impl Table {
    #[inline(always)]
    pub fn new(row: &[f64]) -> Self {
        let mut values = [0.0; 2 * COLUMNS];
        let (plain, moving) = values.split_at_mut(COLUMNS);
        for ((plain, moving), x) in plain.iter_mut().zip(moving).zip(row) {
            (*plain, *moving) = (*x, *x * row[1]);
        }
        Table(values)
    }
}

impl<P: Part> Places<P> for Table {
    #[inline(always)]
    fn at(&self, place: u8) -> P {
        // SAFETY: as for the state, below 128
        debug_assert!((place as usize) < self.0.len());
        P::splat(unsafe { *self.0.get_unchecked(place as usize) })
    }
}

impl<P: Part> Packed<P> {
    /// From rows: where the sum goes, where it starts from, its terms; no place is beyond those of [`State`] or [`Table`].
    pub fn new(mut rows: Vec<Row<P>>) -> Self {
        let mut packed = Packed { places: Vec::new(), factors: Vec::new(), rows: Vec::new() };
        // rows of one length after each other: their ends can be foreseen
        rows.sort_by_key(|(_, terms)| terms.len());
        for ([to, from], terms) in &rows {
            for two in terms.chunks(2) {
                let term = |k: usize| two.get(k).map_or((0, P::zero()), |(place, factor)| (*place as u8, *factor));
                let [a, b] = [term(0), term(1)];
                packed.places.push([a.0, b.0]);
                packed.factors.push([a.1, b.1]);
            }
            packed.rows.push([*to as u8, *from as u8, terms.len().div_ceil(2) as u8]);
        }
        packed
    }

    /// to[..] = from[..] (or none) + the sum of every row.
    #[inline(always)]
    pub fn sums(&self, values: &impl Places<P>, from: Option<&[P; 64]>, to: &mut [P; 64]) {
        let mut terms = self.places.iter().zip(&self.factors);
        for [end, start, pairs] in &self.rows {
            // two sums side by side: no product waits for the one before
            let (mut sum, mut other) = (P::zero(), P::zero());
            for _ in 0..*pairs {
                let Some((places, factors)) = terms.next() else { break };
                sum = factors[0].mul_add(values.at(places[0]), sum);
                other = factors[1].mul_add(values.at(places[1]), other);
            }
            sum = sum + other;
            to[*end as usize & 63] = from.map_or(sum, |from| from[*start as usize & 63] + sum);
        }
    }
}
