//! Any vehicle whose contacts saturate and touch at most: linear rows, contacts and laws as accelerations in one rate.
//!
//! The same forces as those of the general path in another order, made ready for one part of the lanes: every factor
//! side by side with the next, divided by its mass; the springs that hold a wheelset itself joined with its gravitation;
//! what the track alone does is summed once per row of the input table.
use crate::effects::port::{self, Port};
use crate::numeric::sparse_rows::COLUMNS;
use crate::rate::Rate;
use crate::simd::{Part, Place, STATES};
use crate::wheel_rail::coefficients::Contact;
use crate::wheel_rail::contact::{AtSpeed, Displacement, Motion, under};
use std::marker::PhantomData;

/// A part of the lanes of a group, with or without laws at the contacts, in a structure; in one that is known saturations act
/// in full.
pub struct FusedVehicle<'a, P, const LAWS: bool, S> {
    /// Degrees of freedom, states.
    pub(super) size: (usize, usize),
    pub(super) track: Packed<P, Table>,
    pub(super) wheel_rows: Packed<P, State>,
    /// Of all else, and the deflections of the stops: these go to unused entries of dx.
    pub(super) body_rows: Packed<P, State>,
    pub(super) wheelsets: Vec<Wheels<P>>,
    /// One per wheelset; those that are alike share one: less to keep in the first cache.
    pub(super) contacts: Vec<(Contact<P>, AtSpeed<P>)>,
    pub(super) stops: Vec<Stop<'a, P>>,
    pub(super) ports: Vec<Port<'a, P>>,
    /// Share of the speed, and its inverse.
    pub(super) scales: [P; 2],
    pub(super) speed: f64,
    /// The sums of `track` at this row of the table.
    pub(super) prepared: [P; STATES],
    pub(super) prepared_at: usize,
    pub(super) structure: PhantomData<S>,
}

/// A wheelset in its suspension.
pub(super) struct Wheels<P> {
    /// y, psi, y', psi'
    pub(super) places: [Place<P>; 4],
    pub(super) contact: usize,
    /// Its acceleration per y' by dampers.
    pub(super) damping: P,
    /// First of the columns of its track.
    pub(super) column: usize,
    /// At the row of the table where `prepared` is: y_w + r phi_w, and what the slopes of the track add to t_y.
    pub(super) line: P,
    pub(super) slopes: P,
}

/// A stop whose deflection is an entry of dx. Contact is rare: only then it acts.
pub(super) struct Stop<'a, P> {
    pub(super) gap: P,
    pub(super) port: Port<'a, P>,
}

impl<P: Part, const LAWS: bool, S: Structure> FusedVehicle<'_, P, LAWS, S> {
    #[inline(always)]
    fn prepare_row(&mut self, index: usize, row: &[f64]) {
        if row[1] != self.speed {
            self.set_speed(row[1]);
        }
        self.prepared_at = index;
        S::track(&self.track, row, &mut self.prepared);
        for wheels in &mut self.wheelsets {
            let (contact, _) = &self.contacts[wheels.contact];
            let track = under(row, wheels.column);
            (wheels.line, wheels.slopes) = (contact.line(&track), contact.by_slopes(&track));
        }
    }

    #[inline(always)]
    fn set_speed(&mut self, speed: f64) {
        self.speed = speed;
        self.track.set_speed(speed);
        let [share, inv_share] = self.scales;
        let (v, per_v) = (P::splat(speed) * share, P::splat(1.0 / speed) * inv_share);
        for (contact, at_speed) in &mut self.contacts {
            *at_speed = contact.at_speed(v, per_v);
        }
    }

    /// Add the contact forces of a wheelset to its suspension.
    #[inline(always)]
    fn touch(&self, wheels: &Wheels<P>, x: &[P; STATES], dx: &mut [P; STATES]) {
        let Wheels { places: [y, psi, vy, vpsi], contact, damping, line, slopes, .. } = wheels;
        let (contact, at_speed) = &self.contacts[*contact];
        let motion = Motion { y: y.of(x) - *line, psi: psi.of(x), vy: vy.of(x), vpsi: vpsi.of(x) };
        let slip = contact.slip::<true>(at_speed, &Displacement::linear(motion.y), &motion, *slopes);
        let factors = match S::SIZE {
            Some(_) => contact.factors::<LAWS, true, true>(&slip),
            None => contact.factors::<LAWS, false, true>(&slip),
        };
        let given = [damping.mul_add(motion.vy, vy.of(dx)), vpsi.of(dx)];
        let [a_y, a_psi] = contact.touch::<LAWS, true>(at_speed, &motion, &slip, factors, given);
        vy.put(dx, a_y);
        vpsi.put(dx, a_psi);
    }
}

