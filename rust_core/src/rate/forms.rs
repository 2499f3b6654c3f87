//! The forms of the rate of change that are compiled on their own: any structure, the plain bogie, fused vehicles.
use crate::effects::port::Port;
use crate::rate::coach;
use crate::rate::fused::FusedVehicle;
use crate::rate::input_table::InputTable;
use crate::rate::suspension::Suspension as Rows;
use crate::simd::{Level, Part, Portable, level};
use crate::vehicle::group::{Contacts, Group, GroupPart, STATES};
use crate::vehicle::plain_bogie::{BogieAtSpeed, DOFS, PlainBogie, Suspension};
use crate::wheel_rail::contact::Contact;

/// The form that the rate of change of a group takes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Choice {
    /// Every structure, and every machine without AVX2.
    General,
    /// A bogie with at most saturation and a stop at its contacts, by what it has of laws there, spin and laws elsewhere.
    Bogie {
        laws: bool,
        spin: bool,
        ports: bool,
    },
    BogieOfAnyContact,
    /// Bodies and elements, or another kind of vehicle, with such contacts; of the size of a coach or of any.
    Fused {
        laws: bool,
        coach: bool,
    },
}

impl Choice {
    /// Of a group on a track that is level or not.
    pub fn of(group: &Group, is_level: bool) -> Self {
        if level() == Level::Portable {
            return Choice::General;
        }
        if let Some(bogie) = &group.plain {
            let (spin, ports) = (bogie.spin || !is_level, group.fully_plain().is_none());
            return Choice::Bogie { laws: bogie.laws, spin, ports };
        }
        if group.suspension.is_some() {
            return Choice::BogieOfAnyContact;
        }
        let Some(contacts) = &group.contacts else { return Choice::General };
        let coach = coach::has_coach_structure(group) && contacts.iter().all(Contact::acts_fully);
        Choice::Fused { laws: group.touches(), coach }
    }

    /// Its name, with what is unrolled of the suspension.
    pub fn name(self, group: &Group) -> &'static str {
        let unrolled = || {
            let contacts = group.contacts.as_ref()?;
            let vehicle = FusedVehicle::<Portable>::new(group, contacts, 0);
            Some(matches!(vehicle.suspension, Rows::Coach(_)))
        };
        match self {
            Choice::General => "general",
            Choice::Bogie { ports: false, .. } => "bogie",
            Choice::Bogie { ports: true, .. } => "bogie with laws at suspensions",
            Choice::BogieOfAnyContact => "bogie with any laws",
            Choice::Fused { coach: true, .. } if unrolled() == Some(true) => "coach",
            Choice::Fused { .. } => "bodies",
        }
    }
}

/// Interleaving of SIMD parts: one after the other, eight lanes at a time where the first cache has no room for more;
/// those of one register in turns, slope by slope; or so that a whole step is straight code, where a rate is short.
pub enum Interleave {
    None,
    Eights,
    Singles,
    Straight,
}

/// A form of the rate of change that is compiled on its own, with its own step loop.
pub trait Form {
    /// Only forms that every machine needs are compiled for those without AVX2: these are slow anyhow.
    const PORTABLE: bool;
    const INTERLEAVE: Interleave = Interleave::None;
    /// The lanes of a group from `at` on.
    fn part<'a, P: Part>(group: &'a Group, inputs: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a;
}

/// A group in the step loop: its size, known when compiled or not, and its rate of change.
pub trait Rate<P: Part> {
    /// Degrees of freedom and states.
    fn size(&self) -> (usize, usize);
    /// Rate at a row of the input table with this index; entries of x behind the states are free.
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]);
}

/// Any structure.
pub struct General;

impl Form for General {
    const PORTABLE: bool = true;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        group.part::<P>(at)
    }
}

impl<P: Part> Rate<P> for GroupPart<'_, P> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.group.dofs, self.group.states)
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        GroupPart::rate(self, index, row, x, dx);
    }
}

/// The bogie whose rate is fused, with or without laws at the contact, with or without spin and cross-level, with or
/// without laws at its suspensions.
pub struct Bogie<const LAWS: bool, const SPIN: bool, const PORTS: bool>;

