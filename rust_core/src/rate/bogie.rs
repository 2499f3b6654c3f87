//! The rates of a bogie, (3.1)-(3.10) of Broersen (1976): in one piece, and with any laws at its contacts.
use crate::effects::port::{self, Port};
use crate::rate::Rate;
use crate::simd::{Part, STATES};
use crate::vehicle::plain_bogie::{DOFS, PlainBogie, Suspension};
use crate::wheel_rail::contact::{AtSpeed, Displacement, Motion, under};
use crate::wheel_rail::wheelset::Contacts;

/// First input column of each wheelset: y_w, dy_w/ds, phi_w, dphi_w/ds, g.
const COLUMNS: [usize; 2] = [2, 7];

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

pub(super) struct BogiePart<'a, P, const LAWS: bool, const SPIN: bool, const PORTS: bool> {
    pub(super) bogie: PlainBogie<P>,
    pub(super) ports: Vec<Port<'a, P>>,
    pub(super) states: usize,
    pub(super) at_speed: BogieAtSpeed<P>,
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
            port::act(&mut self.ports, index, row, x, dx);
        } else {
            self.bogie.rate::<LAWS, true, SPIN>(index, row, &mut self.at_speed, x, dx);
        }
    }
}

pub(super) struct AnyContactPart<'a, P> {
    pub(super) suspension: Suspension<P>,
    /// Of the wheelsets.
    pub(super) inv_mass: [P; 4],
    pub(super) contacts: Contacts<'a, P>,
    pub(super) ports: Vec<Port<'a, P>>,
    pub(super) states: usize,
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
        port::act(&mut self.ports, index, row, x, dx);
    }
}
