//! The numbers of a plain bogie: suspension and both contacts in one piece, (3.1)-(3.10) of Broersen (1976).
use crate::numeric::sparse_rows::Rows;
use crate::simd::{Lanes, Part, coefficients};
use crate::wheel_rail::coefficients::Contact;

coefficients! {
    /// The suspension of a bogie: accelerations per deflection and speed, the ten different terms of its rows.
    pub struct Suspension {
        /// Of the wheelsets and of the frame by the primary suspension.
        pub(crate) pull,
        pub(crate) frame_pull,
        pub(crate) turn,
        pub(crate) frame_turn,
        pub(crate) frame_lever,
        /// Of the wheelsets per yaw of the frame, by the lever a.
        pub(crate) pull_a,
        /// Of the frame by its own motion: lateral and yaw.
        pub(crate) stiffness,
        pub(crate) damping,
        pub(crate) yaw_stiffness,
        pub(crate) yaw_damping,
    }
}

/// Sixteen bogies, or a part of them, whose effects are saturation and flange contact.
#[derive(Clone, Debug)]
pub struct PlainBogie<T> {
    /// Does a creep force saturate or a flange touch anywhere?
    pub laws: bool,
    /// Has a wheelset roll, spin creep, a contact angle that matters or gyroscopic moments anywhere?
    pub spin: bool,
    pub suspension: Suspension<T>,
    pub(crate) contacts: [Contact<T>; 2],
    pub(crate) speed_scale: T,
    pub(crate) inv_speed_scale: T,
}

/// Degrees of freedom, and those of the frame and of the leading wheelset.
pub const DOFS: usize = 6;
const Y: usize = 0;
const PSI: usize = 1;
const Y_1: usize = 2;
const PSI_1: usize = 3;
/// Columns of a bogie's input table, and those with phi_w and dphi_w/ds of both wheelsets.
pub const BOGIE_COLUMNS: usize = 14;
pub const CROSS_LEVEL: [usize; 4] = [4, 5, 9, 10];

impl Suspension<Lanes> {
    /// From the assembled rows of sixteen bogies.
    pub fn new(matrix: &Rows, inv_mass: &[Lanes]) -> Self {
        // accelerations of one degree of freedom per unit of a state
        let of = |dof: usize, state: usize| {
            let term = matrix.state_of(dof).find(|(place, _)| *place == state);
            Lanes::from_fn(|l| term.map_or(0.0, |(_, a)| a.0[l] * inv_mass[dof].0[l]))
        };
        let minus = |a: Lanes| Lanes(a.0.map(|a| -a));
        Suspension {
            pull: of(Y_1, Y),
            frame_pull: of(Y, Y_1),
            turn: of(PSI_1, PSI),
            frame_turn: of(PSI, PSI_1),
            frame_lever: of(PSI, Y_1),
            pull_a: of(Y_1, PSI),
            stiffness: minus(of(Y, Y)),
            damping: minus(of(Y, DOFS + Y)),
            yaw_stiffness: minus(of(PSI, PSI)),
            yaw_damping: minus(of(PSI, DOFS + PSI)),
        }
    }
}

impl PlainBogie<Lanes> {
    /// From the suspension of sixteen bogies and their contacts, with or without laws at these.
    pub fn new(suspension: Suspension<Lanes>, contacts: &[Contact<Lanes>], laws: bool, speed_scale: &Lanes) -> Self {
        let contact = |i: usize| contacts[i].with_springs(&suspension.pull, &suspension.turn);
        PlainBogie {
            laws,
            spin: !contacts.iter().all(Contact::creeps_alike),
            contacts: [contact(0), contact(1)],
            suspension,
            speed_scale: *speed_scale,
            inv_speed_scale: Lanes::from_fn(|l| 1.0 / speed_scale.0[l]),
        }
    }

    /// Does every saturation act in full?
    pub fn acts_fully(&self) -> bool {
        self.contacts.iter().all(Contact::acts_fully)
    }

    /// The lanes from `at` on, with the constants of a rate with or without `SPIN`.
    #[inline(always)]
    pub fn part<P: Part, const SPIN: bool>(&self, at: usize) -> PlainBogie<P> {
        let contact = |c: &Contact<Lanes>| if SPIN { c.part(at) } else { c.part(at).alike() };
        PlainBogie {
            laws: self.laws,
            spin: self.spin,
            suspension: self.suspension.part(at),
            contacts: [contact(&self.contacts[0]), contact(&self.contacts[1])],
            speed_scale: P::load(&self.speed_scale, at),
            inv_speed_scale: P::load(&self.inv_speed_scale, at),
        }
    }
}