impl<const LAWS: bool, const SPIN: bool, const PORTS: bool> Form for Bogie<LAWS, SPIN, PORTS> {
    const PORTABLE: bool = false;
    const INTERLEAVE: Interleave = if PORTS { Interleave::Singles } else { Interleave::Straight };

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, inputs: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        let bogie: PlainBogie<P> = group.plain.as_ref().expect("a plain bogie").part::<P, SPIN>(at);
        let at_speed = bogie.at_speed(inputs.row(0)[1]);
        let ports = if PORTS { group.ports(at, |law| &law.pushes) } else { Vec::new() };
        BogiePart::<P, LAWS, SPIN, PORTS> { bogie, ports, states: group.states, at_speed }
    }
}

struct BogiePart<'a, P, const LAWS: bool, const SPIN: bool, const PORTS: bool> {
    bogie: PlainBogie<P>,
    ports: Vec<Port<'a, P>>,
    states: usize,
    at_speed: BogieAtSpeed<P>,
}

impl<P: Part, const LAWS: bool, const SPIN: bool, const PORTS: bool> Rate<P> for BogiePart<'_, P, LAWS, SPIN, PORTS> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (DOFS, if PORTS { self.states } else { 2 * DOFS })
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        if PORTS {
            self.bogie.rate::<LAWS, false, SPIN>(index, row, &mut self.at_speed, x, dx);
            for port in &mut self.ports {
                port.act(index, row, x, dx);
            }
        } else {
            self.bogie.rate::<LAWS, true, SPIN>(index, row, &mut self.at_speed, x, dx);
        }
    }
}

/// The bogie with any laws at its contacts and suspensions.
pub struct BogieOfAnyContact;

impl Form for BogieOfAnyContact {
    const PORTABLE: bool = false;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        let suspension = group.suspension.as_ref().expect("a bogie").part::<P>(at);
        let inv_mass = [2, 3, 4, 5].map(|dof| P::load(&group.inv_mass[dof], at));
        let (contacts, ports) = (Contacts::new(group, at), group.ports(at, |law| &law.pushes));
        AnyContactPart { suspension, inv_mass, contacts, ports, states: group.states }
    }
}

struct AnyContactPart<'a, P> {
    suspension: Suspension<P>,
    inv_mass: [P; 4],
    contacts: Contacts<'a, P>,
    ports: Vec<Port<'a, P>>,
    states: usize,
}

impl<P: Part> Rate<P> for AnyContactPart<'_, P> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (DOFS, self.states)
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        for force in &mut dx[8..12] {
            *force = P::zero();
        }
        self.contacts.add(row, DOFS, x, dx);
        let [leading, trailing] = self.suspension.accelerate(x, dx);
        let ([pull, turn], by_frame) = (self.suspension.own(), [leading[0], leading[1], trailing[0], trailing[1]]);
        for i in 0..4 {
            let sprung = (if i % 2 == 0 { pull } else { turn }).neg_mul_add(x[2 + i], by_frame[i]);
            dx[8 + i] = self.inv_mass[i].mul_add(dx[8 + i], sprung);
        }
        for port in &mut self.ports {
            port.act(index, row, x, dx);
        }
    }
}

/// Another vehicle whose contacts are fused, with or without laws there; of the size of a coach, where saturations act in
/// full, or of any.
pub struct Fused<const LAWS: bool, const COACH: bool>;

impl<const LAWS: bool, const COACH: bool> Form for Fused<LAWS, COACH> {
    const PORTABLE: bool = false;
    const INTERLEAVE: Interleave = if COACH { Interleave::Eights } else { Interleave::None };

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        let contacts = group.contacts.as_ref().expect("fused contacts");
        FusedPart::<P, LAWS, COACH>(FusedVehicle::new(group, contacts, at), group)
    }
}

struct FusedPart<'a, P, const LAWS: bool, const COACH: bool>(FusedVehicle<'a, P>, &'a Group);

impl<P: Part, const LAWS: bool, const COACH: bool> Rate<P> for FusedPart<'_, P, LAWS, COACH> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        if COACH { (coach::DOFS, 2 * coach::DOFS) } else { (self.1.dofs, self.1.states) }
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        self.0.rate::<LAWS, COACH>(index, row, x, dx);
    }
}