impl<P: Part, const LAWS: bool, S: Structure> Rate<P> for FusedVehicle<'_, P, LAWS, S> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        S::SIZE.unwrap_or(self.size)
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        if index != self.prepared_at {
            self.prepare_row(index, row);
        }
        S::wheelsets(&self.wheel_rows, x, &self.prepared, dx);
        for wheels in &self.wheelsets {
            self.touch(wheels, x, dx);
        }
        // a contact is a long chain: these rows fill the time that its square roots take
        S::bodies(&self.body_rows, x, &self.prepared, dx);
        for (i, stop) in self.stops.iter_mut().enumerate() {
            if dx[i % STATES].abs().any_from(stop.gap) {
                port::act(std::slice::from_mut(&mut stop.port), index, row, x, dx);
            }
        }
        port::act(&mut self.ports, index, row, x, dx);
    }
}

/// Rows over the places of a [`State`] or a [`Table`] in blocks: what a place holds is loaded once for all rows of a block
/// that read it, a factor once for all that have it. Terms are summed one by one in the order of their columns: a zero term
/// changes no digit, whichever other vehicle needs it.
#[derive(Clone, Debug)]
pub struct Packed<P, V> {
    /// Block after block in steps of two terms: a factor per term and row, an offset per term and time (see [`Places`]).
    pub(super) factors: Vec<P>,
    pub(super) offsets: Vec<u32>,
    pub(super) quads: Vec<Head<P, 2, 2>>,
    pub(super) twins: Vec<Head<P, 2, 1>>,
    pub(super) likes: Vec<Head<P, 1, 2>>,
    pub(super) singles: Vec<Head<P, 1, 1>>,
    /// Factors that the speed multiplies: which, and the factor at 1 m/s.
    pub(super) moved: Vec<(usize, P)>,
    /// Places that hold the opposite of others: of which, and where.
    pub(super) opposites: Vec<[Place<P>; 2]>,
    pub(super) over: PhantomData<V>,
}

/// A block of N rows, M times: where its sums go and where they start from, and its number of steps.
#[derive(Clone, Debug)]
pub(super) struct Head<P, const N: usize, const M: usize> {
    pub(super) to: [[Place<P>; N]; M],
    pub(super) from: [[Place<P>; N]; M],
    pub(super) steps: usize,
}

impl<P: Part, V: Places<P>> Packed<P, V> {
    /// to[..] = from[..] (or none) + the sum of every row.
    #[inline(always)]
    pub fn sums(&self, values: &V::Values, from: Option<&[P; STATES]>, to: &mut [P; STATES]) {
        let mut next = (self.factors.as_ptr(), self.offsets.as_ptr());
        next = Self::blocks(&self.quads, next, values, from, to);
        next = Self::blocks(&self.twins, next, values, from, to);
        next = Self::blocks(&self.likes, next, values, from, to);
        Self::blocks(&self.singles, next, values, from, to);
    }

