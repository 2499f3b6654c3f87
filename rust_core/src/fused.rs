//! Any vehicle whose contacts saturate and touch at most: linear rows, contacts and laws as accelerations in one rate.
//!
//! The same forces as those of the general path in another order, made ready for one part of the lanes: every factor
//! side by side with the next, divided by its mass; the springs that hold a wheelset itself joined with its gravitation;
//! what the track alone does is summed once per row of the input table.
use crate::contact::{AtSpeed, Contact};
use crate::effects::{Law, PlacedLaw};
use crate::lanes::{LANES, Lanes, Part};
use crate::rows::{Packed, Place, Row, State, Table};
use crate::vehicle::{Group, STATES};
use crate::wheelset::Motion;

/// A part of the lanes of a group.
pub struct FusedVehicle<'a, P> {
    group: &'a Group,
    at: usize,
    /// Accelerations by the input table of every degree of freedom, but for what a wheelset's own track does to its y.
    track: Packed<P>,
    table: Table,
    /// Accelerations by the state: of the wheelsets; of all else, and where none stands in dx, deflections of the stops.
    wheel_rows: Packed<P>,
    rows: Packed<P>,
    wheelsets: Vec<Wheels<P>>,
    /// Those that differ: less to keep in the first cache.
    contacts: Vec<(Contact<P>, AtSpeed<P>)>,
    stops: Vec<Stop<'a, P>>,
    ports: Vec<Port<'a, P>>,
    speed: f64,
    /// The sums of `track` at this row of the table.
    laid: [P; STATES],
    laid_at: usize,
}

/// A wheelset in its suspension.
struct Wheels<P> {
    /// y, psi, y', psi'
    places: [Place<P>; 4],
    contact: usize,
    /// Its acceleration per y' by dampers.
    damping: P,
    /// First of the columns y_w, dy_w/ds, phi_w, dphi_w/ds, and its acceleration by each, the speed times the slopes.
    column: usize,
    by_track: [P; 4],
    /// At the row of the table where `laid` is: y_w + r phi_w, what is taken off t_y, the acceleration by the track.
    line: P,
    off: P,
    push: P,
}

impl<P: Part> Wheels<P> {
    /// At these places; its own damping, and what the track does to its y, leave `row` and `track`, those of its y.
    /// `pull`: what its springs take off its acceleration per y.
    #[inline(always)]
    fn new(
        places: [usize; 4],
        column: usize,
        which: usize,
        (contact, pull): (&Contact<P>, P),
        row: &mut Vec<(usize, Lanes)>,
        track: &mut Vec<(usize, Lanes)>,
        at: usize,
    ) -> Self {
        let own = [column, Table::moved(column + 1), column + 2, Table::moved(column + 3)];
        let [y_w, dy_w, phi_w, dphi_w] = own.map(|place| P::load(&taken(track, place), at));
        // gravitation, and the springs were it to stand on the line
        let by_track = [y_w - pull, dy_w, phi_w + pull.neg_mul_add(contact.r, contact.gravity), dphi_w];
        let damping = P::load(&taken(row, places[2]), at);
        let none = P::zero();
        let places = places.map(Place::new);
        Wheels { places, contact: which, damping, column, by_track, line: none, off: none, push: none }
    }
}

/// A law at its port: its row, and the same over the masses.
struct Port<'a, P> {
    law: &'a PlacedLaw,
    terms: Vec<(usize, P, P)>,
    alpha: P,
}

/// A stop whose deflection stands in dx at its own number, and what its force accelerates. It is rarely met: only then
/// anything is pushed.
struct Stop<'a, P> {
    law: &'a PlacedLaw,
    gap: P,
    alpha: P,
    pushes: Vec<(usize, P)>,
}

/// The place of `laid` where nothing is laid.
const NOWHERE: usize = STATES - 1;

