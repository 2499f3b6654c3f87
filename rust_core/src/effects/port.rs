//! Laws at ports, made ready for a part of the lanes.
use super::PlacedLaw;
use super::effect::Effect;
use super::law::{Force, Numbers};
use crate::simd::{Part, Place, STATES, Work};
use std::marker::PhantomData;

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
    /// [`act_by`] its law.
    pub(super) action: Action<P>,
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

/// Of a port, at a row of the input table with this index: from x to dx.
pub(super) type Action<P> = for<'a> fn(&mut Port<'a, P>, usize, &[f64], &[P; STATES], &mut [P; STATES]);

impl PlacedLaw {
    #[inline(always)]
    pub fn numbers(&self, at: usize) -> Numbers<'_> {
        Numbers { lanes: &self.lanes, at }
    }
}

/// Adds the forces of laws at ports, or the accelerations by them, to dx at a row of the input table with this index.
#[inline(always)]
pub fn act<P: Part>(ports: &mut [Port<'_, P>], index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
    for port in ports {
        (port.action)(port, index, row, x, dx);
    }
}

/// The action of a law, compiled on its own: constants of other laws are not its own.
pub(super) fn act_by<P: Part, F: Force + Effect>(
    port: &mut Port<'_, P>,
    index: usize,
    row: &[f64],
    x: &[P; STATES],
    dx: &mut [P; STATES],
) {
    P::out_of_line(Acting { port, index, row, x, dx, law: PhantomData::<F> });
}

struct Acting<'l, 'a, P, F> {
    port: &'l mut Port<'a, P>,
    index: usize,
    row: &'l [f64],
    x: &'l [P; STATES],
    dx: &'l mut [P; STATES],
    law: PhantomData<F>,
}

impl<P: Part, F: Force + Effect> Work for Acting<'_, '_, P, F> {
    #[inline(always)]
    fn run(self) {
        let Acting { port, index, row, x, dx, .. } = self;
        if F::OF_DISTANCE && port.known.0 == index {
            return port.pushes.add(port.known.1, dx);
        }
        let none = P::zero();
        let mut z = port.motion.sum(x, none);
        let mut v = if F::SPEED { port.speed.sum(x, none) } else { none };
        for (column, a) in &port.inputs {
            z = a.mul_add(P::splat(row[*column]), z);
            if F::SPEED {
                let speed = P::splat(row[1]) * port.speed_scale;
                v = a.mul_add(speed * P::splat(row[column + 1]), v);
            }
        }
        let mut own = none;
        let force = F::force(port.law.numbers(port.at), z, v, row[0], port.own.of(x), &mut own);
        if F::RECORD.states > 0 {
            port.own.put(dx, own);
        }
        if F::OF_DISTANCE {
            port.known = (index, force);
        }
        port.pushes.add(force, dx);
    }
}
