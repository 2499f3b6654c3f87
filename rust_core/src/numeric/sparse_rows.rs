//! Sparse rows of sixteen vehicles: forces that are linear in the state and in the track.
use crate::simd::{Lanes, Part};

/// Columns of the input table that the forms without index look-up can tell from those multiplied by the speed.
pub const COLUMNS: usize = 64;

/// Terms of one kind, row after row.
#[derive(Clone, Debug, Default)]
struct Terms {
    places: Vec<u32>,
    factors: Vec<Lanes>,
    /// End of each row.
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
    /// Columns that the speed multiplies.
    rates: Terms,
}

impl Rows {
    /// The terms of the next row: of the state, of columns, of columns that the speed multiplies (the lane's share of
    /// the speed in the factor). Those that are zero in every lane are left out.
    pub fn push(&mut self, state: Vec<(usize, Lanes)>, inputs: Vec<(usize, Lanes)>, rates: Vec<(usize, Lanes)>) {
        self.state.push(state);
        self.inputs.push(inputs);
        self.rates.push(rates);
    }

    /// The terms of all rows over the state: row, place, factor.
    pub fn state(&self) -> impl Iterator<Item = (usize, usize, &Lanes)> {
        (0..self.state.ends.len()).flat_map(move |row| self.state.of(row).map(move |(i, factor)| (row, i, factor)))
    }

    /// The terms of one row over the state.
    pub fn state_of(&self, row: usize) -> impl Iterator<Item = (usize, &Lanes)> {
        self.state.of(row)
    }

    /// The terms of one row over the input table: columns, and [`COLUMNS`] behind these those that the speed multiplies.
    pub fn inputs_of(&self, row: usize) -> impl Iterator<Item = (usize, &Lanes)> {
        self.columns_of(row).chain(self.rates.of(row).map(|(column, factor)| (column + COLUMNS, factor)))
    }

    /// The terms of one row over the input table without those that the speed multiplies.
    pub fn columns_of(&self, row: usize) -> impl Iterator<Item = (usize, &Lanes)> {
        self.inputs.of(row)
    }

    /// Does the track move anything but the wheelsets?
    pub fn is_driven(&self) -> bool {
        !self.inputs.places.is_empty() || !self.rates.places.is_empty()
    }

    /// forces[from ..] = the force of every row.
    #[inline(always)]
    pub fn forces<P: Part>(&self, at: usize, x: &[P; 64], table: &[f64], from: usize, forces: &mut [P; 64]) {
        let is_driven = self.is_driven();
        for row in 0..self.state.ends.len() {
            let mut force = self.state.sum(at, row, P::zero(), |i| x[i & 63]);
            if is_driven {
                force = self.inputs.sum(at, row, force, |column| P::splat(table[column]));
                force = self.rates.sum(at, row, force, |column| P::splat(table[column] * table[1]));
            }
            forces[(from + row) & 63] = force;
        }
    }
}