impl<'a, P: Part> FusedVehicle<'a, P> {
    /// Of a group that has these fused contacts.
    #[inline(always)]
    pub fn new(group: &'a Group, contacts: &[Contact<Lanes>], at: usize) -> Self {
        let n = group.dofs;
        let (mut rows, mut track) = (Vec::new(), Vec::new());
        for row in 0..n {
            let per_mass = |(i, a): (usize, &Lanes)| (i, times(a, &group.inv_mass[row]));
            rows.push(telling(group.matrix.state_of(row).map(per_mass)));
            track.push(group.matrix.inputs_of(row).map(per_mass).collect::<Vec<_>>());
        }
        // what holds a wheelset itself goes with its contact
        let mut held = Vec::new();
        for (wheelset, contact) in group.wheelsets.iter().zip(contacts) {
            let [lateral, yaw] = [wheelset.y, wheelset.psi].map(|dof| minus(&taken(&mut rows[dof], dof)));
            held.push((contact.clone().held(&lateral, &yaw), lateral));
        }
        let (mut wheelsets, mut parts) = (Vec::new(), Vec::new());
        for (i, (wheelset, (contact, lateral))) in group.wheelsets.iter().zip(&held).enumerate() {
            let which = held.iter().position(|(other, _)| other == contact).unwrap_or(i);
            let (part, places) = (contact.part(at), [wheelset.y, wheelset.psi, n + wheelset.y, n + wheelset.psi]);
            let (row, track) = (&mut rows[wheelset.y], &mut track[wheelset.y]);
            wheelsets.push(Wheels::new(places, wheelset.column, which, (&part, P::load(lateral, at)), row, track, at));
            let at_speed = part.at_speed(P::zero(), P::zero());
            parts.push((part, at_speed));
        }
        let laid = track.iter().enumerate().filter(|(_, row)| !row.is_empty());
        let track: Vec<_> = laid.map(|(i, row)| packed([i, i], row, at)).collect();
        let rows = rows.iter().enumerate().map(|(i, row)| packed([n + i, i], row, at));
        let of_wheelset = |([_, i], _): &Row<P>| group.wheelsets.iter().any(|w| w.y == *i || w.psi == *i);
        let (wheel_rows, mut rows): (Vec<_>, Vec<_>) = rows.partition(of_wheelset);
        let (stops, ports) = Self::laws(group, at, &mut rows);
        FusedVehicle {
            group,
            at,
            table: Table::default(),
            track: Packed::new::<Table>(&track),
            wheel_rows: Packed::new::<State<'_, P>>(&wheel_rows),
            rows: Packed::new::<State<'_, P>>(&rows),
            wheelsets,
            contacts: parts,
            stops,
            ports,
            speed: f64::NAN,
            laid: [P::zero(); STATES],
            laid_at: usize::MAX,
        }
    }

    /// The laws at the suspensions; the rows of the stops' deflections go to `rows`.
    #[inline(always)]
    fn laws(group: &'a Group, at: usize, rows: &mut Vec<Row<P>>) -> (Vec<Stop<'a, P>>, Vec<Port<'a, P>>) {
        let part = |a: &Lanes| P::load(a, at);
        let (mut stops, mut ports) = (Vec::new(), Vec::new());
        for law in &group.forces {
            let alpha = part(&law.alpha);
            if law.law == Law::BumpStop && law.inputs.is_empty() && stops.len() < group.dofs {
                rows.push(packed([stops.len(), NOWHERE], &law.row, at));
                let pushes = law.pushes.iter().map(|(i, a)| (*i, part(a))).collect();
                stops.push(Stop { law, gap: part(&law.lanes[0]), alpha, pushes });
                continue;
            }
            let term = |((i, a), (_, push)): (&(usize, Lanes), &(usize, Lanes))| (*i, part(a), part(push));
            let terms = law.row.iter().zip(&law.pushes).map(term).collect();
            ports.push(Port { law, terms, alpha });
        }
        (stops, ports)
    }

