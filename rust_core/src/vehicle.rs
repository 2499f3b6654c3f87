//! A group of vehicles of one structure: the rate of change of its state.
use crate::assemble::{
    Assembly, Driven, Inputs, LINKAGE, Order, OwnLaw, Row, assemble, columns, eigenvalues, parameters, radius_bound,
};
use crate::bodies::Layout;
use crate::contact::{Contact, ContactNumbers, NO_LIMIT};
use crate::effects::effect::{Kind, Site, Slopes};
use crate::effects::{Law, PlacedLaw};
use crate::error::{Error, Result, expect_len};
use crate::lanes::{LANES, Lanes, Part};
use crate::plain::PlainBogie;
use crate::profile::ShapeLanes;
use crate::rows::Rows;
use crate::wheelset::{Passing, RailLanes, WheelsetLanes};

/// Room for the state of one vehicle.
pub const STATES: usize = 64;

/// An effect at a place; wheelset 0: both, or none in particular.
#[derive(Clone, Debug)]
pub struct Placed {
    pub law: Law,
    pub at: String,
    pub wheelset: u8,
    /// How many numbers describe it.
    pub count: usize,
}

/// What all vehicles of a group share.
#[derive(Clone, Debug)]
pub struct Structure {
    pub kind: String,
    pub measured: Vec<String>,
    pub placed: Vec<Placed>,
    /// Of a vehicle of bodies and elements, in the place of the kind.
    pub layout: Option<Layout>,
}

/// The numbers of one vehicle: of the kind, of its effects one after the other, their amounts, its share of the speed.
#[derive(Clone, Copy, Debug)]
pub struct Single<'a> {
    pub numbers: &'a [f64],
    pub effects: &'a [f64],
    pub amounts: &'a [f64],
    pub speed_scale: f64,
}

/// A channel as terms of x and x' and of the input row.
#[derive(Clone, Debug)]
pub struct Reading {
    pub name: String,
    state: Vec<(usize, Lanes)>,
    rate: Vec<(usize, Lanes)>,
    inputs: Vec<(usize, Lanes)>,
    /// Columns that the speed multiplies, with the lane's share of the speed.
    rates: Vec<(usize, Lanes)>,
    /// The lateral forces of the wheels of a wheelset on the rails, in the place of all that.
    guiding: Option<Box<Guiding>>,
}

/// Which wheels of which wheelset guide: both together, or one.
#[derive(Clone, Debug)]
pub struct Guiding {
    wheelset: WheelsetLanes,
    /// 0: both; 1 right, 2 left.
    wheel: usize,
    dofs: usize,
    speed_scale: Lanes,
    inv_speed_scale: Lanes,
}

/// What the step loop needs: sixteen vehicles of one structure.
#[derive(Clone, Debug)]
pub struct Group {
    pub dofs: usize,
    pub states: usize,
    pub columns: usize,
    /// -K and -C over x = [q, q'], and what the track moves of the suspension.
    pub matrix: Rows,
    pub inv_mass: Vec<Lanes>,
    pub wheelsets: Vec<WheelsetLanes>,
    pub forces: Vec<PlacedLaw>,
    pub speed_scale: Lanes,
    pub inv_speed_scale: Lanes,
    pub limit: f64,
    /// Set where the structure is a bogie with nothing but saturation and flange: its rate in one piece.
    pub plain: Option<PlainBogie<Lanes>>,
    /// Set where another structure has no more at its contacts than that.
    pub contacts: Option<Vec<Contact<Lanes>>>,
    /// Own states that are held within a largest magnitude at the end of every step.
    held: Vec<(usize, Lanes)>,
    pub readings: Vec<Reading>,
    /// Sensor laws in order: the channel, which of delay, gain, offset, and its numbers times the amount.
    pub sensors: Vec<(Law, String, Lanes)>,
}

