//! The plain bogie fused: suspension, contact chain, saturation and flange of both wheelsets in one rate.
//!
//! The same equations as the general path, (3.1)-(3.10) of Broersen (1976), with every product of constants made
//! beforehand: creep forces in units of the friction limit mu N, all forces as accelerations.
use crate::lanes::{Lanes, Part};
use crate::wheelset::Wheelset;

/// A wheelset with its saturation and its flange.
#[derive(Clone, Copy, Debug)]
pub struct ContactNumbers {
    pub wheelset: Wheelset,
    /// mu N, or [`NO_LIMIT`].
    pub limit: f64,
    /// Clearance and stiffness of the flange; stiffness 0 where there is none.
    pub clearance: f64,
    pub flange: f64,
}

/// Where nothing saturates: so far above every creep force that the factor is one to the last digit.
pub const NO_LIMIT: f64 = 1e40;

/// One wheelset of sixteen bogies.
#[derive(Clone, Debug)]
struct Contact {
    r: Lanes,
    /// t_x = along_e e + along_turn psi'/V
    along_e: Lanes,
    along_turn: Lanes,
    /// t_y = (across y' + across_turn psi')/V - across_psi psi - across_e e - across_line dy_w - across_roll dphi_w
    across: Lanes,
    across_turn: Lanes,
    across_psi: Lanes,
    across_e: Lanes,
    across_line: Lanes,
    across_roll: Lanes,
    /// t_y of the right wheel is less by this, of the left one more.
    angle: Lanes,
    clearance: Lanes,
    minus_clearance: Lanes,
    /// Accelerations: per phi_w, e, flange deflection, unit of creep force, V psi'.
    gravity: Lanes,
    gravity_e: Lanes,
    flange: Lanes,
    creep: Lanes,
    gyro: Lanes,
    /// Angular accelerations: per unit of creep force, psi, V y'.
    turn: Lanes,
    turn_psi: Lanes,
    turn_gyro: Lanes,
}

/// Sixteen bogies whose effects are saturation and flange contact, whole or absent.
#[derive(Clone, Debug)]
pub struct PlainBogie {
    /// Does a creep force saturate or a flange touch anywhere?
    pub laws: bool,
    /// Has a wheelset roll, spin creep, a contact angle that matters or gyroscopic moments anywhere?
    pub spin: bool,
    a: Lanes,
    /// Accelerations per deflection: of the wheelset and of the frame by the primary suspension.
    pull: Lanes,
    frame_pull: Lanes,
    turn: Lanes,
    frame_turn: Lanes,
    frame_lever: Lanes,
    secondary: [Lanes; 4],
    wheelsets: [Contact; 2],
    speed_scale: Lanes,
    inv_speed_scale: Lanes,
}

/// What depends on the speed: per wheelset t_x per psi', t_y per y' and psi', accelerations per psi' and y'.
#[derive(Clone, Copy)]
pub struct AtSpeed<P> {
    speed: f64,
    wheelsets: [[P; 5]; 2],
}

/// First input column of each wheelset: y_w, dy_w/ds, phi_w, dphi_w/ds, g.
const COLUMNS: [usize; 2] = [2, 7];
/// Columns of a bogie's input table, and those with phi_w and dphi_w/ds of both wheelsets.
pub const BOGIE_COLUMNS: usize = 14;
pub const CROSS_LEVEL: [usize; 4] = [4, 5, 9, 10];

