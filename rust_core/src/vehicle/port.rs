//! A law at a port, made ready for a part of the lanes.
use crate::effects::PlacedLaw;
use crate::simd::{Lanes, Part};

/// A law, the row of its motion, and what its force pushes.
pub struct Port<'a, P> {
    law: &'a PlacedLaw,
    at: usize,
    row: Vec<(usize, P)>,
    /// Motion that the track imposes.
    inputs: Vec<(usize, P)>,
    pushes: Vec<(usize, P)>,
    alpha: P,
    speed_scale: P,
}

impl<'a, P: Part> Port<'a, P> {
    /// The lanes from `at` on. The force goes to `pushes`: its reactions, or these over the masses.
    #[inline(always)]
    pub fn new(law: &'a PlacedLaw, pushes: &[(usize, Lanes)], speed_scale: &Lanes, at: usize) -> Self {
        let part = |terms: &[(usize, Lanes)]| terms.iter().map(|(i, a)| (*i, P::load(a, at))).collect();
        let (row, inputs, pushes) = (part(&law.row), part(&law.inputs), part(pushes));
        Port { law, at, row, inputs, pushes, alpha: P::load(&law.alpha, at), speed_scale: P::load(speed_scale, at) }
    }

    /// Adds the force, or the accelerations by it, to dx[n ..].
    #[inline(always)]
    pub fn act(&self, n: usize, row: &[f64], x: &[P; 64], dx: &mut [P; 64]) {
        let (law, mut z, mut v, mut own) = (self.law, P::zero(), P::zero(), P::zero());
        for (i, a) in &self.row {
            z = a.mul_add(x[i & 63], z);
        }
        if law.looks_at_speed {
            for (i, a) in &self.row {
                v = a.mul_add(x[(n + i) & 63], v);
            }
        }
        for (column, a) in &self.inputs {
            z = a.mul_add(P::splat(row[*column]), z);
            if law.looks_at_speed {
                let speed = P::splat(row[1]) * self.speed_scale;
                v = a.mul_add(speed * P::splat(row[column + 1]), v);
            }
        }
        let force = self.alpha * law.law.force(law.numbers(self.at), z, v, row[0], x[law.state & 63], &mut own);
        if law.has_state {
            dx[law.state & 63] = own;
        }
        for (i, push) in &self.pushes {
            dx[(n + i) & 63] = push.mul_add(force, dx[(n + i) & 63]);
        }
    }
}
