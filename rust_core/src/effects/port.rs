//! Laws at ports, made ready for a part of the lanes.
use super::PlacedLaw;
use super::law::Numbers;
use crate::simd::{Part, Work};
use crate::simd::{Place, STATES};

/// Terms of a row that need no loop. Last places of a state, which are rarely used, fill it up with factors of zero.
pub(super) const UNROLLED: usize = 3;

/// A row over places of a state.
pub(super) struct Terms<P> {
    pub(super) first: [(Place<P>, P); UNROLLED],
    pub(super) more: Vec<(Place<P>, P)>,
}

impl<P: Part> Terms<P> {
    #[inline(always)]
    fn sum(&self, x: &[P; STATES], start: P) -> P {
        let [(i, a), (j, b), (k, c)] = self.first;
        let mut sum = c.mul_add(k.of(x), b.mul_add(j.of(x), a.mul_add(i.of(x), start)));
        for (place, factor) in &self.more {
            sum = factor.mul_add(place.of(x), sum);
        }
        sum
    }

    /// Adds a multiple of the row.
    #[inline(always)]
    fn add(&self, force: P, to: &mut [P; STATES]) {
        for i in 0..UNROLLED {
            let (place, factor) = self.first[i];
            place.put(to, factor.mul_add(force, place.of(to)));
        }
        for (place, factor) in &self.more {
            place.put(to, factor.mul_add(force, place.of(to)));
        }
    }
}

/// A law at a port: the row of its motion, and what its force pushes.
pub struct Port<'a, P> {
    pub(super) law: &'a PlacedLaw,
    pub(super) at: usize,
    pub(super) motion: Terms<P>,
    pub(super) speed: Terms<P>,
    /// Motion that the track imposes.
    pub(super) inputs: Vec<(usize, P)>,
    /// Times the amount.
    pub(super) pushes: Terms<P>,
    pub(super) speed_scale: P,
    pub(super) own: Place<P>,
    /// Of a law of distance alone: the row of the input table at which its force was computed, and this force.
    pub(super) known: (usize, P),
}

impl PlacedLaw {
    #[inline(always)]
    pub fn numbers(&self, at: usize) -> Numbers<'_> {
        Numbers { lanes: &self.lanes, at }
    }
}

/// Adds the forces of laws at ports, or the accelerations by them, to dx at a row of the input table with this index.
#[inline(always)]
pub fn act<P: Part>(ports: &mut [Port<'_, P>], index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
    if !ports.is_empty() {
        P::out_of_line(Acting { ports, index, row, x, dx });
    }
}

struct Acting<'l, 'a, P> {
    ports: &'l mut [Port<'a, P>],
    index: usize,
    row: &'l [f64],
    x: &'l [P; STATES],
    dx: &'l mut [P; STATES],
}

impl<P: Part> Work for Acting<'_, '_, P> {
    #[inline(always)]
    fn run(self) {
        let Acting { ports, index, row, x, dx } = self;
        for port in ports {
            port.act(index, row, x, dx);
        }
    }
}

impl<P: Part> Port<'_, P> {
    #[inline(always)]
    fn act(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let (law, none) = (self.law, P::zero());
        if law.is_of_distance && self.known.0 == index {
            return self.pushes.add(self.known.1, dx);
        }
        let mut z = self.motion.sum(x, none);
        let mut v = if law.looks_at_speed { self.speed.sum(x, none) } else { none };
        for (column, a) in &self.inputs {
            z = a.mul_add(P::splat(row[*column]), z);
            if law.looks_at_speed {
                let speed = P::splat(row[1]) * self.speed_scale;
                v = a.mul_add(speed * P::splat(row[column + 1]), v);
            }
        }
        let mut own = none;
        let force = law.law.force(law.numbers(self.at), z, v, row[0], self.own.of(x), &mut own);
        if law.has_state {
            self.own.put(dx, own);
        }
        if law.is_of_distance {
            self.known = (index, force);
        }
        self.pushes.add(force, dx);
    }
}
