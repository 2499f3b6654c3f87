//! The plain bogie fused: suspension and both contacts in one rate, (3.1)-(3.10) of Broersen (1976).
use crate::contact::{AtSpeed, Contact, ContactNumbers, Slopes};
use crate::lanes::{Lanes, Part};
use crate::wheelset::Motion;

/// Sixteen bogies, or a part of them, whose effects are saturation and flange contact, whole or absent.
#[derive(Clone, Debug)]
pub struct PlainBogie<T> {
    /// Does a creep force saturate or a flange touch anywhere?
    pub laws: bool,
    /// Has a wheelset roll, spin creep, a contact angle that matters or gyroscopic moments anywhere?
    pub spin: bool,
    a: T,
    /// Accelerations per deflection: of the wheelset and of the frame by the primary suspension.
    pull: T,
    frame_pull: T,
    turn: T,
    frame_turn: T,
    frame_lever: T,
    secondary: [T; 4],
    contacts: [Contact<T>; 2],
    speed_scale: T,
    inv_speed_scale: T,
}

/// What depends on the speed [m/s] of the input table.
#[derive(Clone, Copy)]
pub struct BogieAtSpeed<P> {
    speed: f64,
    contacts: [AtSpeed<P>; 2],
}

/// First input column of each wheelset: y_w, dy_w/ds, phi_w, dphi_w/ds, g.
const COLUMNS: [usize; 2] = [2, 7];
/// Columns of a bogie's input table, and those with phi_w and dphi_w/ds of both wheelsets.
pub const BOGIE_COLUMNS: usize = 14;
pub const CROSS_LEVEL: [usize; 4] = [4, 5, 9, 10];

impl PlainBogie<Lanes> {
    /// From the numbers of sixteen bogies in the order of `assemble::BOGIE` and of their contacts.
    pub fn new(numbers: &[&[f64]], contacts: &[Vec<ContactNumbers>], speed_scale: &Lanes, laws: bool) -> Self {
        let lanes = |f: &dyn Fn(&[f64]) -> f64| Lanes::from_fn(|l| f(numbers[l]));
        let yaw = |p: &[f64]| 2.0 * p[11] * p[7] * p[7];
        let plane = |c: &ContactNumbers| [c.wheelset.sigma, c.wheelset.kappa_s, c.wheelset.delta] == [0.0; 3];
        PlainBogie {
            laws,
            spin: !contacts.iter().flatten().all(plane),
            a: lanes(&|p| p[5]),
            pull: lanes(&|p| 2.0 * p[10] / p[2]),
            frame_pull: lanes(&|p| 2.0 * p[10] / p[0]),
            turn: lanes(&|p| yaw(p) / p[3]),
            frame_turn: lanes(&|p| yaw(p) / p[1]),
            frame_lever: lanes(&|p| 2.0 * p[10] * p[5] / p[1]),
            secondary: [
                lanes(&|p| p[12] / p[0]),
                lanes(&|p| p[14] / p[0]),
                lanes(&|p| p[13] / p[1]),
                lanes(&|p| p[15] / p[1]),
            ],
            contacts: [Contact::new(&contacts[0]), Contact::new(&contacts[1])],
            speed_scale: *speed_scale,
            inv_speed_scale: Lanes::from_fn(|l| 1.0 / speed_scale.0[l]),
        }
    }

    /// The lanes from `at` on.
    #[inline(always)]
    pub fn part<P: Part>(&self, at: usize) -> PlainBogie<P> {
        let g = |l: &Lanes| P::load(l, at);
        let [c_y, k_y, c_psi, k_psi] = &self.secondary;
        PlainBogie {
            laws: self.laws,
            spin: self.spin,
            a: g(&self.a),
            pull: g(&self.pull),
            frame_pull: g(&self.frame_pull),
            turn: g(&self.turn),
            frame_turn: g(&self.frame_turn),
            frame_lever: g(&self.frame_lever),
            secondary: [g(c_y), g(k_y), g(c_psi), g(k_psi)],
            contacts: [self.contacts[0].part(at), self.contacts[1].part(at)],
            speed_scale: g(&self.speed_scale),
            inv_speed_scale: g(&self.inv_speed_scale),
        }
    }
}

impl<P: Part> PlainBogie<P> {
    #[inline(always)]
    pub fn at_speed(&self, speed: f64) -> BogieAtSpeed<P> {
        let v = P::splat(speed) * self.speed_scale;
        let per_v = P::splat(1.0 / speed) * self.inv_speed_scale;
        let [leading, trailing] = &self.contacts;
        BogieAtSpeed { speed, contacts: [leading.at_speed(v, per_v), trailing.at_speed(v, per_v)] }
    }

    /// dx[6 ..] = accelerations of y, psi, y1, psi1, y2, psi2; x holds positions, then velocities.
    ///
    /// Without `LAWS` nothing saturates or touches; without `SPIN` both wheels creep alike, on track without cross-level.
    #[inline(always)]
    pub fn rate<const LAWS: bool, const SPIN: bool>(
        &self,
        row: &[f64],
        at_speed: &mut BogieAtSpeed<P>,
        x: &[P; 64],
        dx: &mut [P; 64],
    ) {
        if row[1] != at_speed.speed {
            *at_speed = self.at_speed(row[1]);
        }
        let arm = self.a * x[1];
        let near = [x[2] - x[0] - arm, x[4] - x[0] + arm];
        let twist = [x[3] - x[1], x[5] - x[1]];
        let [c_y, k_y, c_psi, k_psi] = &self.secondary;
        dx[6] = k_y.neg_mul_add(x[6], c_y.neg_mul_add(x[0], self.frame_pull * (near[0] + near[1])));
        let turning = self.frame_lever.mul_add(near[0] - near[1], self.frame_turn * (twist[0] + twist[1]));
        dx[7] = k_psi.neg_mul_add(x[7], c_psi.neg_mul_add(x[1], turning));

        for i in 0..2 {
            let (w, at_speed) = (&self.contacts[i], &at_speed.contacts[i]);
            let track = &row[COLUMNS[i]..COLUMNS[i] + 4];
            let (psi, vy, vpsi) = (x[3 + 2 * i], x[8 + 2 * i], x[9 + 2 * i]);
            let phi_w = P::splat(track[2]);
            let mut e = x[2 + 2 * i] - P::splat(track[0]);
            let mut a_y = P::zero();
            if SPIN {
                e = w.r.neg_mul_add(phi_w, e);
                a_y = w.gravity * phi_w;
            }
            let motion = Motion { y: e, psi, vy, vpsi };
            let slip = w.slip::<SPIN>(at_speed, &motion, Slopes(track[1], track[3]));
            let mut touch = w.touch::<LAWS, SPIN>(&slip, slip.factors::<LAWS, SPIN>(), psi, a_y);
            touch.a_y = self.pull.neg_mul_add(near[i], touch.a_y);
            touch.a_psi = self.turn.neg_mul_add(twist[i], touch.a_psi);
            [dx[8 + 2 * i], dx[9 + 2 * i]] = w.creep::<SPIN>(at_speed, touch, vy, vpsi);
        }
    }
}
