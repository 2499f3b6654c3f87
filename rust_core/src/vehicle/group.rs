//! A group of sixteen vehicles of one structure: the rate of change of its state.
use crate::effects::PlacedLaw;
use crate::effects::effect::Alteration;
use crate::effects::port::Port;
use crate::numeric::sparse_rows::Rows;
use crate::simd::{Lanes, Part, Work};
use crate::vehicle::channels::Reading;
use crate::vehicle::plain_bogie::{PlainBogie, Suspension};
use crate::wheel_rail::contact::{AtSpeed, Contact};
use crate::wheel_rail::wheelset::{Passing, WheelsetLanes};

pub use crate::numeric::place::STATES;

/// Input of the step loop: sixteen vehicles of one structure.
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
    /// Set where the structure is a bogie that the track moves through its contacts alone.
    pub suspension: Option<Suspension<Lanes>>,
    /// Set where another structure has no more at its contacts than that.
    pub contacts: Option<Vec<Contact<Lanes>>>,
    /// Own states that are clamped to a largest magnitude at the end of every step.
    pub clamped_states: Vec<(usize, Lanes)>,
    /// Contribution of the load transfer to the guiding forces of every wheelset; without terms where nothing rolls.
    pub leaning: Vec<Reading>,
    pub readings: Vec<Reading>,
    /// Sensor laws: what they alter, the channel, its number times the amount.
    pub sensors: Vec<(Alteration, String, Lanes)>,
}

impl Group {
    /// Does a creep force saturate or a flange touch anywhere?
    pub fn touches(&self) -> bool {
        self.wheelsets.iter().any(|w| !w.creeps.is_empty() || !w.laws.is_empty())
    }

    /// The plain bogie, where nothing acts except its contacts and these act in full.
    pub fn fully_plain(&self) -> Option<&PlainBogie<Lanes>> {
        self.plain.as_ref().filter(|bogie| bogie.acts_fully() && self.forces.is_empty())
    }

    /// Hold own states within their largest magnitude.
    #[inline(always)]
    pub fn clamp_own_states<P: Part>(&self, at: usize, x: &mut [P; STATES]) {
        for (i, limit) in &self.clamped_states {
            x[i & 63] = x[i & 63].clamp(P::load(limit, at));
        }
    }

    /// The lanes from `at` on, in the form of any structure.
    #[inline(always)]
    pub fn part<P: Part>(&self, at: usize) -> GroupPart<'_, P> {
        GroupPart { group: self, at, contacts: Contacts::new(self, at), ports: self.ports(at, |law| &law.reaction) }
    }

    /// The laws at ports, whose forces go to `pushes`.
    #[inline(always)]
    pub fn ports<P: Part>(&self, at: usize, pushes: fn(&PlacedLaw) -> &[(usize, Lanes)]) -> Vec<Port<'_, P>> {
        self.forces.iter().map(|law| Port::new(law, pushes(law), self.dofs, &self.speed_scale, at)).collect()
    }
}

/// The contacts of a part of the lanes with any laws, at the present speed.
pub struct Contacts<'a, P> {
    wheelsets: &'a [WheelsetLanes],
    at: usize,
    terms: Vec<(Contact<P>, AtSpeed<P>)>,
    /// Speed of the last row of the input table, and that of the lanes.
    row_speed: f64,
    speed: P,
    /// Share of the speed, and its inverse.
    scales: [P; 2],
}

impl<'a, P: Part> Contacts<'a, P> {
    #[inline(always)]
    pub fn new(group: &'a Group, at: usize) -> Self {
        Contacts {
            wheelsets: &group.wheelsets,
            at,
            terms: group.wheelsets.iter().map(|wheelset| wheelset.contact(at)).collect(),
            row_speed: f64::NAN,
            speed: P::zero(),
            scales: [P::load(&group.speed_scale, at), P::load(&group.inv_speed_scale, at)],
        }
    }

    #[inline(always)]
    fn set_speed(&mut self, speed: f64) {
        let [share, inv_share] = self.scales;
        (self.row_speed, self.speed) = (speed, P::splat(speed) * share);
        let inv_speed = P::splat(1.0 / speed) * inv_share;
        for (contact, at_speed) in &mut self.terms {
            *at_speed = contact.at_speed(self.speed, inv_speed);
        }
    }

    /// Adds the contact forces to those of the n degrees of freedom in dx, and rates of the rails that yield.
    #[inline(always)]
    pub fn add(&mut self, row: &[f64], n: usize, x: &[P; STATES], dx: &mut [P; STATES]) {
        if row[1] != self.row_speed {
            self.set_speed(row[1]);
        }
        let (at, track) = (self.at, &Passing { row, speed: self.speed });
        for (wheelset, contact) in self.wheelsets.iter().zip(&self.terms) {
            P::out_of_line(Touching { wheelset, at, contact, track, n, x, dx });
        }
    }
}

struct Touching<'l, P> {
    wheelset: &'l WheelsetLanes,
    at: usize,
    contact: &'l (Contact<P>, AtSpeed<P>),
    track: &'l Passing<'l, P>,
    n: usize,
    x: &'l [P; STATES],
    dx: &'l mut [P; STATES],
}

impl<P: Part> Work for Touching<'_, P> {
    #[inline(always)]
    fn run(self) {
        self.wheelset.add(self.at, self.contact, self.track, self.n, self.x, self.dx);
    }
}

/// A part of the lanes of a group of any structure.
pub struct GroupPart<'a, P> {
    pub group: &'a Group,
    at: usize,
    contacts: Contacts<'a, P>,
    ports: Vec<Port<'a, P>>,
}

impl<P: Part> GroupPart<'_, P> {
    /// dx[n ..] = rate of change of velocities and own states under the input row of this index (that of the n positions
    /// is part of x), in one fixed order: K and C, inputs, wheelsets, laws, masses.
    #[inline(always)]
    pub fn rate(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let (group, at, n) = (self.group, self.at, self.group.dofs);
        group.matrix.forces(at, x, row, n, dx);
        self.contacts.add(row, n, x, dx);
        for port in &mut self.ports {
            port.act(index, row, x, dx);
        }
        for i in 0..n {
            dx[(n + i) & 63] = dx[(n + i) & 63] * P::load(&group.inv_mass[i], at);
        }
    }
}
