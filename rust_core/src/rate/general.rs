//! The rate of a vehicle of any structure with any laws.
use crate::effects::port::{self, Port};
use crate::rate::Rate;
use crate::simd::{Part, STATES};
use crate::vehicle::group::Group;
use crate::wheel_rail::wheelset::Contacts;

/// A part of the lanes of a group of any structure.
pub struct GroupPart<'a, P> {
    group: &'a Group,
    at: usize,
    contacts: Contacts<'a, P>,
    ports: Vec<Port<'a, P>>,
}

impl<'a, P: Part> GroupPart<'a, P> {
    #[inline(always)]
    pub fn new(group: &'a Group, at: usize) -> Self {
        GroupPart { group, at, contacts: group.contacts(at), ports: group.ports(at, |law| &law.reaction) }
    }
}

impl<P: Part> Rate<P> for GroupPart<'_, P> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.group.dofs, self.group.states)
    }

    /// dx[n ..] = rate of change of velocities and own states under the input row of this index (that of the n positions
    /// is part of x), in one fixed order: K and C, inputs, wheelsets, laws, masses.
    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &mut [P; STATES], dx: &mut [P; STATES]) {
        let (group, at, n) = (self.group, self.at, self.group.dofs);
        group.matrix.forces(at, x, row, n, dx);
        self.contacts.add(row, n, x, dx);
        port::act(&mut self.ports, index, row, x, dx);
        for i in 0..n {
            dx[(n + i) % STATES] = dx[(n + i) % STATES] * P::load(&group.inv_mass[i], at);
        }
    }
}