impl Structure {
    /// Check the placed effects against the kind of vehicle.
    pub fn check(&self) -> Result<()> {
        let known = match &self.layout {
            Some(layout) => layout.assemble(&vec![1.0; layout.numbers])?.ports,
            None => parameters(&self.kind).map(|_| Vec::new())?,
        };
        for (i, placed) in self.placed.iter().enumerate() {
            let record = placed.law.record();
            let class = known.iter().find(|p| p.at == placed.at).map_or(placed.at.as_str(), |p| p.class);
            if !record.at.contains(&class) || (self.layout.is_some() && record.kind == Kind::Body) {
                let known = record.at.join(", ");
                return Err(Error::Place { kind: record.key.into(), at: placed.at.clone(), known });
            }
            for other in &self.placed[..i] {
                let both = other.wheelset == 0 || placed.wheelset == 0 || other.wheelset == placed.wheelset;
                let first = other.law.record();
                if other.at == placed.at && both && first.supersedes.clashes(record.supersedes) {
                    let (first, second) = (first.key.into(), record.key.into());
                    return Err(Error::Superseded { first, second, at: placed.at.clone() });
                }
            }
        }
        Ok(())
    }

    /// Columns of the input table that these vehicles read.
    pub fn columns(&self) -> usize {
        self.layout.as_ref().map_or_else(|| columns(&self.kind), Layout::columns)
    }

    pub fn effect_numbers(&self) -> usize {
        self.placed.iter().map(|p| p.count).sum()
    }

    /// Is this place driven by a measured force of the coach, so that nothing else acts there?
    fn driven(&self, at: &str) -> bool {
        (at == "secondary_lateral" && self.measured.iter().any(|q| q == "Qy"))
            || (at == "secondary_yaw" && self.measured.iter().any(|q| q == "Qpsi"))
    }

    /// The effects that act in this run, with the range of their numbers.
    fn acting(&self) -> impl Iterator<Item = (usize, &Placed, std::ops::Range<usize>)> {
        let mut begin = 0;
        self.placed.iter().enumerate().filter_map(move |(i, placed)| {
            let range = begin..begin + placed.count;
            begin = range.end;
            (!self.driven(&placed.at)).then_some((i, placed, range))
        })
    }

    /// One vehicle with the bodies that its effects add.
    pub fn assemble(&self, one: &Single<'_>) -> Result<Assembly> {
        expect_len("numbers of the effects", one.effects.len(), self.effect_numbers())?;
        expect_len("amounts", one.amounts.len(), self.placed.len())?;
        let mut vehicle = match &self.layout {
            Some(layout) => layout.assemble(one.numbers)?,
            None => assemble(&self.kind, one.numbers, &self.measured)?,
        };
        for (i, placed, range) in self.acting() {
            if placed.law == Law::CoachMode {
                let p = &one.effects[range];
                vehicle.add_coach(one.amounts[i], p[0], p[1], p[2]);
            }
        }
        Ok(vehicle)
    }

    /// Where a placed effect stands: rows, inputs and sites of its ports.
    fn ports(&self, vehicle: &Assembly, placed: &Placed) -> Result<Vec<(Row, Inputs, Site)>> {
        let linkage = placed.at == "wheelset_yaw" && placed.wheelset == 0;
        let found = vehicle.places(&placed.at, if linkage { LINKAGE } else { placed.wheelset });
        if found.is_empty() {
            return Err(Error::Site { at: placed.at.clone(), wheelset: placed.wheelset });
        }
        Ok(found.iter().map(|p| (p.row.clone(), p.inputs.clone(), p.site)).collect())
    }

    fn contact_site(vehicle: &Assembly, i: usize, speed: f64) -> Site {
        let w = &vehicle.wheelsets[i];
        Site {
            motion: 0.01,
            speed: 0.3,
            wheel_load: w.n,
            creep_damping: 2.0 * w.kappa_y * w.n / speed,
            creep_slopes: [w.kappa_x * w.n, w.kappa_y * w.n],
            gravitational: 2.0 * w.n * w.epsilon / w.b,
            ..Site::default()
        }
    }