impl PlainBogie {
    /// From the numbers of sixteen bogies in the order of `assemble::BOGIE` and of their contacts.
    pub fn new(numbers: &[&[f64]], contacts: &[[ContactNumbers; 2]], speed_scale: &Lanes, laws: bool) -> Self {
        let lanes = |f: &dyn Fn(&[f64]) -> f64| Lanes::from_fn(|l| f(numbers[l]));
        let contact = |i: usize| {
            // of the wheelset and what divides its creep forces, mass or yaw inertia
            let of = |f: &dyn Fn(&Wheelset, f64) -> f64| {
                Lanes::from_fn(|l| f(&contacts[l][i].wheelset, contacts[l][i].limit))
            };
            let per = |p: usize, f: &dyn Fn(&ContactNumbers, &Wheelset) -> f64| {
                Lanes::from_fn(|l| f(&contacts[l][i], &contacts[l][i].wheelset) / numbers[l][p])
            };
            let (m_a, i_za) = (2, 3);
            let roll = |w: &Wheelset| 1.0 + w.r * w.sigma / w.b;
            let gyro = |w: &Wheelset| w.i_ya * w.sigma / (w.b * w.r);
            Contact {
                r: of(&|w, _| w.r),
                along_e: of(&|w, limit| w.kappa_x * w.n * w.lambda / (w.r * limit)),
                along_turn: of(&|w, limit| w.kappa_x * w.n * w.b / limit),
                across: of(&|w, limit| w.kappa_y * w.n * roll(w) / limit),
                across_turn: of(&|w, limit| w.kappa_s * w.n / limit),
                across_psi: of(&|w, limit| w.kappa_y * w.n / limit),
                across_e: of(&|w, limit| w.kappa_s * w.n * (w.epsilon - w.sigma) / (w.b * w.r * limit)),
                across_line: of(&|w, limit| w.kappa_y * w.n * w.r * w.sigma / (w.b * limit)),
                across_roll: of(&|w, limit| w.kappa_y * w.n * roll(w) * w.r / limit),
                angle: of(&|w, limit| w.kappa_s * w.n * w.delta / (w.r * limit)),
                clearance: Lanes::from_fn(|l| contacts[l][i].clearance),
                minus_clearance: Lanes::from_fn(|l| -contacts[l][i].clearance),
                gravity: per(m_a, &|_, w| 2.0 * w.n),
                gravity_e: per(m_a, &|_, w| 2.0 * w.n * w.epsilon / w.b),
                flange: per(m_a, &|c, _| c.flange),
                creep: per(m_a, &|c, _| c.limit),
                gyro: per(m_a, &|_, w| gyro(w)),
                turn: per(i_za, &|c, w| w.b * c.limit),
                turn_psi: per(i_za, &|_, w| 2.0 * w.b * w.n * w.delta),
                turn_gyro: per(i_za, &|_, w| gyro(w)),
            }
        };
        let yaw = |p: &[f64]| 2.0 * p[11] * p[7] * p[7];
        let plane = |w: &Wheelset| w.sigma == 0.0 && w.kappa_s == 0.0 && w.delta == 0.0;
        PlainBogie {
            laws,
            spin: !contacts.iter().flatten().all(|c| plane(&c.wheelset)),
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
            wheelsets: [contact(0), contact(1)],
            speed_scale: *speed_scale,
            inv_speed_scale: Lanes::from_fn(|l| 1.0 / speed_scale.0[l]),
        }
    }

    #[inline(always)]
    pub fn at_speed<P: Part>(&self, at: usize, speed: f64) -> AtSpeed<P> {
        let g = |l: &Lanes| P::load(l, at);
        let v = P::splat(speed) * g(&self.speed_scale);
        let per_v = P::splat(1.0 / speed) * g(&self.inv_speed_scale);
        let of = |w: &Contact| {
            [
                g(&w.along_turn) * per_v,
                g(&w.across) * per_v,
                g(&w.across_turn) * per_v,
                g(&w.gyro) * v,
                g(&w.turn_gyro) * v,
            ]
        };
        AtSpeed { speed, wheelsets: [of(&self.wheelsets[0]), of(&self.wheelsets[1])] }
    }

