//! The fused contact of one wheelset: gravitation, saturated creep forces and flange as accelerations.
//!
//! The same equations as in wheelset.rs, (3.2)-(3.10) of Broersen (1976), with every product of constants made
//! beforehand: creep forces in units of the friction limit mu N, all forces as accelerations.
use crate::simd::{Lanes, Part};
use crate::wheel_rail::wheelset::{Motion, Wheelset};

/// A wheelset with its saturation and its flange.
#[derive(Clone, Copy, Debug)]
pub struct ContactNumbers {
    pub wheelset: Wheelset,
    /// Mass and yaw inertia of the wheelset.
    pub mass: [f64; 2],
    /// mu N, or [`NO_LIMIT`], and how much of it acts.
    pub limit: f64,
    pub share: f64,
    /// Clearance and stiffness of the flange; stiffness 0 where there is none.
    pub clearance: f64,
    pub flange: f64,
}

/// Limit where nothing saturates: so far above every creep force that the factor is one to the last digit.
pub const NO_LIMIT: f64 = 1e40;

/// The contact of one wheelset of sixteen vehicles, or of a part of them.
#[derive(Clone, Debug, PartialEq)]
pub struct Contact<T> {
    r: T,
    /// t_x = along_e e + along_turn psi'/V
    along_e: T,
    along_turn: T,
    /// t_y = (across y' + across_turn psi')/V - across_psi psi - across_e e - across_line dy_w - across_roll dphi_w
    across: T,
    across_turn: T,
    across_psi: T,
    across_e: T,
    across_line: T,
    across_roll: T,
    /// t_y of the right wheel is less by this, of the left one more.
    angle: T,
    /// Of the saturation, how much of it acts, and a third of that.
    share: T,
    share_third: T,
    clearance: T,
    minus_clearance: T,
    /// Accelerations: per phi_w, e (by gravitation and what springs of [`Contact::with_springs`] add), flange deflection, unit of
    /// creep force, V psi'.
    pub gravity: T,
    gravity_e: T,
    flange: T,
    creep: T,
    gyro: T,
    /// Angular accelerations: per unit of creep force, psi (by the contact angle, less what springs of [`Contact::with_springs`]
    /// take off), V y'.
    turn: T,
    turn_psi: T,
    turn_gyro: T,
}

/// The track under a wheelset: y_w, dy_w/ds, phi_w, dphi_w/ds from this column of the input table on.
#[inline(always)]
pub fn under<P: Part>(row: &[f64], column: usize) -> [P; 4] {
    let track = &row[column..column + 4];
    [P::splat(track[0]), P::splat(track[1]), P::splat(track[2]), P::splat(track[3])]
}

/// Terms that depend on the speed: t_x per psi', t_y per y' and psi', accelerations per psi' and y'.
#[derive(Clone, Copy)]
pub struct AtSpeed<P> {
    along: P,
    across: P,
    across_turn: P,
    gyro: P,
    turn_gyro: P,
}

/// e, and the creep forces of the linear law: t_x, t_y of the right and the left wheel.
#[derive(Clone, Copy)]
pub struct Slip<P> {
    e: P,
    tx: P,
    ty: [P; 2],
}

impl Contact<Lanes> {
    /// From the contacts of sixteen vehicles.
    pub fn new(of: &[ContactNumbers]) -> Self {
        let of: Vec<_> = of.iter().map(|c| ContactNumbers { limit: UNIT * c.limit, ..*c }).collect();
        let lanes = |f: &dyn Fn(&Wheelset, &ContactNumbers) -> f64| Lanes::from_fn(|l| f(&of[l].wheelset, &of[l]));
        let roll = |w: &Wheelset| 1.0 + w.r * w.sigma / w.b;
        let gyro = |w: &Wheelset| w.i_ya * w.sigma / (w.b * w.r);
        Contact {
            r: lanes(&|w, _| w.r),
            along_e: lanes(&|w, c| w.kappa_x * w.n * w.lambda / (w.r * c.limit)),
            along_turn: lanes(&|w, c| w.kappa_x * w.n * w.b / c.limit),
            across: lanes(&|w, c| w.kappa_y * w.n * roll(w) / c.limit),
            across_turn: lanes(&|w, c| w.kappa_s * w.n / c.limit),
            across_psi: lanes(&|w, c| w.kappa_y * w.n / c.limit),
            across_e: lanes(&|w, c| {
                w.kappa_s * w.n * (w.epsilon - w.sigma) / (w.b * w.r * c.limit)
                    + w.kappa_s * w.n * w.epsilon * w.roller / (w.b * c.limit)
            }),
            across_line: lanes(&|w, c| {
                w.kappa_y * w.n * w.r * w.sigma / (w.b * c.limit) + w.moves_with_rails() * w.kappa_y * w.n / c.limit
            }),
            across_roll: lanes(&|w, c| w.kappa_y * w.n * roll(w) * w.r / c.limit),
            angle: lanes(&|w, c| {
                w.kappa_s * w.n * w.delta / (w.r * c.limit) + w.kappa_s * w.n * w.delta * w.roller / c.limit
            }),
            share: lanes(&|_, c| c.share),
            share_third: lanes(&|_, c| c.share * (1.0 / 3.0)),
            clearance: lanes(&|_, c| c.clearance),
            minus_clearance: lanes(&|_, c| -c.clearance),
            gravity: lanes(&|w, c| 2.0 * w.n / c.mass[0]),
            gravity_e: lanes(&|w, c| 2.0 * w.n * w.epsilon / w.b / c.mass[0]),
            flange: lanes(&|_, c| c.flange / c.mass[0]),
            creep: lanes(&|_, c| c.limit / c.mass[0]),
            gyro: lanes(&|w, c| gyro(w) / c.mass[0]),
            turn: lanes(&|w, c| w.b * c.limit / c.mass[1]),
            turn_psi: lanes(&|w, c| 2.0 * w.b * w.n * w.turning() / c.mass[1]),
            turn_gyro: lanes(&|w, c| gyro(w) / c.mass[1]),
        }
    }