    // adapters and closures of the library need not be compiled for the level: plain loops over indices are
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn blocks<const N: usize, const M: usize>(
        heads: &[Head<P, N, M>],
        (mut factors, mut offsets): (*const P, *const u32),
        values: &V::Values,
        from: Option<&[P; STATES]>,
        to: &mut [P; STATES],
    ) -> (*const P, *const u32) {
        for head in heads {
            let mut sums = [[P::zero(); N]; M];
            if let Some(from) = from {
                for m in 0..M {
                    for n in 0..N {
                        sums[m][n] = head.from[m][n].of(from);
                    }
                }
            }
            for _ in 0..head.steps {
                for k in 0..2 {
                    for m in 0..M {
                        // SAFETY: the heads count as many steps of two terms as there are
                        let value = V::at(values, unsafe { *offsets.add(k * M + m) });
                        for n in 0..N {
                            sums[m][n] = unsafe { *factors.add(k * N + n) }.mul_add(value, sums[m][n]);
                        }
                    }
                }
                (factors, offsets) = unsafe { (factors.add(2 * N), offsets.add(2 * M)) };
            }
            for m in 0..M {
                for n in 0..N {
                    head.to[m][n].put(to, sums[m][n]);
                }
            }
        }
        (factors, offsets)
    }
}

impl<P: Part> Packed<P, State> {
    /// Puts opposites behind the states, before [`Packed::sums`].
    #[inline(always)]
    pub fn oppose(&self, x: &mut [P; STATES]) {
        for [of, to] in &self.opposites {
            to.put(x, -of.of(x));
        }
    }
}

impl<P: Part> Packed<P, Table> {
    /// At this speed [m/s], before [`Packed::sums`].
    #[inline(always)]
    pub fn set_speed(&mut self, speed: f64) {
        let speed = P::splat(speed);
        for (i, factor) in &self.moved {
            self.factors[*i] = speed * *factor;
        }
    }
}

/// Kind of vector that the columns of a row refer to.
pub trait Places<P> {
    type Values: ?Sized;
    /// Bytes from one place to the next.
    const SIZE: usize;
    /// Number of columns.
    const COUNT: usize;
    /// Index of the value that a column times the speed refers to.
    fn still(place: usize) -> usize {
        place
    }
    /// So many bytes behind the first place.
    fn at(values: &Self::Values, offset: u32) -> P;
}

/// Positions and velocities.
#[derive(Clone, Debug)]
pub struct State;

impl<P: Part> Places<P> for State {
    type Values = [P; STATES];
    const SIZE: usize = size_of::<P>();
    const COUNT: usize = STATES;

    #[inline(always)]
    fn at(values: &[P; STATES], offset: u32) -> P {
        // SAFETY: `Packed::new` refuses places from COUNT on; a mask would be vectorised, at a cost
        debug_assert!((offset as usize) < size_of_val(values));
        unsafe { *values.as_ptr().byte_add(offset as usize) }
    }
}

/// A row of the input table. Products with the speed are `COLUMNS` places further on at most: their factors carry
/// the speed, see [`Packed::set_speed`].
#[derive(Clone, Debug)]
pub struct Table;

impl<P: Part> Places<P> for Table {
    type Values = [f64];
    const SIZE: usize = size_of::<f64>();
    const COUNT: usize = 2 * COLUMNS;

    fn still(place: usize) -> usize {
        place % COLUMNS
    }

    #[inline(always)]
    fn at(row: &[f64], offset: u32) -> P {
        P::splat(row[offset as usize / size_of::<f64>()])
    }
}

/// A structure as it is known when the step loop is compiled: sums of the rows of the wheelsets, of all else, of the track.
pub trait Structure {
    /// Degrees of freedom and states, where they are known.
    const SIZE: Option<(usize, usize)> = None;

    #[inline(always)]
    fn wheelsets<P: Part>(rows: &Packed<P, State>, x: &[P; STATES], from: &[P; STATES], to: &mut [P; STATES]) {
        rows.sums(x, Some(from), to);
    }

    /// x has room behind its states.
    #[inline(always)]
    fn bodies<P: Part>(rows: &Packed<P, State>, x: &mut [P; STATES], from: &[P; STATES], to: &mut [P; STATES]) {
        rows.oppose(x);
        rows.sums(x, Some(from), to);
    }

    #[inline(always)]
    fn track<P: Part>(rows: &Packed<P, Table>, row: &[f64], to: &mut [P; STATES]) {
        rows.sums(row, None, to);
    }
}

/// Any structure: loops over its rows.
pub struct AnyStructure;

impl Structure for AnyStructure {}
