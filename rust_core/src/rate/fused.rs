//! Any vehicle whose contacts saturate and touch at most: linear rows, contacts and laws as accelerations in one rate.
//!
//! The same forces as those of the general path in another order, made ready for one part of the lanes: every factor
//! side by side with the next, divided by its mass; the springs that hold a wheelset itself joined with its gravitation;
//! what the track alone does is summed once per row of the input table.
use crate::effects::port::Port;
use crate::numeric::place::Place;
use crate::rate::blocks::Row;
use crate::rate::suspension::{Suspension, TrackRows};
use crate::simd::{LANES, Lanes, Part};
use crate::vehicle::group::{Group, STATES};
use crate::wheel_rail::contact::{AtSpeed, Contact, Displacement, Motion, under};

/// A part of the lanes of a group.
pub struct FusedVehicle<'a, P> {
    group: &'a Group,
    at: usize,
    pub track: TrackRows<P>,
    pub suspension: Suspension<P>,
    wheelsets: Vec<Wheels<P>>,
    /// Those that differ: less to keep in the first cache.
    contacts: Vec<(Contact<P>, AtSpeed<P>)>,
    stops: Vec<Stop<'a, P>>,
    ports: Vec<Port<'a, P>>,
    speed: f64,
    /// The sums of `track` at this row of the table.
    prepared: [P; STATES],
    prepared_at: usize,
}

/// A wheelset in its suspension.
struct Wheels<P> {
    /// y, psi, y', psi'
    places: [Place<P>; 4],
    contact: usize,
    /// Its acceleration per y' by dampers.
    damping: P,
    /// First of the columns of its track.
    column: usize,
    /// At the row of the table where `prepared` is: y_w + r phi_w, and what the slopes of the track add to t_y.
    line: P,
    slopes: P,
}

/// A stop whose deflection is an entry of dx. Contact is rare: only then it acts.
struct Stop<'a, P> {
    gap: P,
    port: Port<'a, P>,
}

/// Rounding leaves at most this share of the largest term of a row where equal and opposite springs cancel.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Entry of `prepared` that stays unused.
const UNUSED_INDEX: usize = STATES - 1;

impl<'a, P: Part> FusedVehicle<'a, P> {
    /// Of a group that has these fused contacts.
    #[inline(always)]
    pub fn new(group: &'a Group, contacts: &[Contact<Lanes>], at: usize) -> Self {
        let n = group.dofs;
        let (mut rows, mut track) = (Vec::new(), Vec::new());
        for row in 0..n {
            let per_mass = |(i, a): (usize, &Lanes)| (i, times(a, &group.inv_mass[row]));
            rows.push(drop_cancelled_terms(group.matrix.state_of(row).map(per_mass)));
            track.push(group.matrix.inputs_of(row).map(per_mass).collect::<Vec<_>>());
        }
        // what holds a wheelset itself goes with its contact
        let mut sprung = Vec::new();
        for (wheelset, contact) in group.wheelsets.iter().zip(contacts) {
            let [lateral, yaw] = [wheelset.y, wheelset.psi].map(|dof| minus(&taken(&mut rows[dof], dof)));
            sprung.push((contact.with_springs(&lateral, &yaw), lateral));
        }
        let (mut wheelsets, mut parts) = (Vec::new(), Vec::new());
        for (i, (wheelset, (contact, lateral))) in group.wheelsets.iter().zip(&sprung).enumerate() {
            let (y, psi, column) = (wheelset.y, wheelset.psi, wheelset.column);
            // gravitation, and the springs of a wheelset on the centre line
            add(&mut track[y], column, &minus(lateral));
            add(&mut track[y], column + 2, &contact.leaning(lateral));
            let damping = P::load(&taken(&mut rows[y], n + y), at);
            let which = sprung.iter().position(|(other, _)| other == contact).unwrap_or(i);
            let places = [y, psi, n + y, n + psi].map(Place::new);
            let none = P::zero();
            wheelsets.push(Wheels { places, contact: which, damping, column, line: none, slopes: none });
            let part = contact.part(at);
            let at_speed = part.at_speed(none, none);
            parts.push((part, at_speed));
        }
        let prepared = track.into_iter().enumerate().filter(|(_, row)| !row.is_empty());
        let track: Vec<Row> = prepared.map(|(i, row)| ([i, i], row)).collect();
        let rows = rows.into_iter().enumerate().map(|(i, row)| ([n + i, i], row));
        let of_wheelset = |([_, i], _): &Row| group.wheelsets.iter().any(|w| w.y == *i || w.psi == *i);
        let (wheel_rows, mut rows): (Vec<_>, Vec<_>) = rows.partition(of_wheelset);
        let (stops, ports) = Self::laws(group, at, &mut rows);
        FusedVehicle {
            group,
            at,
            track: TrackRows::new(group, track, at),
            suspension: Suspension::new(group, &wheel_rows, &rows, stops.len(), at),
            wheelsets,
            contacts: parts,
            stops,
            ports,
            speed: f64::NAN,
            prepared: [P::zero(); STATES],
            prepared_at: usize::MAX,
        }
    }

