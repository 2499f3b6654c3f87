//! Laws at ports, made ready for a part of the lanes.
use super::PlacedLaw;
use crate::numeric::place::{Place, STATES};
use crate::simd::{Lanes, Part, Work};

/// Terms of a row that need no loop. Last places of a state, which are rarely used, fill it up with factors of zero.
const UNROLLED: usize = 3;

/// A row over places of a state.
struct Terms<P> {
    first: [(Place<P>, P); UNROLLED],
    more: Vec<(Place<P>, P)>,
}

impl<P: Part> Terms<P> {
    /// The lanes from `at` on of a row whose places begin at `from`.
    fn new(row: &[(usize, Lanes)], from: usize, at: usize) -> Self {
        let mut all: Vec<_> = row.iter().map(|(i, a)| (Place::new(from + i), P::load(a, at))).collect();
        let more = if all.len() > UNROLLED { all.split_off(UNROLLED) } else { Vec::new() };
        let mut first = std::array::from_fn(|i| (Place::new(STATES - 1 - i), P::zero()));
        first[..all.len()].copy_from_slice(&all);
        Terms { first, more }
    }

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
    law: &'a PlacedLaw,
    at: usize,
    motion: Terms<P>,
    speed: Terms<P>,
    /// Motion that the track imposes.
    inputs: Vec<(usize, P)>,
    pushes: Terms<P>,
    alpha: P,
    speed_scale: P,
    own: Place<P>,
    /// Of a law of distance alone: the row of the input table at which its force was computed, and this force.
    known: (usize, P),
}

impl<'a, P: Part> Port<'a, P> {
    /// The lanes from `at` on, in a vehicle of n degrees of freedom. The force goes to `pushes`: its reactions, or these
    /// over the masses.
    #[inline(always)]
    pub fn new(law: &'a PlacedLaw, pushes: &[(usize, Lanes)], n: usize, speed_scale: &Lanes, at: usize) -> Self {
        Port {
            law,
            at,
            motion: Terms::new(&law.row, 0, at),
            speed: Terms::new(&law.row, n, at),
            inputs: law.inputs.iter().map(|(i, a)| (*i, P::load(a, at))).collect(),
            pushes: Terms::new(pushes, n, at),
            alpha: P::load(&law.alpha, at),
            speed_scale: P::load(speed_scale, at),
            own: Place::new(if law.has_state { law.state } else { 0 }),
            known: (usize::MAX, P::zero()),
        }
    }

    /// Adds the force, or the accelerations by it, to dx at a row of the input table with this index.
    #[inline(always)]
    pub fn act(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        P::out_of_line(Acting { port: self, index, row, x, dx });
    }
}

struct Acting<'l, 'a, P> {
    port: &'l mut Port<'a, P>,
    index: usize,
    row: &'l [f64],
    x: &'l [P; STATES],
    dx: &'l mut [P; STATES],
}

impl<P: Part> Work for Acting<'_, '_, P> {
    #[inline(always)]
    fn run(self) {
        let Acting { port, index, row, x, dx } = self;
        let (law, none) = (port.law, P::zero());
        if law.is_of_distance && port.known.0 == index {
            return port.pushes.add(port.known.1, dx);
        }
        let mut z = port.motion.sum(x, none);
        let mut v = if law.looks_at_speed { port.speed.sum(x, none) } else { none };
        for (column, a) in &port.inputs {
            z = a.mul_add(P::splat(row[*column]), z);
            if law.looks_at_speed {
                let speed = P::splat(row[1]) * port.speed_scale;
                v = a.mul_add(speed * P::splat(row[column + 1]), v);
            }
        }
        let mut own = none;
        let force = port.alpha * law.law.force(law.numbers(port.at), z, v, row[0], port.own.of(x), &mut own);
        if law.has_state {
            port.own.put(dx, own);
        }
        if law.is_of_distance {
            port.known = (index, force);
        }
        port.pushes.add(force, dx);
    }
}