    #[inline(always)]
    fn lay(&mut self, index: usize, row: &[f64]) {
        self.laid_at = index;
        self.table.read(row);
        self.track.sums(&self.table, None, &mut self.laid);
        for wheels in &mut self.wheelsets {
            let (contact, _) = &self.contacts[wheels.contact];
            let track = &row[wheels.column..wheels.column + 4];
            let (y, dy, phi, dphi) = (P::splat(track[0]), P::splat(track[1]), P::splat(track[2]), P::splat(track[3]));
            let (moved, rolled) = (P::splat(row[1] * track[1]), P::splat(row[1] * track[3]));
            let [by_y, by_dy, by_phi, by_dphi] = wheels.by_track;
            wheels.line = contact.r.mul_add(phi, y);
            wheels.off = contact.across_line.mul_add(dy, contact.across_roll * dphi);
            wheels.push = by_phi.mul_add(phi, by_y * y) + by_dphi.mul_add(rolled, by_dy * moved);
        }
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
        self.wheel_rows.sums(&State(x), Some(&self.laid), dx);
        for Wheels { places, contact, damping, line, off, push, .. } in &self.wheelsets {
            let (contact, at_speed) = &self.contacts[*contact];
            let [y, psi, vy, vpsi] = [places[0].of(x), places[1].of(x), places[2].of(x), places[3].of(x)];
            let slip = contact.slip::<true>(at_speed, &Motion { y: y - *line, psi, vy, vpsi }, *off);
            let factors = slip.factors::<LAWS, true>();
            let [_, _, to_y, to_psi] = places;
            let a_y = damping.mul_add(vy, to_y.of(dx) + *push);
            let touch = contact.touch::<LAWS, true>(&slip, factors, psi, a_y, to_psi.of(dx));
            let [a_y, a_psi] = contact.creep::<true>(at_speed, touch, vy, vpsi);
            to_y.put(dx, a_y);
            to_psi.put(dx, a_psi);
        }
        // a contact is a long chain: these rows fill the time that its square roots take
        self.rows.sums(&State(x), Some(&self.laid), dx);
        for (i, stop) in self.stops.iter().enumerate() {
            let z = dx[i & 63];
            if z.abs().any_from(stop.gap) {
                self.push(stop, z, row, dx);
            }
        }
        for port in &self.ports {
            self.act(port, row, x, dx);
        }
    }

    #[cold]
    #[inline(always)]
    fn push(&self, stop: &Stop<'_, P>, z: P, row: &[f64], dx: &mut [P; STATES]) {
        let (none, law) = (P::zero(), stop.law);
        let force = stop.alpha * law.law.force(law.numbers(self.at), z, none, row[0], none, &mut P::zero());
        for (i, push) in &stop.pushes {
            let at = (self.group.dofs + i) & 63;
            dx[at] = push.mul_add(force, dx[at]);
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

/// The terms of a row that are more than what rounding leaves of equal and opposite springs, vehicle by vehicle.
fn telling(terms: impl Iterator<Item = (usize, Lanes)>) -> Vec<(usize, Lanes)> {
    let mut terms: Vec<_> = terms.collect();
    for l in 0..LANES {
        let least = f64::EPSILON * terms.iter().map(|(_, a)| a.0[l].abs()).fold(0.0, f64::max);
        for (_, a) in &mut terms {
            if a.0[l].abs() <= least {
                a.0[l] = 0.0;
            }
        }
    }
    terms.retain(|(_, a)| !a.is_zero());
    terms
}

/// A row for one part of the lanes: where its sum goes and where it starts from.
fn packed<P: Part>(ends: [usize; 2], row: &[(usize, Lanes)], at: usize) -> Row<P> {
    (ends, row.iter().map(|(i, a)| (*i, P::load(a, at))).collect())
}

/// The factor of a row at a place, which leaves the row.
fn taken(row: &mut Vec<(usize, Lanes)>, place: usize) -> Lanes {
    row.iter().position(|(i, _)| *i == place).map_or(Lanes::ZERO, |k| row.remove(k).1)
}

fn minus(a: &Lanes) -> Lanes {
    Lanes(a.0.map(|a| -a))
}

fn times(a: &Lanes, b: &Lanes) -> Lanes {
    Lanes::from_fn(|l| a.0[l] * b.0[l])
}
