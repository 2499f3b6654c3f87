//! The forms of the rate of change that are compiled on their own: any structure, the plain bogie, fused vehicles.
use crate::rate::Rate;
use crate::rate::accelerations::Accelerations;
use crate::rate::bogie::{AnyContactPart, BogiePart};
use crate::rate::fused::Structure;
use crate::rate::general::GroupPart;
use crate::rate::input_table::InputTable;
use crate::rate::structures::KNOWN;
use crate::simd::{LANES, Level, Part, level};
use crate::vehicle::group::Group;
use crate::vehicle::plain_bogie::PlainBogie;
use crate::wheel_rail::coefficients::Contact;
use std::marker::PhantomData;

/// The form that the rate of change of a group takes.
pub enum Choice<'a> {
    /// Every structure, and every machine without AVX2.
    General,
    /// A bogie with at most saturation and a stop at its contacts, by what it has of laws there, spin and laws elsewhere.
    Bogie {
        laws: bool,
        spin: bool,
        ports: bool,
    },
    BogieOfAnyContact,
    /// Bodies and elements, or another kind of vehicle, with such contacts, with or without laws there.
    Fused {
        laws: bool,
        accelerations: Box<Accelerations<'a>>,
    },
}

impl<'a> Choice<'a> {
    /// Of a group on a track that is level or not.
    pub fn of(group: &'a Group, is_level: bool) -> Self {
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
        let mut accelerations = Accelerations::of(group, contacts);
        // known structures are compiled for saturations that act in full
        accelerations.known = accelerations.known.filter(|_| contacts.iter().all(Contact::acts_fully));
        Choice::Fused { laws: group.touches(), accelerations: accelerations.into() }
    }

    /// Is a step straight code without a call?
    pub fn is_straight(&self) -> bool {
        matches!(self, Choice::Bogie { ports: false, .. })
    }

    /// Its name, that of the structure where it is known.
    pub fn name(&self) -> &'static str {
        match self {
            Choice::General => "general",
            Choice::Bogie { ports: false, .. } => "bogie",
            Choice::Bogie { ports: true, .. } => "bogie with laws at suspensions",
            Choice::BogieOfAnyContact => "bogie with any laws",
            Choice::Fused { accelerations, .. } => accelerations.known.map_or("bodies", |i| KNOWN[i].name),
        }
    }
}

/// Interleaving of SIMD parts: one after the other, eight lanes at a time where the first cache has no room for more;
/// or two of one register each in turns, a whole step in straight code, where a rate is short.
pub enum Interleave {
    None,
    Eights,
    Straight,
}

/// A form of the rate of change that is compiled on its own, with its own step loop.
pub trait Form {
    /// Only forms that every machine needs are compiled for those without AVX2: these are slow anyhow.
    const PORTABLE: bool;
    const INTERLEAVE: Interleave = Interleave::None;
    /// The lanes of a group from `at` on.
    fn part<'a, P: Part>(
        group: &'a Group,
        choice: &'a Choice<'a>,
        inputs: &InputTable<'_>,
        at: usize,
    ) -> impl Rate<P> + 'a;
}

/// Any structure.
pub struct General;

impl Form for General {
    const PORTABLE: bool = true;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &'a Choice<'a>, _: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        GroupPart::<P>::new(group, at)
    }
}

/// The bogie whose rate is fused, with or without laws at the contact, with or without spin and cross-level, with or
/// without laws at its suspensions.
pub struct Bogie<const LAWS: bool, const SPIN: bool, const PORTS: bool>;

impl<const LAWS: bool, const SPIN: bool, const PORTS: bool> Form for Bogie<LAWS, SPIN, PORTS> {
    const PORTABLE: bool = false;
    const INTERLEAVE: Interleave = if PORTS { Interleave::None } else { Interleave::Straight };

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &'a Choice<'a>, inputs: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        let bogie: PlainBogie<P> = group.plain.as_ref().expect("a plain bogie").part::<P, SPIN>(at);
        let at_speed = bogie.at_speed(inputs.row(0)[1]);
        let ports = if PORTS { group.ports(at, |law| &law.pushes) } else { Vec::new() };
        BogiePart::<P, LAWS, SPIN, PORTS> { bogie, ports, states: group.states, at_speed }
    }
}

/// The bogie with any laws at its contacts and suspensions.
pub struct BogieOfAnyContact;

impl Form for BogieOfAnyContact {
    const PORTABLE: bool = false;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &'a Choice<'a>, _: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        let suspension = group.suspension.as_ref().expect("a bogie").part::<P>(at);
        let inv_mass = [2, 3, 4, 5].map(|dof| P::load(&group.inv_mass[dof], at));
        let (contacts, ports) = (group.contacts(at), group.ports(at, |law| &law.pushes));
        AnyContactPart { suspension, inv_mass, contacts, ports, states: group.states }
    }
}

/// Another vehicle whose contacts are fused, with or without laws there, in a structure.
pub struct Fused<const LAWS: bool, S>(PhantomData<S>);

impl<const LAWS: bool, S: Structure + 'static> Form for Fused<LAWS, S> {
    const PORTABLE: bool = false;
    const INTERLEAVE: Interleave = match S::SIZE {
        Some((_, states)) if states > LANES => Interleave::Eights,
        _ => Interleave::None,
    };

    #[inline(always)]
    fn part<'a, P: Part>(_: &'a Group, choice: &'a Choice<'a>, _: &InputTable<'_>, at: usize) -> impl Rate<P> + 'a {
        let Choice::Fused { accelerations, .. } = choice else { unreachable!("a form of its own") };
        accelerations.part::<P, LAWS, S>(at)
    }
}
