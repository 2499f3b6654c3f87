//! Sixteen vehicles of one structure made ready to step side by side.
use crate::effects::effect::{Kind, Site, first};
use crate::effects::{Law, PlacedLaw};
use crate::error::{Error, Result};
use crate::numeric::profile_table::ShapeLanes;
use crate::numeric::sparse_rows::{COLUMNS, Rows};
use crate::simd::{LANES, Lanes, STATES};
use crate::vehicle::assembly::{Assembly, Channel, Driven, Order, OwnLaw};
use crate::vehicle::channels::Reading;
use crate::vehicle::group::Group;
use crate::vehicle::kinds::VehicleKind;
use crate::vehicle::plain_bogie::{DOFS, PlainBogie, Suspension};
use crate::vehicle::structure::{Placed, Single, Structure, contact_site};
use crate::wheel_rail::coefficients::{Contact, ContactNumbers, NO_LIMIT};
use crate::wheel_rail::guiding::Guiding;
use crate::wheel_rail::wheelset::{RailLanes, WheelsetLanes};
use std::borrow::Cow;

/// The vehicles of a group, one per lane, and their numbers.
struct SixteenVehicles<'a> {
    vehicles: Vec<&'a Assembly>,
    ones: Vec<&'a Single<'a>>,
}

/// An effect on its way into a group: its numbers and its amount in every lane.
struct PlacementSite<'a> {
    placed: &'a Placed,
    numbers: Vec<&'a [f64]>,
    alpha: Lanes,
}

impl Structure {
    /// Sixteen vehicles side by side; fewer are filled up with the first.
    pub fn group(&self, singles: &[Single<'_>], channels: &[String]) -> Result<Group> {
        self.check()?;
        let some: Vec<Assembly> = singles.iter().map(|one| self.assemble(one)).collect::<Result<_>>()?;
        let of = |i: usize| if i < some.len() { i } else { 0 };
        let all = SixteenVehicles {
            vehicles: (0..LANES).map(|i| &some[of(i)]).collect(),
            ones: (0..LANES).map(|i| &singles[of(i)]).collect(),
        };
        let mut group = all.linear_group(self.columns());
        all.own_laws(&mut group);
        for (i, placed, range) in self.acting() {
            let numbers = all.ones.iter().map(|one| &one.effects[range.clone()]).collect();
            let alpha = Lanes::from_fn(|l| all.ones[l].amounts[i]);
            self.place(&mut group, &all, &PlacementSite { placed, numbers, alpha })?;
        }
        let columns = if self.line { 0 } else { group.columns };
        for (what, got, most) in [("states", group.states, STATES), ("columns of the input table", columns, COLUMNS)] {
            if got > most {
                return Err(Error::TooMany { what, got, most });
            }
        }
        for law in &mut group.forces {
            let per_mass = |(i, a): &(usize, Lanes)| (*i, Lanes::from_fn(|l| a.0[l] * group.inv_mass[*i].0[l]));
            law.pushes = law.reaction.iter().map(per_mass).collect();
        }
        if !self.line {
            self.fuse(&mut group, &all);
        }
        group.leaning = (0..group.wheelsets.len()).map(|i| all.leaning(&group, i)).collect();
        group.readings = channels.iter().map(|name| all.reading(&group, name)).collect::<Result<_>>()?;
        Ok(group)
    }

    /// A rate of change in one piece, where the structure has one.
    fn fuse(&self, group: &mut Group, all: &SixteenVehicles<'_>) {
        let contacts = all.plain_contacts(group);
        if matches!(self.kind, VehicleKind::Bogie) && group.dofs == DOFS && !group.matrix.is_driven() {
            let suspension = Suspension::new(&group.matrix, &group.inv_mass);
            let plain = |contacts: Vec<_>| PlainBogie::new(suspension, &contacts, group.touches(), &group.speed_scale);
            (group.plain, group.suspension) = (contacts.map(plain), Some(suspension));
        } else if !matches!(self.kind, VehicleKind::Rig(_)) {
            group.contacts = contacts;
        }
    }

    /// Put an effect where it acts.
    fn place(&self, group: &mut Group, all: &SixteenVehicles<'_>, placing: &PlacementSite<'_>) -> Result<()> {
        let PlacementSite { placed, numbers, alpha } = placing;
        let record = placed.law.record();
        match record.kind {
            Kind::Body => Ok(()),
            Kind::Sensor(alteration) => {
                let (neutral, number) = (alteration.neutral(), by_lane(|l| first::<1>(numbers[l]).to_vec())[0]);
                let number = Lanes::from_fn(|l| neutral + alpha.0[l] * (number.0[l] - neutral));
                group.sensors.push((alteration, placed.at.clone(), number));
                Ok(())
            }
            Kind::Force if placed.at != "contact" => self.at_ports(group, all, placing),
            _ => {
                let wheelsets = self.at_wheelsets(all.vehicles[0], placed)?;
                if alpha.is_zero() {
                    // with no amount in any lane it must not cost a digit: only its states keep their place
                    group.states += record.states * wheelsets.len();
                } else {
                    wheelsets.into_iter().for_each(|i| placing.at_contact(group, all, i));
                }
                Ok(())
            }
        }
    }

    /// A force at every port of its place.
    fn at_ports(&self, group: &mut Group, all: &SixteenVehicles<'_>, placing: &PlacementSite<'_>) -> Result<()> {
        let placed = placing.placed;
        let ports: Vec<_> = all.vehicles.iter().map(|v| self.ports(v, placed)).collect::<Result<_>>()?;
        for (k, first) in ports[0].iter().enumerate() {
            let (row, inputs) = (terms(|l| &ports[l][k].row), terms(|l| &ports[l][k].inputs));
            let lanes = placing.prepared(|l| ports[l][k].site);
            let mut force = PlacedLaw::new(placed.law, row, inputs, lanes, placing.alpha, group.states);
            if first.reaction.is_some() {
                force.reaction = terms(|l| ports[l][k].reaction.as_ref().expect("of one structure"));
            }
            group.forces.push(force);
            hold(group, placed.law, |l| placing.numbers[l]);
            group.states += placed.law.record().states;
        }
        Ok(())
    }
}

impl PlacementSite<'_> {
    /// Its numbers prepared for its location.
    fn prepared(&self, site: impl Fn(usize) -> Site) -> Vec<Lanes> {
        by_lane(|l| self.placed.law.prepare(self.numbers[l], &site(l)))
    }

