//! The rows of a vehicle whose contacts saturate and touch at most, divided by the masses, in the blocks of its structure.
use crate::effects::PlacedLaw;
use crate::effects::port::Port;
use crate::rate::fused::{FusedVehicle, Packed, Stop, Wheels};
use crate::rate::plan::{Plan, Row, minus};
use crate::rate::structures::KNOWN;
use crate::simd::{LANES, Lanes, Part, Place, STATES};
use crate::vehicle::group::Group;
use crate::wheel_rail::coefficients::Contact;
use std::borrow::Cow;
use std::marker::PhantomData;

/// Sixteen vehicles made ready for their parts.
pub struct Accelerations<'a> {
    group: &'a Group,
    /// Which of [`KNOWN`] the structure is.
    pub known: Option<usize>,
    /// Of the wheelsets, of all else with the stops, of the track.
    rows: [Vec<Row>; 3],
    plans: [Plan; 3],
    /// Per wheelset: its contact with its springs, its damping.
    contacts: Vec<(Contact<Lanes>, Lanes)>,
    stops: Vec<&'a PlacedLaw>,
    ports: Vec<&'a PlacedLaw>,
}

/// Rounding leaves at most this share of the largest term of a row where equal and opposite springs cancel.
const ROUNDING: f64 = 8.0 * f64::EPSILON;

/// Entry of `prepared` that stays unused.
const UNUSED_INDEX: usize = STATES - 1;

impl<'a> Accelerations<'a> {
    /// Of a group that has these fused contacts.
    pub fn of(group: &'a Group, contacts: &[Contact<Lanes>]) -> Self {
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
            let (y, column) = (wheelset.y, wheelset.column);
            let [lateral, yaw] = [y, wheelset.psi].map(|dof| minus(&taken(&mut rows[dof], dof)));
            let contact = contact.with_springs(&lateral, &yaw);
            // gravitation, and the springs of a wheelset on the centre line
            add(&mut track[y], column, &minus(&lateral));
            add(&mut track[y], column + 2, &contact.leaning(&lateral));
            sprung.push((contact, taken(&mut rows[y], n + y)));
        }
        let track = track.into_iter().enumerate().filter(|(_, row)| !row.is_empty());
        let track: Vec<Row> = track.map(|(i, row)| ([i, i], row)).collect();
        let rows = rows.into_iter().enumerate().map(|(i, row)| ([n + i, i], row));
        let of_wheelset = |([_, i], _): &Row| group.wheelsets.iter().any(|w| w.y == *i || w.psi == *i);
        let (wheel_rows, mut rows): (Vec<_>, Vec<_>) = rows.partition(of_wheelset);
        let (mut stops, mut ports) = (Vec::new(), Vec::new());
        for law in &group.forces {
            if law.law.is_stop() && law.inputs.is_empty() && stops.len() < n {
                rows.push(([stops.len(), UNUSED_INDEX], law.row.clone()));
                stops.push(law);
            } else {
                ports.push(law);
            }
        }
        let rows = [wheel_rows, rows, track];
        let (known, plans) = planned(group, &rows);
        Accelerations { group, known, rows, plans, contacts: sprung, stops, ports }
    }

    /// The lanes from `at` on.
    pub fn part<P: Part, const LAWS: bool, S>(&self, at: usize) -> FusedVehicle<'a, P, LAWS, S> {
        let (group, none) = (self.group, P::zero());
        let port = |law: &&'a PlacedLaw| Port::new(law, &law.pushes, group.dofs, &group.speed_scale, at);
        let stop = |law: &&'a PlacedLaw| {
            let [gap] = law.first();
            Stop { gap: P::load(gap, at), port: port(law) }
        };
        let wheels = |(i, (contact, damping)): (usize, &(Contact<Lanes>, Lanes))| {
            let (wheelset, n) = (&group.wheelsets[i], group.dofs);
            let (y, psi, column) = (wheelset.y, wheelset.psi, wheelset.column);
            let contact = self.contacts.iter().position(|(other, _)| other == contact).unwrap_or(i);
            let (places, damping) = ([y, psi, n + y, n + psi].map(Place::new), P::load(damping, at));
            Wheels { places, contact, damping, column, line: none, slopes: none }
        };
        let contact = |(contact, _): &(Contact<Lanes>, Lanes)| {
            let contact = contact.part(at);
            (contact, contact.at_speed(none, none))
        };
        let [wheel_rows, body_rows, track] = &self.plans;
        FusedVehicle {
            size: (group.dofs, group.states),
            track: Packed::new(track, 0, at),
            wheel_rows: Packed::new(wheel_rows, group.states, at),
            body_rows: Packed::new(body_rows, group.states, at),
            wheelsets: self.contacts.iter().enumerate().map(wheels).collect(),
            contacts: self.contacts.iter().map(contact).collect(),
            stops: self.stops.iter().map(stop).collect(),
            ports: self.ports.iter().map(port).collect(),
            scales: [&group.speed_scale, &group.inv_speed_scale].map(|scale| P::load(scale, at)),
            speed: f64::NAN,
            prepared: [none; STATES],
            prepared_at: usize::MAX,
            structure: PhantomData,
        }
    }

    /// The file of `structures` that compiles these rows: see `build.rs`.
    pub fn file(&self) -> String {
        let mut lines = vec![format!("size {} {}", self.group.dofs, self.group.states)];
        for (name, plan) in ["wheelsets", "bodies", "track"].into_iter().zip(plans_of(self.group, &self.rows)) {
            lines.push(name.into());
            lines.extend(plan.blocks.iter().map(ToString::to_string));
        }
        lines.join("\n") + "\n"
    }
}

/// The blocks of the wheelsets, of all else and of the track: those of a known structure that has all their terms, or others.
fn planned(group: &Group, rows: &[Vec<Row>; 3]) -> (Option<usize>, [Plan; 3]) {
    for (i, known) in KNOWN.iter().enumerate() {
        if (group.dofs, group.states) == known.size {
            let [a, b, c] = [0, 1, 2].map(|k| Plan::known(Cow::Borrowed(known.blocks[k]), &rows[k]));
            if let (Some(a), Some(b), Some(c)) = (a, b, c) {
                return (Some(i), [a, b, c]);
            }
        }
    }
    (None, plans_of(group, rows))
}

/// The blocks that suit these rows.
fn plans_of(group: &Group, [wheel_rows, bodies, track]: &[Vec<Row>; 3]) -> [Plan; 3] {
    [Plan::of(wheel_rows, 0), Plan::of(bodies, STATES - group.states), Plan::of(track, 0)]
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

fn times(a: &Lanes, b: &Lanes) -> Lanes {
    Lanes::from_fn(|l| a.0[l] * b.0[l])
}