    fn at_wheelsets(&self, vehicle: &Assembly, placed: &Placed) -> Vec<usize> {
        (0..vehicle.wheelsets.len()).filter(|i| placed.wheelset == 0 || placed.wheelset as usize == i + 1).collect()
    }

    /// Smallest power of two of RK4 steps per sample: abs(lambda) h <= 1 for the linear vehicle (accuracy), and
    /// 0.7 of RK4's bound 2.78 with every effect's steepest slopes added (stability).
    pub fn steps(&self, one: &Single<'_>, slowest: f64, fastest: f64, dt: f64, limit: usize) -> Result<usize> {
        let vehicle = self.assemble(one)?;
        let mut rows = Vec::new();
        let mut rate: f64 = 0.0;
        for (i, placed, range) in self.acting() {
            let p = &one.effects[range];
            let scaled = |s: Slopes| Slopes {
                stiffness: s.stiffness * one.amounts[i],
                damping: s.damping * one.amounts[i],
                rate: s.rate,
            };
            match placed.law.record().kind {
                Kind::Force if placed.at != "contact" => {
                    for (row, _, site) in self.ports(&vehicle, placed)? {
                        let slopes = scaled(placed.law.stiffest(p, &site));
                        rate = rate.max(slopes.rate);
                        rows.push((row, slopes));
                    }
                }
                Kind::Force | Kind::Profile | Kind::Rail => {
                    for i in self.at_wheelsets(&vehicle, placed) {
                        let mut site = Self::contact_site(&vehicle, i, slowest);
                        // a wheel that slides does not damp the rail
                        if self.placed.iter().any(|c| c.law.record().kind == Kind::Creep) {
                            site.creep_damping = 0.0;
                        }
                        let slopes = scaled(placed.law.stiffest(p, &site));
                        rate = rate.max(slopes.rate);
                        rows.push((vec![(vehicle.wheelsets[i].y, 1.0)], slopes));
                    }
                }
                _ => {}
            }
        }
        for own in &vehicle.laws {
            let mut slopes = own.law.stiffest(&own.numbers, &Site::default());
            if own.law == Law::MaxwellDamper {
                // its spring stands in the matrix, with its own state
                slopes.stiffness = 0.0;
            }
            rate = rate.max(slopes.rate);
            rows.push((own.row.clone(), slopes));
        }
        let more: Vec<_> = rows.iter().map(|(row, s)| (row.as_slice(), s.stiffness, s.damping)).collect();
        let radius = |values: &[(f64, f64)]| values.iter().map(|(re, im)| re.hypot(*im)).fold(0.0, f64::max);
        let mut needed: f64 = 1.0;
        for speed in if slowest < fastest { vec![slowest, fastest] } else { vec![slowest] } {
            for (more, share) in [(&[][..], 1.0), (&more[..], 1.0 / (0.7 * 2.78))] {
                let matrix = vehicle.state_matrix(speed, more);
                // a norm that bounds the eigenvalues is 20 times cheaper, and mostly enough for one step
                if radius_bound(matrix.clone()) * dt * share > 1.0 {
                    needed = needed.max(radius(&eigenvalues(matrix)) * dt * share);
                }
            }
        }
        needed = needed.max(rate * dt / (0.7 * 2.78));
        let steps = (needed.max(1.0).ceil() as usize).next_power_of_two();
        if steps > limit {
            let remedy = "raise the mass, soften the stiffest element or sample more often";
            return Err(Error::Stiff { needed, dt, limit, remedy });
        }
        Ok(steps)
    }

