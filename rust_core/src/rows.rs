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

/// Terms of a row that are summed at once.
const CHUNK: usize = 4;

/// Rows for one part of the lanes, cut into chunks of one length, every factor beside the next in memory: two short loops
/// whose branches can all be foreseen, and which stay in the cache of decoded instructions.
#[derive(Clone, Debug)]
pub struct Packed<P> {
    /// The first chunk of every row.
    first: Vec<Chunk<P>>,
    /// What is left of them, in turns, so that no sum waits for the one before.
    further: Vec<Chunk<P>>,
}

/// Some terms of a row; where their sum goes, and where the row starts from.
#[derive(Clone, Debug)]
struct Chunk<P> {
    factors: [P; CHUNK],
    places: [u8; CHUNK],
    to: u8,
    from: u8,
}

impl<P: Part> Chunk<P> {
    #[inline(always)]
    fn sum(&self, values: &impl Places<P>, start: P) -> P {
        let ([a, b, c, d], [x, y, z, w]) = (&self.factors, self.places);
        let one = a.mul_add(values.at(x), c.mul_add(values.at(z), start));
        // two sums side by side: fewer products wait for the one before
        one + b.mul_add(values.at(y), *d * values.at(w))
    }
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

/// A row of the input table, and behind it the products with the speed of those columns that are read so.
pub struct Table {
    values: [f64; 2 * COLUMNS],
    moved: Vec<usize>,
}

impl Table {
    /// For rows with these places.
    pub fn new<P>(rows: &[Row<P>]) -> Self {
        let places = rows.iter().flat_map(|(_, terms)| terms.iter().map(|(place, _)| *place));
        let mut moved: Vec<_> = places.filter_map(|place| place.checked_sub(COLUMNS)).collect();
        moved.sort_unstable();
        moved.dedup();
        Table { values: [0.0; 2 * COLUMNS], moved }
    }

    #[inline(always)]
    pub fn read(&mut self, row: &[f64]) {
        let (plain, moving) = self.values.split_at_mut(COLUMNS);
        plain[..row.len()].copy_from_slice(row);
        for column in &self.moved {
            moving[*column] = row[*column] * row[1];
        }
    }
}

impl<P: Part> Places<P> for Table {
    #[inline(always)]
    fn at(&self, place: u8) -> P {
        // SAFETY: as for the state, below 128
        debug_assert!((place as usize) < self.values.len());
        P::splat(unsafe { *self.values.get_unchecked(place as usize) })
    }
}

impl<P: Part> Packed<P> {
    /// From rows; no place is beyond those of [`State`] or [`Table`].
    pub fn new(rows: &[Row<P>]) -> Self {
        let chunk = |([to, from], terms): &Row<P>, k: usize| {
            let term = |i: usize| terms.get(CHUNK * k + i).copied().unwrap_or((0, P::zero()));
            let terms = [0, 1, 2, 3].map(term);
            let (places, factors) = (terms.map(|t| t.0 as u8), terms.map(|t| t.1));
            Chunk { factors, places, to: *to as u8, from: *from as u8 }
        };
        let chunks = |row: &Row<P>| row.1.len().div_ceil(CHUNK);
        let first = rows.iter().map(|row| chunk(row, 0)).collect();
        let turns = 1..rows.iter().map(chunks).max().unwrap_or(0);
        let still = |k: usize| rows.iter().filter(move |row| k < chunks(row)).map(move |row| chunk(row, k));
        Packed { first, further: turns.flat_map(still).collect() }
    }

    /// to[..] = from[..] (or none) + the sum of every row.
    #[inline(always)]
    pub fn sums(&self, values: &impl Places<P>, from: Option<&[P; 64]>, to: &mut [P; 64]) {
        for chunk in &self.first {
            let start = from.map_or(P::zero(), |from| from[chunk.from as usize & 63]);
            to[chunk.to as usize & 63] = chunk.sum(values, start);
        }
        for chunk in &self.further {
            let place = chunk.to as usize & 63;
            to[place] = to[place] + chunk.sum(values, P::zero());
        }
    }
}