    /// dx[6 ..] = accelerations of y, psi, y1, psi1, y2, psi2; x holds positions, then velocities.
    #[inline(always)]
    ///
    /// Without `LAWS` nothing saturates or touches; without `SPIN` both wheels creep alike, on track without cross-level.
    pub fn rate<P: Part, const LAWS: bool, const SPIN: bool>(
        &self,
        at: usize,
        row: &[f64],
        at_speed: &mut AtSpeed<P>,
        x: &[P; 64],
        dx: &mut [P; 64],
    ) {
        if row[1] != at_speed.speed {
            *at_speed = self.at_speed(at, row[1]);
        }
        let g = |l: &Lanes| P::load(l, at);
        let one = P::splat(1.0);
        let arm = g(&self.a) * x[1];
        let near = [x[2] - x[0] - arm, x[4] - x[0] + arm];
        let twist = [x[3] - x[1], x[5] - x[1]];
        let [c_y, k_y, c_psi, k_psi] = &self.secondary;
        dx[6] = g(k_y).neg_mul_add(x[6], g(c_y).neg_mul_add(x[0], g(&self.frame_pull) * (near[0] + near[1])));
        let turning = g(&self.frame_lever).mul_add(near[0] - near[1], g(&self.frame_turn) * (twist[0] + twist[1]));
        dx[7] = g(k_psi).neg_mul_add(x[7], g(c_psi).neg_mul_add(x[1], turning));

        for i in 0..2 {
            let (w, [along, across, across_turn, gyro, turn_gyro]) = (&self.wheelsets[i], at_speed.wheelsets[i]);
            let track = &row[COLUMNS[i]..COLUMNS[i] + 4];
            let (psi, vy, vpsi) = (x[3 + 2 * i], x[8 + 2 * i], x[9 + 2 * i]);
            let phi_w = P::splat(track[2]);
            let mut e = x[2 + 2 * i] - P::splat(track[0]);
            if SPIN {
                e = g(&w.r).neg_mul_add(phi_w, e);
            }

            // creep forces in units of the limit (3.3), (3.5): sum and difference of t_y of both wheels, sum of t_x
            let tx = g(&w.along_e).mul_add(e, along * vpsi);
            let mut ty = g(&w.across_psi).neg_mul_add(psi, across * vy);
            let (sum, difference, pulls);
            if SPIN {
                ty = across_turn.mul_add(vpsi, ty);
                ty = g(&w.across_e).neg_mul_add(e, ty);
                ty = g(&w.across_line).neg_mul_add(P::splat(track[1]), ty);
                ty = g(&w.across_roll).neg_mul_add(P::splat(track[3]), ty);
                let (ty_1, ty_2) = (ty - g(&w.angle), ty + g(&w.angle));
                let [f_1, f_2] = if LAWS { saturation(tx, [ty_1, ty_2]) } else { [one, one] };
                let (g_1, g_2) = (f_1 * ty_1, f_2 * ty_2);
                (sum, difference, pulls) = (g_1 + g_2, g_1 - g_2, (f_1 + f_2) * tx);
            } else {
                let [f] = if LAWS { saturation(tx, [ty]) } else { [one] };
                let f = f + f;
                (sum, difference, pulls) = (f * ty, P::zero(), f * tx);
            }

            // (3.4), (3.10)
            let (mut a_y, mut a_psi) = (P::zero(), P::zero());
            if SPIN {
                a_y = g(&w.gravity) * phi_w;
                a_psi = g(&w.turn).mul_add(difference, g(&w.turn_psi)) * psi;
            }
            a_y = g(&w.gravity_e).neg_mul_add(e, a_y);
            if LAWS {
                let beyond = e - e.min(g(&w.clearance)).max(g(&w.minus_clearance));
                a_y = g(&w.flange).neg_mul_add(beyond, a_y);
            }
            a_y = g(&self.pull).neg_mul_add(near[i], a_y);
            a_psi = g(&self.turn).neg_mul_add(twist[i], a_psi);
            if SPIN {
                (a_y, a_psi) = (gyro.mul_add(vpsi, a_y), turn_gyro.neg_mul_add(vy, a_psi));
            }
            dx[8 + 2 * i] = g(&w.creep).neg_mul_add(sum, a_y);
            dx[9 + 2 * i] = g(&w.turn).neg_mul_add(pulls, a_psi);
        }
    }
}

/// Factors of wheels of one t_x for creep forces in units of the limit: 1 - q/3 + q^2/27 for q < 3, else 1/q.
#[inline(always)]
fn saturation<P: Part, const N: usize>(tx: P, ty: [P; N]) -> [P; N] {
    let (one, nine) = (P::splat(1.0), P::splat(9.0));
    let along = tx * tx;
    // loops, for closures inside array functions would not be compiled for the level
    let (mut square, mut q, mut factor) = (ty, ty, ty);
    let mut largest = one;
    for i in 0..N {
        square[i] = ty[i].mul_add(ty[i], along);
        q[i] = square[i].sqrt();
        factor[i] = q[i].mul_add(P::splat(-1.0 / 3.0), square[i].mul_add(P::splat(1.0 / 27.0), one));
        largest = if i == 0 { square[0] } else { largest.max(square[i]) };
    }
    // full sliding is rare: its divisions are made only where a lane slides
    if largest.any_from(nine) {
        for i in 0..N {
            factor[i] = square[i].if_less(nine, factor[i], one / q[i].max(one));
        }
    }
    factor
}
