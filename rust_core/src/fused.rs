//! Any vehicle whose contacts saturate and touch at most: linear rows, contacts and laws as accelerations in one rate.
//!
//! The same forces as those of the general path in another order, made ready for one part of the lanes: every factor
//! side by side with the next, divided by its mass; what the track alone does is summed once per row of the input table.
use crate::contact::{AtSpeed, Contact, Slip};
use crate::effects::{Law, PlacedLaw};
use crate::lanes::{Lanes, Part};
use crate::rows::{Packed, State, Table};
use crate::vehicle::{Group, STATES};
use crate::wheelset::Motion;

/// A part of the lanes of a group.
pub struct FusedVehicle<'a, P> {
    group: &'a Group,
    at: usize,
    /// Of the input table: accelerations of every degree of freedom; behind them per wheelset y_w + r phi_w and what is
    /// taken off t_y.
    track: Packed<P>,
    table: Table,
    /// Accelerations by the state.
    rows: Packed<P>,
    wheelsets: Vec<Wheels<P>>,
    /// Those that differ: less to keep in the first cache.
    contacts: Vec<(Contact<P>, AtSpeed<P>)>,
    stops: Vec<Stop<P>>,
    ports: Vec<Port<'a, P>>,
    speed: f64,
    /// The sums of `track` at this row of the table.
    laid: [P; STATES],
    laid_at: usize,
}

/// A wheelset: where its y and psi stand, how it creeps at this instant.
struct Wheels<P> {
    y: usize,
    psi: usize,
    /// Which of the contacts.
    contact: usize,
    slip: Slip<P>,
    factors: [P; 2],
}

/// A law at its port: its row, and the same over the masses.
struct Port<'a, P> {
    law: &'a PlacedLaw,
    terms: Vec<(usize, P, P)>,
    alpha: P,
}

/// A stop: the row of its deflection, and what its force does. It is rarely met: only then anything is pushed.
struct Stop<P> {
    row: Vec<(usize, P)>,
    gap: P,
    stiffness: P,
    pushes: Vec<(usize, P)>,
}

/// Numbers of a wheelset among the laid ones.
const PER_WHEELSET: usize = 2;

/// How many numbers are laid for so many degrees of freedom and wheelsets.
pub fn laid(dofs: usize, wheelsets: usize) -> usize {
    dofs + PER_WHEELSET * wheelsets
}

impl<'a, P: Part> FusedVehicle<'a, P> {
    /// Of a group that has these fused contacts.
    #[inline(always)]
    pub fn new(group: &'a Group, contacts: &[Contact<Lanes>], at: usize) -> Self {
        let n = group.dofs;
        let (mut rows, mut track, mut wheelsets, mut parts) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for row in 0..n {
            let per_mass = P::load(&group.inv_mass[row], at);
            let shared = |(i, a): (usize, &Lanes)| (i, P::load(a, at) * per_mass);
            rows.push(([n + row, row], telling(group.matrix.state_of(row)).map(shared).collect()));
            track.push(([row; 2], group.matrix.inputs_of(row).map(shared).collect::<Vec<_>>()));
        }
        for (i, (wheelset, contact)) in group.wheelsets.iter().zip(contacts).enumerate() {
            let which = contacts.iter().position(|other| other == contact).unwrap_or(i);
            let (contact, column, to) = (contact.part::<P>(at), wheelset.column, laid(n, i));
            track.push(([to; 2], vec![(column, P::splat(1.0)), (column + 2, contact.r)]));
            track.push(([to + 1; 2], vec![(column + 1, contact.across_line), (column + 3, contact.across_roll)]));
            track[wheelset.y].1.push((column + 2, contact.gravity));
            let (y, psi, slip) = (wheelset.y, wheelset.psi, Slip::none());
            wheelsets.push(Wheels { y, psi, contact: which, slip, factors: [P::zero(); 2] });
            let at_speed = contact.at_speed(P::zero(), P::zero());
            parts.push((contact, at_speed));
        }
        track.retain(|(_, terms)| !terms.is_empty());
        track.iter_mut().for_each(|(_, terms)| merge(terms));
        let mut vehicle = FusedVehicle {
            group,
            at,
            table: Table::new(&track),
            track: Packed::new(&track),
            rows: Packed::new(&rows),
            wheelsets,
            contacts: parts,
            stops: Vec::new(),
            ports: Vec::new(),
            speed: f64::NAN,
            laid: [P::zero(); STATES],
            laid_at: usize::MAX,
        };
        let part = |row: &[(usize, Lanes)]| row.iter().map(|(i, a)| (*i, P::load(a, at))).collect::<Vec<_>>();
        for law in &group.forces {
            if law.law == Law::BumpStop && law.inputs.is_empty() {
                let [gap, stiffness] = [0, 1].map(|k| P::load(&law.lanes[k], at));
                let stiffness = P::load(&law.alpha, at) * stiffness;
                vehicle.stops.push(Stop { row: part(&law.row), gap, stiffness, pushes: part(&law.pushes) });
                continue;
            }
            let term =
                |((i, a), (_, push)): (&(usize, Lanes), &(usize, Lanes))| (*i, P::load(a, at), P::load(push, at));
            let terms = law.row.iter().zip(&law.pushes).map(term).collect();
            vehicle.ports.push(Port { law, terms, alpha: P::load(&law.alpha, at) });
        }
        vehicle
    }