    /// The laws at the suspensions; the rows of the stops' deflections go to `rows`.
    #[inline(always)]
    fn laws(group: &'a Group, at: usize, rows: &mut Vec<Row>) -> (Vec<Stop<'a, P>>, Vec<Port<'a, P>>) {
        let (mut stops, mut ports) = (Vec::new(), Vec::new());
        for law in &group.forces {
            let port = Port::new(law, &law.pushes, group.dofs, &group.speed_scale, at);
            if law.law.is_stop() && law.inputs.is_empty() && stops.len() < group.dofs {
                rows.push(([stops.len(), UNUSED_INDEX], law.row.clone()));
                stops.push(Stop { gap: P::load(&law.lanes[0], at), port });
            } else {
                ports.push(port);
            }
        }
        (stops, ports)
    }

    #[inline(always)]
    fn prepare_row(&mut self, index: usize, row: &[f64]) {
        if row[1] != self.speed {
            self.set_speed(row[1]);
        }
        self.prepared_at = index;
        self.track.prepare_row(row, &mut self.prepared);
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
        let v = P::splat(speed) * P::load(&self.group.speed_scale, self.at);
        let per_v = P::splat(1.0 / speed) * P::load(&self.group.inv_speed_scale, self.at);
        for (contact, at_speed) in &mut self.contacts {
            *at_speed = contact.at_speed(v, per_v);
        }
    }

    /// dx[n ..] = accelerations and rates of own states at a row of the input table; x has room behind its states.
    #[inline(always)]
    pub fn rate<const LAWS: bool, const WHOLE: bool>(
        &mut self,
        index: usize,
        row: &[f64],
        x: &mut [P; STATES],
        dx: &mut [P; STATES],
    ) {
        if index != self.prepared_at {
            self.prepare_row(index, row);
        }
        self.suspension.wheelsets(x, &self.prepared, dx);
        for wheels in &self.wheelsets {
            self.touch::<LAWS, WHOLE>(wheels, x, dx);
        }
        // a contact is a long chain: these rows fill the time that its square roots take
        self.suspension.bodies(x, &self.prepared, dx);
        for (i, stop) in self.stops.iter_mut().enumerate() {
            if dx[i & 63].abs().any_from(stop.gap) {
                stop.port.act(index, row, x, dx);
            }
        }
        for port in &mut self.ports {
            port.act(index, row, x, dx);
        }
    }

    /// Add the contact forces of a wheelset to its suspension.
    #[inline(always)]
    fn touch<const LAWS: bool, const WHOLE: bool>(&self, wheels: &Wheels<P>, x: &[P; STATES], dx: &mut [P; STATES]) {
        let Wheels { places: [y, psi, vy, vpsi], contact, damping, line, slopes, .. } = wheels;
        let (contact, at_speed) = &self.contacts[*contact];
        let motion = Motion { y: y.of(x) - *line, psi: psi.of(x), vy: vy.of(x), vpsi: vpsi.of(x) };
        let slip = contact.slip::<true>(at_speed, &Displacement::linear(motion.y), &motion, *slopes);
        let factors = contact.factors::<LAWS, WHOLE, true>(&slip);
        let given = [damping.mul_add(motion.vy, vy.of(dx)), vpsi.of(dx)];
        let [a_y, a_psi] = contact.touch::<LAWS, true>(at_speed, &motion, &slip, factors, given);
        vy.put(dx, a_y);
        vpsi.put(dx, a_psi);
    }
}

/// The terms of a row that are more than what rounding leaves of equal and opposite springs, vehicle by vehicle.
fn drop_cancelled_terms(terms: impl Iterator<Item = (usize, Lanes)>) -> Vec<(usize, Lanes)> {
    let mut terms: Vec<_> = terms.collect();
    for l in 0..LANES {
        let least = ROUNDING * terms.iter().map(|(_, a)| a.0[l].abs()).fold(0.0, f64::max);
        for (_, a) in &mut terms {
            if a.0[l].abs() <= least {
                a.0[l] = 0.0;
            }
        }
    }
    terms.retain(|(_, a)| !a.is_zero());
    terms
}

/// The factor of a row at a place, which leaves the row.
fn taken(row: &mut Vec<(usize, Lanes)>, place: usize) -> Lanes {
    row.iter().position(|(i, _)| *i == place).map_or(Lanes::ZERO, |k| row.remove(k).1)
}

/// More of a factor at a place of a row.
fn add(row: &mut Vec<(usize, Lanes)>, place: usize, more: &Lanes) {
    let old = taken(row, place);
    row.push((place, Lanes::from_fn(|l| old.0[l] + more.0[l])));
}

fn minus(a: &Lanes) -> Lanes {
    Lanes(a.0.map(|a| -a))
}

fn times(a: &Lanes, b: &Lanes) -> Lanes {
    Lanes::from_fn(|l| a.0[l] * b.0[l])
}
