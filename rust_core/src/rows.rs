//! Sparse rows of sixteen vehicles: forces that are linear in the state and in the track.
use crate::lanes::{Lanes, Part};

/// Terms of one kind: what they multiply and the numbers, row after row.
#[derive(Clone, Debug, Default)]
struct Terms {
    places: Vec<u32>,
    factors: Vec<Lanes>,
    /// Where each row ends.
    ends: Vec<u32>,
}

impl Terms {
    fn push(&mut self, row: Vec<(usize, Lanes)>) {
        for (place, factor) in row.into_iter().filter(|(_, factor)| !factor.is_zero()) {
            self.places.push(place as u32);
            self.factors.push(factor);
        }
        self.ends.push(self.places.len() as u32);
    }

    fn count(&self) -> usize {
        self.places.len()
    }

    /// start + the sum of one row over values by place; two sums side by side, for the latency of an addition.
    #[inline(always)]
    fn sum<P: Part>(&self, at: usize, row: usize, start: P, value: impl Fn(usize) -> P) -> P {
        let from = if row == 0 { 0 } else { self.ends[row - 1] as usize };
        let to = self.ends[row] as usize;
        let (places, factors) = (&self.places[from..to], &self.factors[from..to]);
        let (mut even, mut odd) = (start, P::zero());
        let mut pairs = places.chunks_exact(2).zip(factors.chunks_exact(2));
        for (i, a) in &mut pairs {
            even = P::load(&a[0], at).mul_add(value(i[0] as usize), even);
            odd = P::load(&a[1], at).mul_add(value(i[1] as usize), odd);
        }
        if places.len() % 2 == 1 {
            let last = places.len() - 1;
            even = P::load(&factors[last], at).mul_add(value(places[last] as usize), even);
        }
        even + odd
    }
}

/// Rows over the state, over columns of the input table, and over columns that the speed multiplies.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    state: Terms,
    inputs: Terms,
    rates: Terms,
}

impl Rows {
    /// The terms of the next row; those that are zero in every lane are left out.
    pub fn push(&mut self, state: Vec<(usize, Lanes)>, inputs: Vec<(usize, Lanes)>, rates: Vec<(usize, Lanes)>) {
        self.state.push(state);
        self.inputs.push(inputs);
        self.rates.push(rates);
    }

    /// Does the track move anything but the wheelsets?
    pub fn is_driven(&self) -> bool {
        self.inputs.count() + self.rates.count() > 0
    }

    /// The force of one row; the lane's share of the speed stands in its rates.
    #[inline(always)]
    pub fn force<P: Part>(&self, at: usize, row: usize, x: &[P; 64], table: &[f64]) -> P {
        let force = self.state.sum(at, row, P::zero(), |i| x[i & 63]);
        if !self.is_driven() {
            return force;
        }
        let force = self.inputs.sum(at, row, force, |column| P::splat(table[column]));
        self.rates.sum(at, row, force, |column| P::splat(table[1] * table[column]))
    }
}