    #[inline(always)]
    fn lay(&mut self, index: usize, row: &[f64]) {
        self.laid_at = index;
        self.table.read(row);
        self.track.sums(&self.table, None, &mut self.laid);
        if row[1] != self.speed {
            self.speed = row[1];
            let v = P::splat(row[1]) * P::load(&self.group.speed_scale, self.at);
            let per_v = P::splat(1.0 / row[1]) * P::load(&self.group.inv_speed_scale, self.at);
            for (contact, at_speed) in &mut self.contacts {
                *at_speed = contact.at_speed(v, per_v);
            }
        }
    }

    /// dx[n ..] = accelerations and rates of own states at a row of the input table.
    #[inline(always)]
    pub fn rate<const LAWS: bool>(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        if index != self.laid_at {
            self.lay(index, row);
        }
        let n = self.group.dofs;
        // a contact is a long chain: all wheelsets go through it abreast, and rows fill the time that square roots take
        for (i, Wheels { y, psi, contact, slip, .. }) in self.wheelsets.iter_mut().enumerate() {
            let (contact, at_speed) = &self.contacts[*contact];
            let to = laid(n, i);
            let e = x[*y & 63] - self.laid[to & 63];
            let motion = Motion { y: e, psi: x[*psi & 63], vy: x[(n + *y) & 63], vpsi: x[(n + *psi) & 63] };
            *slip = contact.slip::<true>(at_speed, &motion, self.laid[(to + 1) & 63]);
        }
        for Wheels { slip, factors, .. } in &mut self.wheelsets {
            *factors = slip.factors::<LAWS, true>();
        }
        self.rows.sums(&State(x), Some(&self.laid), dx);
        for Wheels { y, psi, contact, slip, factors } in &self.wheelsets {
            let (contact, at_speed) = &self.contacts[*contact];
            let (iy, ipsi) = ((n + y) & 63, (n + psi) & 63);
            let touch = contact.touch::<LAWS, true>(slip, *factors, x[psi & 63], dx[iy], dx[ipsi]);
            [dx[iy], dx[ipsi]] = contact.creep::<true>(at_speed, touch, x[iy], x[ipsi]);
        }
        for stop in &self.stops {
            stop.act(n, x, dx);
        }
        for port in &self.ports {
            self.act(port, row, x, dx);
        }
    }

    /// As `Group::act`.
    #[inline(always)]
    fn act(&self, Port { law, terms, alpha }: &Port<'_, P>, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let n = self.group.dofs;
        let (mut z, mut v, mut own) = (P::zero(), P::zero(), P::zero());
        for (i, a, _) in terms {
            z = a.mul_add(x[i & 63], z);
        }
        if law.looks_at_speed {
            for (i, a, _) in terms {
                v = a.mul_add(x[(n + i) & 63], v);
            }
        }
        self.group.follow(law, self.at, row, &mut z, &mut v);
        let force = *alpha * law.law.force(law.numbers(self.at), z, v, row[0], x[law.state & 63], &mut own);
        if law.has_state {
            dx[law.state & 63] = own;
        }
        for (i, _, push) in terms {
            dx[(n + i) & 63] = push.mul_add(force, dx[(n + i) & 63]);
        }
    }
}

impl<P: Part> Stop<P> {
    #[inline(always)]
    fn act(&self, n: usize, x: &[P; STATES], dx: &mut [P; STATES]) {
        let mut z = P::zero();
        for (i, a) in &self.row {
            z = a.mul_add(x[i & 63], z);
        }
        if z.abs().any_from(self.gap) {
            let force = self.stiffness * (z - z.clamp(self.gap));
            for (i, push) in &self.pushes {
                dx[(n + i) & 63] = push.neg_mul_add(force, dx[(n + i) & 63]);
            }
        }
    }
}

/// The terms of a row that are more than what rounding leaves of equal and opposite springs.
fn telling<'a>(terms: impl Iterator<Item = (usize, &'a Lanes)>) -> impl Iterator<Item = (usize, &'a Lanes)> {
    let terms: Vec<_> = terms.collect();
    let size = |a: &Lanes| a.0.iter().fold(0.0, |m: f64, x| m.max(x.abs()));
    let least = f64::EPSILON * terms.iter().map(|(_, a)| size(a)).fold(0.0, f64::max);
    terms.into_iter().filter(move |(_, a)| size(a) > least)
}

/// Terms of one place made one.
fn merge<P: Part>(terms: &mut Vec<(usize, P)>) {
    let mut some: Vec<(usize, P)> = Vec::new();
    for (i, a) in terms.drain(..) {
        match some.iter_mut().find(|(j, _)| *j == i) {
            Some((_, sum)) => *sum = *sum + a,
            None => some.push((i, a)),
        }
    }
    *terms = some;
}