    /// Sixteen vehicles side by side; fewer are filled up with the first.
    pub fn group(&self, singles: &[Single<'_>], channels: &[String]) -> Result<Group> {
        self.check()?;
        let some: Vec<Assembly> = singles.iter().map(|one| self.assemble(one)).collect::<Result<_>>()?;
        let of = |i: usize| if i < some.len() { i } else { 0 };
        let vehicles: Vec<&Assembly> = (0..LANES).map(|i| &some[of(i)]).collect();
        let ones: Vec<&Single<'_>> = (0..LANES).map(|i| &singles[of(i)]).collect();
        let first = vehicles[0];
        let n = first.dofs.len();
        let scale = Lanes::from_fn(|l| ones[l].speed_scale);
        let mut group = Group {
            dofs: n,
            states: 2 * n,
            columns: self.columns(),
            matrix: Self::matrix(&vehicles, &scale),
            inv_mass: (0..n).map(|i| Lanes::from_fn(|l| 1.0 / vehicles[l].mass[i])).collect(),
            wheelsets: (0..first.wheelsets.len())
                .map(|i| WheelsetLanes::new(&vehicles.iter().map(|v| v.wheelsets[i]).collect::<Vec<_>>()))
                .collect(),
            forces: Vec::new(),
            speed_scale: scale,
            inv_speed_scale: Lanes::from_fn(|l| 1.0 / scale.0[l]),
            limit: first.limit,
            plain: None,
            contacts: None,
            held: Vec::new(),
            readings: Vec::new(),
            sensors: Vec::new(),
        };
        Self::own_laws(&mut group, &vehicles);
        for (i, placed, range) in self.acting() {
            self.place(&mut group, &vehicles, &ones, i, placed, range)?;
        }
        for law in &mut group.forces {
            let per_mass = |(i, a): &(usize, Lanes)| (*i, Lanes::from_fn(|l| a.0[l] * group.inv_mass[*i].0[l]));
            law.pushes = law.row.iter().map(per_mass).collect();
        }
        if let Some(contacts) = Self::plain_contacts(&group, &vehicles) {
            if self.kind == "bogie" && n == 6 && !group.matrix.is_driven() {
                let numbers: Vec<_> = ones.iter().map(|one| one.numbers).collect();
                group.plain = Some(PlainBogie::new(&numbers, &contacts, &group.speed_scale, group.touches()));
            } else if self.layout.is_some() && n < STATES {
                group.contacts = Some(contacts.iter().map(|numbers| Contact::new(numbers)).collect());
            }
        }
        group.readings =
            channels.iter().map(|name| Self::reading(&group, &vehicles, name)).collect::<Result<Vec<_>>>()?;
        if group.states > STATES {
            return Err(Error::Shape { what: "states of a vehicle".into(), got: group.states, expected: STATES });
        }
        Ok(group)
    }

    /// The numbers of every contact, lane by lane, where at most one saturation, whole or absent, and one flange act at it.
    fn plain_contacts(group: &Group, vehicles: &[&Assembly]) -> Option<Vec<Vec<ContactNumbers>>> {
        let alone = |laws: &[PlacedLaw], law: Law| laws.is_empty() || (laws.len() == 1 && laws[0].law == law);
        let fits = |w: &WheelsetLanes| {
            let whole = w.creeps.iter().all(|c| c.alpha.0.iter().all(|a| *a == 0.0 || *a == 1.0));
            alone(&w.creeps, Law::CreepSaturation)
                && whole
                && alone(&w.laws, Law::FlangeContact)
                && w.rolls.is_empty()
                && w.shape.is_none()
                && w.rail.is_none()
        };
        if !group.wheelsets.iter().all(fits) {
            return None;
        }
        let contact = |i: usize, l: usize| {
            let (wheelset, lanes) = (vehicles[l].wheelsets[i], &group.wheelsets[i]);
            let flange = lanes.laws.first().map_or([1.0, 0.0], |f| [f.lanes[0].0[l], f.alpha.0[l] * f.lanes[1].0[l]]);
            let creep = lanes.creeps.first().filter(|c| c.alpha.0[l] == 1.0);
            let limit = creep.map_or(NO_LIMIT, |c| c.lanes[0].0[l].sqrt().recip());
            let mass = [wheelset.y, wheelset.psi].map(|dof| vehicles[l].mass[dof]);
            ContactNumbers { wheelset, mass, limit, clearance: flange[0], flange: flange[1] }
        };
        Some((0..group.wheelsets.len()).map(|i| (0..LANES).map(|l| contact(i, l)).collect()).collect())
    }

    /// Sparse rows of -K and -C over x = [q, q'] and of the forces of the input table, a row per degree of freedom.
    fn matrix(vehicles: &[&Assembly], scale: &Lanes) -> Rows {
        let n = vehicles[0].dofs.len();
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
    fn own_laws(group: &mut Group, vehicles: &[&Assembly]) {
        for i in 0..vehicles[0].laws.len() {
            let of = |l: usize| -> &OwnLaw { &vehicles[l].laws[i] };
            let OwnLaw { law, row, inputs, .. } = of(0);
            let prepared: Vec<_> = (0..LANES).map(|l| law.prepare(&of(l).numbers, &Site::default())).collect();
            if law.largest(&of(0).numbers).is_some() {
                let limit = Lanes::from_fn(|l| law.largest(&of(l).numbers).unwrap_or(f64::MAX));
                group.held.push((group.states, limit));
            }
            group.forces.push(PlacedLaw {
                law: *law,
                pushes: Vec::new(),
                row: (0..row.len()).map(|k| (row[k].0, Lanes::from_fn(|l| of(l).row[k].1))).collect(),
                inputs: (0..inputs.len()).map(|k| (inputs[k].0, Lanes::from_fn(|l| of(l).inputs[k].1))).collect(),
                lanes: (0..prepared[0].len()).map(|k| Lanes::from_fn(|l| prepared[l][k])).collect(),
                alpha: Lanes::splat(1.0),
                state: group.states,
                has_state: law.record().states > 0,
                whole: true,
                looks_at_speed: law.looks_at_speed(),
            });
            group.states += law.record().states;
        }
    }

    fn place(
        &self,
        group: &mut Group,
        vehicles: &[&Assembly],
        ones: &[&Single<'_>],
        index: usize,
        placed: &Placed,
        range: std::ops::Range<usize>,
    ) -> Result<()> {
        let record = placed.law.record();
        let alpha = Lanes::from_fn(|l| ones[l].amounts[index]);
        let lanes = |site: &dyn Fn(usize) -> Site| -> Vec<Lanes> {
            let per_lane: Vec<Vec<f64>> =
                (0..LANES).map(|l| placed.law.prepare(&ones[l].effects[range.clone()], &site(l))).collect();
            (0..per_lane[0].len()).map(|k| Lanes::from_fn(|l| per_lane[l][k])).collect()
        };
        let law = |row, inputs, lanes, state| PlacedLaw {
            law: placed.law,
            pushes: Vec::new(),
            row,
            inputs,
            lanes,
            alpha,
            state,
            has_state: record.states > 0,
            whole: alpha.0.iter().all(|a| *a == 1.0),
            looks_at_speed: placed.law.looks_at_speed(),
        };
        if alpha.is_zero() && ["contact", "track"].contains(&placed.at.as_str()) {
            // with no amount in any lane it must not cost a digit: only its states keep their place
            group.states += record.states * self.at_wheelsets(vehicles[0], placed).len();
            return Ok(());
        }
        match record.kind {
            Kind::Body => {}
            Kind::Sensor => {
                let neutral = if placed.law == Law::SensorGain { 1.0 } else { 0.0 };
                let number = Lanes::from_fn(|l| neutral + alpha.0[l] * (ones[l].effects[range.start] - neutral));
                group.sensors.push((placed.law, placed.at.clone(), number));
            }
            Kind::Force if placed.at != "contact" => {
                let ports: Vec<_> = vehicles.iter().map(|v| self.ports(v, placed)).collect::<Result<_>>()?;
                for (port, (first, inputs, _)) in ports[0].iter().enumerate() {
                    let row =
                        (0..first.len()).map(|k| (first[k].0, Lanes::from_fn(|l| ports[l][port].0[k].1))).collect();
                    let inputs =
                        (0..inputs.len()).map(|k| (inputs[k].0, Lanes::from_fn(|l| ports[l][port].1[k].1))).collect();
                    let numbers = lanes(&|l| ports[l][port].2);
                    group.forces.push(law(row, inputs, numbers, group.states));
                    if placed.law.largest(&ones[0].effects[range.clone()]).is_some() {
                        let of = |l: usize| placed.law.largest(&ones[l].effects[range.clone()]);
                        group.held.push((group.states, Lanes::from_fn(|l| of(l).unwrap_or(f64::MAX))));
                    }
                    group.states += record.states;
                }
            }
            Kind::Profile => {
                let tables: Vec<_> = (0..LANES).map(|l| ones[l].effects[range.clone()].to_vec()).collect();
                for i in self.at_wheelsets(vehicles[0], placed) {
                    group.wheelsets[i].shape = Some(ShapeLanes::new(&tables, alpha));
                }
            }
            _ => {
                for i in self.at_wheelsets(vehicles[0], placed) {
                    let numbers = lanes(&|l| Self::contact_site(vehicles[l], i, 40.0));
                    let wheelset = &mut group.wheelsets[i];
                    match record.kind {
                        Kind::Force => wheelset.laws.push(law(Vec::new(), Vec::new(), numbers, 0)),
                        Kind::Creep => wheelset.creeps.push(law(Vec::new(), Vec::new(), numbers, 0)),
                        Kind::Rolling => wheelset.rolls.push(law(Vec::new(), Vec::new(), numbers, 0)),
                        _ => {
                            wheelset.rail = Some(RailLanes {
                                state: group.states,
                                alpha,
                                stiffness: numbers[0],
                                damping: numbers[1],
                            });
                            group.states += 1;
                        }
                    }
                }
            }
        }
        Ok(())
    }

    fn reading(group: &Group, vehicles: &[&Assembly], name: &str) -> Result<Reading> {
        if let Some(reading) = Reading::of_state(group, name).or_else(|| Reading::of_guiding(group, name)) {
            return Ok(reading);
        }
        let of = |v: &Assembly| v.channels.iter().position(|c| c.name == name);
        let Some(k) = of(vehicles[0]) else {
            let known = vehicles[0].channels.iter().map(|c| c.name.as_str()).collect::<Vec<_>>().join(", ");
            return Err(Error::Channel(name.into(), known));
        };
        let channel = &vehicles[0].channels[k];
        let terms: Vec<(usize, Lanes)> = (0..channel.row.len())
            .map(|t| (channel.row[t].0, Lanes::from_fn(|l| vehicles[l].channels[k].row[t].1)))
            .collect();
        let n = group.dofs;
        let shifted = |by: usize| terms.iter().map(|(i, a)| (i + by, *a)).collect::<Vec<_>>();
        let (mut state, mut rate) = match channel.order {
            Order::Position => (shifted(0), Vec::new()),
            Order::Velocity => (shifted(n), Vec::new()),
            Order::Acceleration => (Vec::new(), shifted(n)),
        };
        for (m, (order, row)) in channel.also.iter().enumerate() {
            let more = (0..row.len()).map(|t| (row[t].0, Lanes::from_fn(|l| vehicles[l].channels[k].also[m].1[t].1)));
            match order {
                Order::Position => state.extend(more),
                Order::Velocity => state.extend(more.map(|(i, a)| (i + n, a))),
                Order::Acceleration => rate.extend(more.map(|(i, a)| (i + n, a))),
            }
        }
        if let Some(rail) = channel.rail.and_then(|i| group.wheelsets[i].rail.as_ref()) {
            state.push((rail.state, Lanes::from_fn(|l| -rail.alpha.0[l])));
        }
        let inputs = (0..channel.inputs.len())
            .map(|t| (channel.inputs[t].0, Lanes::from_fn(|l| vehicles[l].channels[k].inputs[t].1)))
            .collect();
        let rates = (0..channel.rates.len())
            .map(|t| {
                let factor = |l: usize| vehicles[l].channels[k].rates[t].1 * group.speed_scale.0[l];
                (channel.rates[t].0, Lanes::from_fn(factor))
            })
            .collect();
        Ok(Reading { name: name.into(), state, rate, inputs, rates, guiding: None })
    }
}

impl Guiding {
    #[inline(always)]
    fn force<P: Part>(&self, at: usize, row: &[f64], x: &[P; STATES]) -> P {
        let track = Passing {
            row,
            speed: P::splat(row[1]) * P::load(&self.speed_scale, at),
            inv_speed: P::splat(1.0 / row[1]) * P::load(&self.inv_speed_scale, at),
        };
        let [right, left] = self.wheelset.guiding(at, &track, self.dofs, x);
        match self.wheel {
            0 => right + left,
            1 => right,
            _ => left,
        }
    }
}

impl Reading {
    /// `state.K`: one state as it is, `rate.K`: its rate of change, where K counts from 0.
    fn of_state(group: &Group, name: &str) -> Option<Reading> {
        let (what, number) = name.split_once('.')?;
        let i = number.parse::<usize>().ok().filter(|i| *i < group.states)?;
        let one = vec![(i, Lanes::splat(1.0))];
        let (state, rate) = match what {
            "state" => (one, Vec::new()),
            // the rate of a position stands among the velocities
            "rate" if i < group.dofs => (vec![(i + group.dofs, Lanes::splat(1.0))], Vec::new()),
            "rate" => (Vec::new(), one),
            _ => return None,
        };
        Some(Reading { name: name.into(), state, rate, inputs: Vec::new(), rates: Vec::new(), guiding: None })
    }

    /// `Y1`, `Y2`, ...: the sum of the guiding forces of a wheelset; `Y1.right`, `Y1.left`: of one wheel.
    fn of_guiding(group: &Group, name: &str) -> Option<Reading> {
        let (number, side) = name.strip_prefix('Y')?.split_once('.').unwrap_or((name.strip_prefix('Y')?, ""));
        let wheel = ["", "right", "left"].iter().position(|s| *s == side)?;
        let wheelset = group.wheelsets.get(number.parse::<usize>().ok()?.checked_sub(1)?)?.clone();
        let (dofs, speed_scale, inv_speed_scale) = (group.dofs, group.speed_scale, group.inv_speed_scale);
        let guiding = Some(Box::new(Guiding { wheelset, wheel, dofs, speed_scale, inv_speed_scale }));
        let (state, rate, inputs, rates) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        Some(Reading { name: name.into(), state, rate, inputs, rates, guiding })
    }

    /// Of the lanes from `at` on.
    #[inline(always)]
    pub fn part<P: Part>(&self, at: usize) -> Signal<'_, P> {
        let part = |terms: &[(usize, Lanes)]| terms.iter().map(|(i, a)| (*i, P::load(a, at))).collect::<Vec<_>>();
        let [state, rate, inputs, rates] =
            [&self.state, &self.rate, &self.inputs, &self.rates].map(|terms| part(terms));
        match (&self.guiding, &state[..], &inputs[..]) {
            (Some(guiding), ..) => Signal::Guiding(guiding, at),
            (None, &[state], &[line, level]) if rate.is_empty() && rates.is_empty() => {
                Signal::Displacement { state, inputs: [line, level] }
            }
            _ => Signal::Terms { state, rate, inputs, rates },
        }
    }
}

/// A reading of a part of the lanes.
pub enum Signal<'a, P> {
    /// Of a wheelset relative to the rails, such as every score has: as its terms, without loops over them.
    Displacement {
        state: (usize, P),
        inputs: [(usize, P); 2],
    },
    Terms {
        state: Vec<(usize, P)>,
        rate: Vec<(usize, P)>,
        inputs: Vec<(usize, P)>,
        rates: Vec<(usize, P)>,
    },
    Guiding(&'a Guiding, usize),
}

impl<P: Part> Signal<'_, P> {
    #[inline(always)]
    pub fn read(&self, row: &[f64], x: &[P; STATES], dx: &[P; STATES]) -> P {
        match self {
            Signal::Displacement { state: (i, a), inputs: [(line, b), (level, c)] } => {
                c.mul_add(P::splat(row[*level]), b.mul_add(P::splat(row[*line]), *a * x[i & 63]))
            }
            Signal::Terms { state, rate, inputs, rates } => {
                let mut value = P::zero();
                for (i, a) in state {
                    value = a.mul_add(x[i & 63], value);
                }
                for (i, a) in rate {
                    value = a.mul_add(dx[i & 63], value);
                }
                for (column, a) in inputs {
                    value = a.mul_add(P::splat(row[*column]), value);
                }
                for (column, a) in rates {
                    value = a.mul_add(P::splat(row[1] * row[*column]), value);
                }
                value
            }
            Signal::Guiding(guiding, at) => guiding.force(*at, row, x),
        }
    }
}

impl Group {
    /// Does a creep force saturate or a flange touch anywhere?
    pub fn touches(&self) -> bool {
        self.wheelsets.iter().any(|w| !w.creeps.is_empty() || !w.laws.is_empty())
    }

