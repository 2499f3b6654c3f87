//! The forms of the rate of change that are compiled on their own: any structure, the plain bogie, fused vehicles.
use crate::rate::coach;
use crate::rate::fused::FusedVehicle;
use crate::rate::input_table::InputTable;
use crate::simd::Part;
use crate::vehicle::group::{Group, GroupPart, STATES};
use crate::vehicle::plain_bogie::{BogieAtSpeed, PlainBogie};
use crate::vehicle::port::Port;

/// Interleaving of SIMD parts: one after the other, eight lanes at a time where the first cache has no room for more;
/// those of one register in turns, slope by slope; or so that a whole step is straight code, where a rate is short.
pub enum Interleave {
    None,
    Eights,
    Singles,
    UnrolledRows,
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
    fn rate(&mut self, _: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        GroupPart::rate(self, row, x, dx);
    }
}

/// The bogie whose rate is fused, with or without laws at the contact, with or without spin and cross-level, with or
/// without laws at its suspensions.
pub struct Bogie<const LAWS: bool, const SPIN: bool, const PORTS: bool>;

impl<const LAWS: bool, const SPIN: bool, const PORTS: bool> Form for Bogie<LAWS, SPIN, PORTS> {
    const PORTABLE: bool = false;
    const INTERLEAVE: Interleave = if PORTS { Interleave::Singles } else { Interleave::UnrolledRows };

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
        (6, if PORTS { self.states } else { 12 })
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        if PORTS {
            self.bogie.rate::<LAWS, false, SPIN>(index, row, &mut self.at_speed, x, dx);
            for port in &self.ports {
                port.act(6, row, x, dx);
            }
        } else {
            self.bogie.rate::<LAWS, true, SPIN>(index, row, &mut self.at_speed, x, dx);
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