    /// At the contact of a wheelset, or at the rail under it.
    fn at_contact(&self, group: &mut Group, all: &SixteenVehicles<'_>, i: usize) {
        let (law, alpha, wheelset) = (self.placed.law, self.alpha, &mut group.wheelsets[i]);
        let lanes = || self.prepared(|l| contact_site(all.vehicles[l], i));
        let placed = || PlacedLaw::new(law, Vec::new(), Vec::new(), lanes(), alpha, 0);
        match law.record().kind {
            Kind::Force => {
                wheelset.laws.push(placed());
                wheelset.has_friction |= self.numbers.iter().any(|p| law.slides(p));
            }
            Kind::Creep => wheelset.creeps.push(placed()),
            Kind::Rolling => wheelset.rolls.push(placed()),
            Kind::Profile => wheelset.shape = Some(ShapeLanes::new(&self.numbers, alpha)),
            Kind::Rail => {
                let [stiffness, damping] = *placed().first();
                wheelset.rail = Some(RailLanes { state: group.states, alpha, stiffness, damping });
                group.states += law.record().states;
            }
            Kind::Body | Kind::Sensor(_) => {}
        }
    }
}

impl SixteenVehicles<'_> {
    /// The linear vehicles, before any law.
    fn linear_group(&self, columns: usize) -> Group {
        let (first, n) = (self.vehicles[0], self.vehicles[0].dofs.len());
        let speed_scale = Lanes::from_fn(|l| self.ones[l].speed_scale);
        let wheelset = |i: usize| WheelsetLanes::new(&self.vehicles.iter().map(|v| v.wheelsets[i]).collect::<Vec<_>>());
        Group {
            dofs: n,
            states: 2 * n,
            columns,
            matrix: self.matrix(&speed_scale),
            inv_mass: (0..n).map(|i| Lanes::from_fn(|l| 1.0 / self.vehicles[l].mass[i])).collect(),
            wheelsets: (0..first.wheelsets.len()).map(wheelset).collect(),
            forces: Vec::new(),
            speed_scale,
            inv_speed_scale: Lanes::from_fn(|l| 1.0 / speed_scale.0[l]),
            limit: first.limit,
            plain: None,
            suspension: None,
            contacts: None,
            clamped_states: Vec::new(),
            leaning: Vec::new(),
            readings: Vec::new(),
            sensors: Vec::new(),
        }
    }

    /// Sparse rows of -K and -C over x = [q, q'] and of the forces of the input table, a row per degree of freedom.
    fn matrix(&self, scale: &Lanes) -> Rows {
        let (vehicles, n) = (&self.vehicles, self.vehicles[0].dofs.len());
        let entry = |i: usize, j: usize| {
            Lanes::from_fn(|l| {
                let v = vehicles[l];
                if j < n { -v.stiffness[(i, j)] } else { -v.damping[(i, j - n)] }
            })
        };
        let driven = |dof: usize, of: fn(&Assembly) -> &Driven, scale: &Lanes| {
            let here = |k: &usize| of(vehicles[0])[*k].0 == dof;
            let term = |k: usize| (of(vehicles[0])[k].1, Lanes::from_fn(|l| of(vehicles[l])[k].2 * scale.0[l]));
            (0..of(vehicles[0]).len()).filter(here).map(term).collect::<Vec<_>>()
        };
        let mut rows = Rows::default();
        for i in 0..n {
            let state = (0..2 * n).map(|j| (j, entry(i, j))).collect();
            rows.push(state, driven(i, |v| &v.inputs, &Lanes::splat(1.0)), driven(i, |v| &v.rates, scale));
        }
        rows
    }

    /// The stops and the springs and dampers in series that belong to the vehicles themselves.
    fn own_laws(&self, group: &mut Group) {
        for i in 0..self.vehicles[0].laws.len() {
            let of = |l: usize| -> &OwnLaw { &self.vehicles[l].laws[i] };
            let law = of(0).law;
            let lanes = by_lane(|l| law.prepare(&of(l).numbers, &Site::default()));
            let (row, inputs) = (terms(|l| &of(l).row), terms(|l| &of(l).inputs));
            group.forces.push(PlacedLaw::new(law, row, inputs, lanes, Lanes::splat(1.0), group.states));
            hold(group, law, |l| &of(l).numbers);
            group.states += law.record().states;
        }
    }

    /// The contacts, where at most one saturation and one flange act at each.
    fn plain_contacts(&self, group: &Group) -> Option<Vec<Contact<Lanes>>> {
        let none_but = |laws: &[PlacedLaw], is_one: fn(Law) -> bool| match laws {
            [] => true,
            [one] => is_one(one.law),
            _ => false,
        };
        let is_plain = |w: &WheelsetLanes| {
            none_but(&w.creeps, Law::is_cubic_saturation)
                && none_but(&w.laws, Law::is_stop)
                && w.rolls.is_empty()
                && w.shape.is_none()
                && w.rail.is_none()
                && !w.has_friction
        };
        if !group.wheelsets.iter().all(is_plain) {
            return None;
        }
        let contact = |i: usize, l: usize| {
            let (wheelset, lanes) = (self.vehicles[l].wheelsets[i], &group.wheelsets[i]);
            // as the laws prepare them: clearance and stiffness, 1/(3 mu N)^2
            let stop = |law: &PlacedLaw| {
                let [clearance, stiffness] = law.first();
                [clearance.0[l], law.alpha.0[l] * stiffness.0[l]]
            };
            let saturation = |law: &PlacedLaw| {
                let [per_square] = law.first();
                [per_square.0[l].sqrt().recip(), law.alpha.0[l]]
            };
            let [clearance, flange] = lanes.laws.first().map_or([1.0, 0.0], stop);
            let creep = lanes.creeps.first().filter(|creep| creep.alpha.0[l] != 0.0);
            let [limit, share] = creep.map_or([NO_LIMIT, 1.0], saturation);
            let mass = [wheelset.y, wheelset.psi].map(|dof| self.vehicles[l].mass[dof]);
            Contact::of(&ContactNumbers { wheelset, mass, limit, share, clearance, flange })
        };
        Some((0..group.wheelsets.len()).map(|i| Contact::of_lanes(|l| contact(i, l))).collect())
    }

    /// Source of a channel.
    fn reading(&self, group: &Group, name: &str) -> Result<Reading> {
        if let Some(reading) = state_reading(group, name).or_else(|| guiding_reading(group, name)) {
            return Ok(reading);
        }
        let first = self.vehicles[0];
        if let Some(k) = first.channels.iter().position(|c| c.name == name) {
            return Ok(self.reading_of(group, name, |vehicle| Cow::Borrowed(&vehicle.channels[k])));
        }
        let Some((port, order)) = first.port_channel(name) else {
            return Err(Error::Channel(name.into(), first.channel_names().join(", ")));
        };
        Ok(self.reading_of(group, name, |vehicle| Cow::Owned(vehicle.ports[port].motion(order))))
    }

    /// Contribution of the load transfer to the guiding forces of a wheelset, of vehicles that roll.
    fn leaning(&self, group: &Group, i: usize) -> Reading {
        let has_any = !self.vehicles[0].leaning.is_empty();
        if has_any {
            self.reading_of(group, "", |vehicle| Cow::Borrowed(&vehicle.leaning[i]))
        } else {
            Reading::default()
        }
    }

    /// A channel of every vehicle.
    fn reading_of<'a>(
        &'a self,
        group: &Group,
        name: &str,
        channel: impl Fn(&'a Assembly) -> Cow<'a, Channel>,
    ) -> Reading {
        let channels: Vec<_> = self.vehicles.iter().map(|vehicle| channel(vehicle)).collect();
        let of = |l: usize| -> &Channel { &channels[l] };
        let mut reading = Reading { name: name.into(), inputs: terms(|l| &of(l).inputs), ..Reading::default() };
        let mut add = |order: Order, row: Vec<(usize, Lanes)>| {
            let velocities = row.iter().map(|(i, a)| (i + group.dofs, *a));
            match order {
                Order::Position => reading.state.extend(row),
                Order::Velocity => reading.state.extend(velocities),
                Order::Acceleration => reading.rate.extend(velocities),
            }
        };
        add(of(0).order, terms(|l| &of(l).row));
        for (m, (order, _)) in of(0).also.iter().enumerate() {
            add(*order, terms(|l| &of(l).also[m].1));
        }
        if let Some(rail) = of(0).rail.and_then(|i| group.wheelsets[i].rail.as_ref()) {
            reading.state.push((rail.state, Lanes::from_fn(|l| -rail.alpha.0[l])));
        }
        let scaled = |(column, a): (usize, Lanes)| (column, Lanes::from_fn(|l| a.0[l] * group.speed_scale.0[l]));
        reading.rates = terms(|l| &of(l).rates).into_iter().map(scaled).collect();
        reading
    }
}