    #[inline(always)]
    fn passing<'a, P: Part>(&self, at: usize, row: &'a [f64]) -> Passing<'a, P> {
        Passing {
            row,
            speed: P::splat(row[1]) * P::load(&self.speed_scale, at),
            inv_speed: P::splat(1.0 / row[1]) * P::load(&self.inv_speed_scale, at),
        }
    }

    /// Hold own states within their largest magnitude.
    #[inline(always)]
    pub fn settle<P: Part>(&self, at: usize, x: &mut [P; STATES]) {
        for (i, limit) in &self.held {
            x[i & 63] = x[i & 63].clamp(P::load(limit, at));
        }
    }

    /// dx[n ..] = rate of change of velocities and own states under the input row (that of the n positions stands in x),
    /// in one fixed order: K and C, inputs, wheelsets, laws, masses.
    #[inline(always)]
    pub fn rate<P: Part>(&self, at: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let n = self.dofs;
        self.matrix.forces(at, x, row, n, dx);
        if !self.wheelsets.is_empty() {
            let track = self.passing(at, row);
            for wheelset in &self.wheelsets {
                wheelset.add(at, &track, n, x, dx);
            }
        }
        self.act::<P, false>(at, row, x, dx);
        for i in 0..n {
            dx[(n + i) & 63] = dx[(n + i) & 63] * P::load(&self.inv_mass[i], at);
        }
    }

    /// What the track moves of the place where a law stands.
    #[inline(always)]
    pub fn follow<P: Part>(&self, law: &PlacedLaw, at: usize, row: &[f64], z: &mut P, v: &mut P) {
        for (column, a) in &law.inputs {
            *z = P::load(a, at).mul_add(P::splat(row[*column]), *z);
            if law.looks_at_speed {
                *v = P::load(a, at).mul_add(self.passing::<P>(at, row).speed * P::splat(row[column + 1]), *v);
            }
        }
    }

    /// The laws at ports: their forces added to dx[n ..], or the accelerations that they cause.
    #[inline(always)]
    pub fn act<P: Part, const PER_MASS: bool>(&self, at: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let n = self.dofs;
        for law in &self.forces {
            let (mut z, mut v) = (P::zero(), P::zero());
            for (i, a) in &law.row {
                z = P::load(a, at).mul_add(x[i & 63], z);
            }
            if law.looks_at_speed {
                for (i, a) in &law.row {
                    v = P::load(a, at).mul_add(x[(n + i) & 63], v);
                }
            }
            self.follow(law, at, row, &mut z, &mut v);
            let mut own = P::zero();
            let force = law.law.force(law.numbers(at), z, v, row[0], x[law.state & 63], &mut own);
            if law.has_state {
                dx[law.state & 63] = own;
            }
            let force = P::load(&law.alpha, at) * force;
            for (i, a) in if PER_MASS { &law.pushes } else { &law.row } {
                dx[(n + i) & 63] = P::load(a, at).mul_add(force, dx[(n + i) & 63]);
            }
        }
    }
}