    /// The contact with the springs of its wheelset added: accelerations per e and psi.
    pub fn with_springs(mut self, lateral: &Lanes, yaw: &Lanes) -> Self {
        self.gravity_e = Lanes::from_fn(|l| self.gravity_e.0[l] + lateral.0[l]);
        self.turn_psi = Lanes::from_fn(|l| self.turn_psi.0[l] - yaw.0[l]);
        self
    }

    /// Does the saturation act in full in every lane?
    pub fn acts_fully(&self) -> bool {
        self.share == Lanes::splat(1.0)
    }

    /// The acceleration per phi_w by gravitation, and by springs of [`Contact::with_springs`] on the centre line.
    pub fn leaning(&self, lateral: &Lanes) -> Lanes {
        Lanes::from_fn(|l| self.gravity.0[l] - lateral.0[l] * self.r.0[l])
    }

    /// The lanes from `at` on, side by side in memory.
    #[inline(always)]
    pub fn part<P: Part>(&self, at: usize) -> Contact<P> {
        let g = |l: &Lanes| P::load(l, at);
        Contact {
            r: g(&self.r),
            along_e: g(&self.along_e),
            along_turn: g(&self.along_turn),
            across: g(&self.across),
            across_turn: g(&self.across_turn),
            across_psi: g(&self.across_psi),
            across_e: g(&self.across_e),
            across_line: g(&self.across_line),
            across_roll: g(&self.across_roll),
            angle: g(&self.angle),
            share: g(&self.share),
            share_third: g(&self.share_third),
            clearance: g(&self.clearance),
            minus_clearance: g(&self.minus_clearance),
            gravity: g(&self.gravity),
            gravity_e: g(&self.gravity_e),
            flange: g(&self.flange),
            creep: g(&self.creep),
            gyro: g(&self.gyro),
            turn: g(&self.turn),
            turn_psi: g(&self.turn_psi),
            turn_gyro: g(&self.turn_gyro),
        }
    }
}

impl<P: Part> Contact<P> {
    /// True if both wheels creep alike, so that one is computed for both.
    #[inline(always)]
    pub fn alike(self) -> Self {
        Contact { creep: self.creep + self.creep, turn: self.turn + self.turn, ..self }
    }

    /// At a speed and its inverse.
    #[inline(always)]
    pub fn at_speed(&self, v: P, per_v: P) -> AtSpeed<P> {
        AtSpeed {
            along: self.along_turn * per_v,
            across: self.across * per_v,
            across_turn: self.across_turn * per_v,
            gyro: self.gyro * v,
            turn_gyro: self.turn_gyro * v,
        }
    }

    /// y_w + r phi_w of the track [`under`] it.
    #[inline(always)]
    pub fn line(&self, [y, _, phi, _]: &[P; 4]) -> P {
        self.r.mul_add(*phi, *y)
    }

    /// Contribution of the slopes of the track to t_y.
    #[inline(always)]
    pub fn by_slopes(&self, [_, dy, _, dphi]: &[P; 4]) -> P {
        self.across_line.neg_mul_add(*dy, -(self.across_roll * *dphi))
    }

