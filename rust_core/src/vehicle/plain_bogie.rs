//! The plain bogie fused: suspension and both contacts in one rate, (3.1)-(3.10) of Broersen (1976).
use crate::numeric::place::STATES;
use crate::numeric::sparse_rows::Rows;
use crate::simd::{Lanes, Part, coefficients};
use crate::wheel_rail::contact::{AtSpeed, Contact, Displacement, Motion, under};

coefficients! {
    /// The suspension of a bogie: accelerations per deflection and speed, the ten different terms of its rows.
    pub struct Suspension {
        /// Of the wheelsets and of the frame by the primary suspension.
        pull,
        frame_pull,
        turn,
        frame_turn,
        frame_lever,
        /// Of the wheelsets per yaw of the frame, by the lever a.
        pull_a,
        /// Of the frame by its own motion: lateral and yaw.
        stiffness,
        damping,
        yaw_stiffness,
        yaw_damping,
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
    contacts: [Contact<T>; 2],
    speed_scale: T,
    inv_speed_scale: T,
}

/// Terms that depend on the speed [m/s] of the input table.
#[derive(Clone, Copy)]
pub struct BogieAtSpeed<P> {
    speed: f64,
    contacts: [AtSpeed<P>; 2],
    prepared_at: usize,
    prepared: [PreparedRow<P>; 2],
}

/// Forces on a wheelset by the track alone.
#[derive(Clone, Copy)]
struct PreparedRow<P> {
    /// y_w + r phi_w
    line: P,
    /// Contribution of its slopes to t_y.
    slopes: P,
    /// The acceleration by gravitation, and by the springs of a wheelset on the centre line.
    push: P,
}

/// Degrees of freedom, and those of the frame and of the leading wheelset.
pub const DOFS: usize = 6;
const Y: usize = 0;
const PSI: usize = 1;
const Y_1: usize = 2;
const PSI_1: usize = 3;
/// First input column of each wheelset: y_w, dy_w/ds, phi_w, dphi_w/ds, g.
const COLUMNS: [usize; 2] = [2, 7];
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

impl<P: Part> Suspension<P> {
    /// Of a wheelset by its own motion, opposite to it: lateral, yaw.
    #[inline(always)]
    pub fn own(&self) -> [P; 2] {
        [self.pull, self.turn]
    }

    /// dx of the frame, and accelerations of the wheelsets by its motion: lateral, yaw.
    #[inline(always)]
    pub fn accelerate(&self, x: &[P; STATES], dx: &mut [P; STATES]) -> [[P; 2]; 2] {
        let by_y = self.frame_pull * (x[2] + x[4]);
        dx[6] = self.damping.neg_mul_add(x[6], self.stiffness.neg_mul_add(x[0], by_y));
        let turning = self.frame_lever.mul_add(x[2] - x[4], self.frame_turn * (x[3] + x[5]));
        dx[7] = self.yaw_damping.neg_mul_add(x[7], self.yaw_stiffness.neg_mul_add(x[1], turning));
        let (pull, turn) = (self.pull * x[0], self.turn * x[1]);
        [[self.pull_a.mul_add(x[1], pull), turn], [self.pull_a.neg_mul_add(x[1], pull), turn]]
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

impl<P: Part> PlainBogie<P> {
    #[inline(always)]
    pub fn at_speed(&self, speed: f64) -> BogieAtSpeed<P> {
        let v = P::splat(speed) * self.speed_scale;
        let per_v = P::splat(1.0 / speed) * self.inv_speed_scale;
        let [leading, trailing] = &self.contacts;
        let prepared = [PreparedRow { line: P::zero(), slopes: P::zero(), push: P::zero() }; 2];
        BogieAtSpeed {
            speed,
            contacts: [leading.at_speed(v, per_v), trailing.at_speed(v, per_v)],
            prepared_at: usize::MAX,
            prepared,
        }
    }

    /// Once per row of the input table: RK4 asks twice for most.
    // adapters of the library need not be compiled for the level: a plain loop over indices is
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn prepare_row<const SPIN: bool>(&self, index: usize, row: &[f64], at: &mut BogieAtSpeed<P>) {
        if row[1] != at.speed {
            *at = self.at_speed(row[1]);
        }
        at.prepared_at = index;
        for i in 0..2 {
            let (w, track) = (&self.contacts[i], under(row, COLUMNS[i]));
            let (mut line, mut push, mut slopes) = (track[0], P::zero(), P::zero());
            if SPIN {
                (line, push, slopes) = (w.line(&track), w.gravity * track[2], w.by_slopes(&track));
            }
            push = self.suspension.pull.neg_mul_add(line, push);
            at.prepared[i] = PreparedRow { line, slopes, push };
        }
    }

    /// dx[6 ..] = accelerations of y, psi, y1, psi1, y2, psi2; x holds positions, then velocities.
    ///
    /// Without `LAWS` nothing saturates or touches, with `WHOLE` saturations act in full; without `SPIN` both wheels creep
    /// alike, on track without cross-level.
    #[inline(always)]
    pub fn rate<const LAWS: bool, const WHOLE: bool, const SPIN: bool>(
        &self,
        index: usize,
        row: &[f64],
        at: &mut BogieAtSpeed<P>,
        x: &[P; STATES],
        dx: &mut [P; STATES],
    ) {
        if index != at.prepared_at {
            self.prepare_row::<SPIN>(index, row, at);
        }
        let [leading, trailing] = &self.contacts;
        let [by_1, by_2] = &at.contacts;
        let [prepared_1, prepared_2] = &at.prepared;
        let m_1 = Motion { y: x[2] - prepared_1.line, psi: x[3], vy: x[8], vpsi: x[9] };
        let m_2 = Motion { y: x[4] - prepared_2.line, psi: x[5], vy: x[10], vpsi: x[11] };
        let slip_1 = leading.slip::<SPIN>(by_1, &Displacement::linear(m_1.y), &m_1, prepared_1.slopes);
        let slip_2 = trailing.slip::<SPIN>(by_2, &Displacement::linear(m_2.y), &m_2, prepared_2.slopes);
        let factors_1 = leading.factors::<LAWS, WHOLE, SPIN>(&slip_1);
        let factors_2 = trailing.factors::<LAWS, WHOLE, SPIN>(&slip_2);

        let [[a_y1, turn_1], [a_y2, turn_2]] = self.suspension.accelerate(x, dx);
        let given = [a_y1 + prepared_1.push, turn_1];
        [dx[8], dx[9]] = leading.touch::<LAWS, SPIN>(by_1, &m_1, &slip_1, factors_1, given);
        let given = [a_y2 + prepared_2.push, turn_2];
        [dx[10], dx[11]] = trailing.touch::<LAWS, SPIN>(by_2, &m_2, &slip_2, factors_2, given);
    }
}
