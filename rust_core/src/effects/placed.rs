//! Laws at ports and contacts with the numbers of sixteen vehicles, and made ready for a part of the lanes.
use super::Law;
use super::port::{Port, Terms, UNROLLED};
use crate::simd::{Lanes, Part, Place, STATES};

/// A law at one port with the numbers of sixteen vehicles.
#[derive(Clone, Debug)]
pub struct PlacedLaw {
    pub law: Law,
    pub row: Vec<(usize, Lanes)>,
    /// The row through which the force returns: that of the motion, except where the motion is prescribed.
    pub reaction: Vec<(usize, Lanes)>,
    /// That row over the masses: what the force accelerates.
    pub pushes: Vec<(usize, Lanes)>,
    /// Terms of the input table in z; the speed times the next column is their rate.
    pub inputs: Vec<(usize, Lanes)>,
    pub lanes: Vec<Lanes>,
    pub alpha: Lanes,
    pub state: usize,
    pub has_state: bool,
    /// All amounts are one: nothing to blend.
    pub acts_fully: bool,
    pub looks_at_speed: bool,
}

impl PlacedLaw {
    /// At a port, or at a contact that needs no row; its own states begin at `state`.
    pub fn new(
        law: Law,
        row: Vec<(usize, Lanes)>,
        inputs: Vec<(usize, Lanes)>,
        lanes: Vec<Lanes>,
        alpha: Lanes,
        state: usize,
    ) -> Self {
        PlacedLaw {
            law,
            reaction: row.clone(),
            row,
            pushes: Vec::new(),
            inputs,
            lanes,
            alpha,
            state,
            has_state: law.record().states > 0,
            acts_fully: alpha.0.iter().all(|a| *a == 1.0),
            looks_at_speed: law.looks_at_speed(),
        }
    }

    /// The first N of its prepared numbers.
    pub fn first<const N: usize>(&self) -> &[Lanes; N] {
        self.lanes.first_chunk().expect("counted")
    }
}

impl<P: Part> Terms<P> {
    /// A share of a row, whose places begin at `from`, in the lanes from `at` on.
    fn new(row: &[(usize, Lanes)], from: usize, at: usize, share: P) -> Self {
        let mut all: Vec<_> = row.iter().map(|(i, a)| (Place::new(from + i), P::load(a, at) * share)).collect();
        let more = if all.len() > UNROLLED { all.split_off(UNROLLED) } else { Vec::new() };
        let mut first = std::array::from_fn(|i| (Place::new(STATES - 1 - i), P::zero()));
        first[..all.len()].copy_from_slice(&all);
        Terms { first, more }
    }
}

impl<'a, P: Part> Port<'a, P> {
    /// The lanes from `at` on, in a vehicle of n degrees of freedom. The force goes to `pushes`: its reactions, or these
    /// over the masses.
    #[inline(always)]
    pub fn new(law: &'a PlacedLaw, pushes: &[(usize, Lanes)], n: usize, speed_scale: &Lanes, at: usize) -> Self {
        Port {
            law,
            action: law.law.action(),
            at,
            motion: Terms::new(&law.row, 0, at, P::splat(1.0)),
            speed: Terms::new(&law.row, n, at, P::splat(1.0)),
            inputs: law.inputs.iter().map(|(i, a)| (*i, P::load(a, at))).collect(),
            pushes: Terms::new(pushes, n, at, P::load(&law.alpha, at)),
            speed_scale: P::load(speed_scale, at),
            own: Place::new(if law.has_state { law.state } else { 0 }),
            known: (usize::MAX, P::zero()),
        }
    }
}