    /// The creep forces of the linear law at the displacement e = `motion.y` relative to the rails, in units of the limit
    /// (3.3), (3.5); t_y with what the slopes of the track add. Without `SPIN` both wheels creep alike.
    #[inline(always)]
    pub fn slip<const SPIN: bool>(&self, at_speed: &AtSpeed<P>, motion: &Motion<P>, slopes: P) -> Slip<P> {
        let Motion { y: e, psi, vy, vpsi } = *motion;
        // velocities last: they are the last to be known of a state
        let tx = at_speed.along.mul_add(vpsi, self.along_e * e);
        if !SPIN {
            let ty = at_speed.across.mul_add(vy, -(self.across_psi * psi));
            return Slip { e, tx, ty: [ty, ty] };
        }
        let mut ty = self.across_psi.neg_mul_add(psi, slopes);
        ty = self.across_e.neg_mul_add(e, ty);
        ty = at_speed.across_turn.mul_add(vpsi, ty);
        ty = at_speed.across.mul_add(vy, ty);
        Slip { e, tx, ty: [ty - self.angle, ty + self.angle] }
    }

    /// The factors of the creep forces of both wheels, one without `LAWS`: 1 - q + q^2/3 for q < 1, else 1/(3 q), q in units
    /// of [`UNIT`] limits; of a share of the saturation as much of what it takes off, unless it is `WHOLE` in all lanes.
    #[inline(always)]
    pub fn factors<const LAWS: bool, const WHOLE: bool, const SPIN: bool>(&self, slip: &Slip<P>) -> [P; 2] {
        let Slip { tx, ty, .. } = *slip;
        if !LAWS {
            return [P::splat(1.0); 2];
        }
        if SPIN {
            return self.saturation::<WHOLE, 2>(tx, ty);
        }
        let [f] = self.saturation::<WHOLE, 1>(tx, [ty[0]]);
        [f, f]
    }

    /// Of wheels of one t_x, creep forces in units of [`UNIT`] limits.
    #[inline(always)]
    fn saturation<const WHOLE: bool, const N: usize>(&self, tx: P, ty: [P; N]) -> [P; N] {
        let (one, third) = (P::splat(1.0), P::splat(1.0 / 3.0));
        let along = tx * tx;
        // loops, for closures inside array functions would not be compiled for the level
        let (mut square, mut q, mut factor) = (ty, ty, ty);
        let mut largest = one;
        for i in 0..N {
            square[i] = ty[i].mul_add(ty[i], along);
            q[i] = square[i].sqrt();
            factor[i] = if WHOLE {
                third.mul_add(square[i], one) - q[i]
            } else {
                self.share.neg_mul_add(q[i], self.share_third.mul_add(square[i], one))
            };
            largest = if i == 0 { square[0] } else { largest.max(square[i]) };
        }
        // full sliding is rare: its divisions are made only where a lane slides
        if largest.any_from(one) {
            for i in 0..N {
                // the same digits in full as by a share of one, whatever the other lanes do
                let more = third / q[i].max(third) - one;
                let sliding = if WHOLE { more + one } else { self.share.mul_add(more, one) };
                factor[i] = square[i].if_less(one, factor[i], sliding);
            }
        }
        factor
    }

    /// The accelerations of y and psi by all contact forces, added to those given, at this motion and these factors of the
    /// creep forces (3.4), (3.10). Without `LAWS` no flange touches; without `SPIN` of a contact [`Contact::alike`].
    #[inline(always)]
    pub fn touch<const LAWS: bool, const SPIN: bool>(
        &self,
        at_speed: &AtSpeed<P>,
        motion: &Motion<P>,
        slip: &Slip<P>,
        [f_1, f_2]: [P; 2],
        [a_y, a_psi]: [P; 2],
    ) -> [P; 2] {
        let Motion { psi, vy, vpsi, .. } = *motion;
        let Slip { e, tx, ty: [ty_1, ty_2] } = *slip;
        let mut a_y = self.gravity_e.neg_mul_add(e, a_y);
        if LAWS {
            let beyond = e - e.min(self.clearance).max(self.minus_clearance);
            a_y = self.flange.neg_mul_add(beyond, a_y);
        }
        // what waits for the factors comes last
        if !SPIN {
            let a_psi = self.turn_psi.mul_add(psi, a_psi);
            return [(self.creep * ty_1).neg_mul_add(f_1, a_y), (self.turn * tx).neg_mul_add(f_1, a_psi)];
        }
        let g_1 = f_1 * ty_1;
        let (sum, difference) = (f_2.mul_add(ty_2, g_1), f_2.neg_mul_add(ty_2, g_1));
        let pulls = (f_1 + f_2) * tx;
        let per_psi = self.turn.mul_add(difference, self.turn_psi);
        let a_psi = per_psi.mul_add(psi, a_psi);
        let (a_y, a_psi) = (at_speed.gyro.mul_add(vpsi, a_y), at_speed.turn_gyro.neg_mul_add(vy, a_psi));
        [self.creep.neg_mul_add(sum, a_y), self.turn.neg_mul_add(pulls, a_psi)]
    }
}

/// So sliding begins at one.
const UNIT: f64 = 3.0;