/// `state.K`: one state as it is, `rate.K`: its rate of change, where K counts from 0.
fn state_reading(group: &Group, name: &str) -> Option<Reading> {
    let (what, number) = name.split_once('.')?;
    let i = number.parse::<usize>().ok().filter(|i| *i < group.states)?;
    let one = |i: usize| vec![(i, Lanes::splat(1.0))];
    let reading = Reading { name: name.into(), ..Reading::default() };
    match what {
        "state" => Some(Reading { state: one(i), ..reading }),
        // the rate of a position is one of the velocities
        "rate" if i < group.dofs => Some(Reading { state: one(i + group.dofs), ..reading }),
        "rate" => Some(Reading { rate: one(i), ..reading }),
        _ => None,
    }
}

/// `Y1`, `Y2`, ...: the sum of the guiding forces of a wheelset; `Y1.right`, `Y1.left`: of one wheel.
fn guiding_reading(group: &Group, name: &str) -> Option<Reading> {
    let wanted = name.strip_prefix('Y')?;
    let (number, side) = wanted.split_once('.').unwrap_or((wanted, ""));
    let wheel = ["", "right", "left"].iter().position(|s| *s == side)?;
    let number = number.parse::<usize>().ok()?.checked_sub(1)?;
    let wheelset = group.wheelsets.get(number)?.clone();
    let Group { dofs, speed_scale, inv_speed_scale, .. } = *group;
    let guiding = Some(Box::new(Guiding { wheelset, wheel, dofs, speed_scale, inv_speed_scale }));
    let leaning = group.leaning[number].times(if wheel == 0 { 1.0 } else { 0.5 });
    Some(Reading { name: name.into(), guiding, ..leaning })
}

/// Hold the own state that comes next within the law's largest magnitude, where it has one.
fn hold<'a>(group: &mut Group, law: Law, of: impl Fn(usize) -> &'a [f64]) {
    if law.largest(of(0)).is_some() {
        group.clamped_states.push((group.states, Lanes::from_fn(|l| law.largest(of(l)).unwrap_or(f64::MAX))));
    }
}

/// Numbers of every vehicle, lane by lane.
fn by_lane(of: impl Fn(usize) -> Vec<f64>) -> Vec<Lanes> {
    let all: Vec<_> = (0..LANES).map(of).collect();
    (0..all[0].len()).map(|k| Lanes::from_fn(|l| all[l][k])).collect()
}

/// Terms with the same columns in every vehicle.
fn terms<'a>(of: impl Fn(usize) -> &'a Vec<(usize, f64)>) -> Vec<(usize, Lanes)> {
    of(0).iter().enumerate().map(|(k, (place, _))| (*place, Lanes::from_fn(|l| of(l)[k].1))).collect()
}
