//! The contact of one wheelset: the one writing of (3.2)-(3.10) of Broersen (1976).
//!
//! Products of constants are made beforehand. Creep forces are in units of a limit, results are divided by the masses: limit
//! and masses of one leave forces. Laws of the catalogue enter through [`Displacement`] and [`Pulls`].
use crate::effects::effect::cubic_saturation;
use crate::simd::{Dual, Lanes, Part, Portable, coefficients};

/// Numbers of one wheelset: its degrees of freedom, the columns of its track, its contact.
#[derive(Clone, Copy, Debug, Default)]
pub struct Wheelset {
    pub y: usize,
    pub psi: usize,
    /// First of the columns y_w, dy_w/ds, phi_w, dphi_w/ds, g.
    pub column: usize,
    pub lambda: f64,
    pub kappa_x: f64,
    pub kappa_y: f64,
    pub kappa_s: f64,
    pub epsilon: f64,
    pub delta: f64,
    pub sigma: f64,
    pub n: f64,
    pub r: f64,
    pub b: f64,
    pub i_ya: f64,
    /// 1/R of the rollers under the wheels [1/m]; 0 on a track.
    pub roller: f64,
    /// Distance behind the first wheelset [m].
    pub behind: f64,
    /// Column of 1/R under it on a line with curves.
    pub curvature: Option<usize>,
}

impl Wheelset {
    /// With the contact lambda, kappa_x, kappa_y, epsilon, delta, sigma; other numbers are set later.
    pub fn with_contact([lambda, kappa_x, kappa_y, epsilon, delta, sigma]: [f64; 6]) -> Self {
        Wheelset { lambda, kappa_x, kappa_y, epsilon, delta, sigma, ..Wheelset::default() }
    }

    /// 1 where the surface under the wheels moves with y_w, as a roller that is shifted does; 0 on a track.
    fn moves_with_rails(&self) -> f64 {
        f64::from(self.roller > 0.0)
    }

    /// Yaw moment of the normal forces per yaw, over 2 N b: delta, and (b + R delta)/(R + r) on rollers, from whose top
    /// a yawed wheelset stands off (docs/theory.md).
    fn turning(&self) -> f64 {
        (self.b * self.roller + self.delta) / (1.0 + self.r * self.roller)
    }

    /// Derivatives of Q_y and Q_psi of (3.9) with the gyroscopic moments of (3.10) with respect to y, psi, y', psi' at a
    /// speed [m/s].
    pub fn force_slopes(&self, speed: f64) -> [[f64; 4]; 2] {
        let numbers = Contact::of(&ContactNumbers::in_newtons(*self));
        let contact = Contact::of_lanes(|_| numbers).part::<Dual<Portable>>(0);
        let [y, psi, vy, vpsi] = Dual::variables();
        let motion = Motion { y, psi, vy, vpsi };
        let at_speed = contact.at_speed(Dual::splat(speed), Dual::splat(1.0 / speed));
        let at = Displacement { rolled: Dual::splat(self.lambda) * y, ..Displacement::linear(y) };
        let slip = contact.slip::<true>(&at_speed, &at, &motion, Dual::zero());
        let outer = contact.gravitation(&at, Dual::zero());
        let pulls = Pulls::of_factors(&slip, [Dual::splat(1.0); 2]);
        contact.accelerations(&at_speed, &motion, &pulls, [outer, Dual::zero()]).map(Dual::derivatives)
    }
}

/// A wheelset with its saturation and its flange.
#[derive(Clone, Copy, Debug)]
pub struct ContactNumbers {
    pub wheelset: Wheelset,
    /// Mass and yaw inertia of the wheelset.
    pub mass: [f64; 2],
    /// Creep force of the linear law from which on the wheel slides fully, 3 mu N, or [`NO_LIMIT`]; how much of the saturation
    /// acts.
    pub limit: f64,
    pub share: f64,
    /// Clearance and stiffness of the flange; stiffness 0 where there is none.
    pub clearance: f64,
    pub flange: f64,
}

/// Limit where nothing saturates: so far above every creep force that the factor is one to the last digit.
pub const NO_LIMIT: f64 = 1e40;

impl ContactNumbers {
    /// Forces instead of accelerations and units of a limit, per (r_1 - r_2)/2 instead of e; laws are added elsewhere.
    pub fn in_newtons(wheelset: Wheelset) -> Self {
        let wheelset = Wheelset { lambda: 1.0, ..wheelset };
        ContactNumbers { wheelset, mass: [1.0; 2], limit: 1.0, share: 1.0, clearance: 1.0, flange: 0.0 }
    }
}

coefficients! {
    /// The contact of one wheelset of one vehicle, of sixteen, or of a part of these.
    pub struct Contact {
        r,
        /// t_x = along_e e + along_turn psi'/V
        along_e,
        along_turn,
        /// t_y = (across y' + across_turn psi')/V - across_psi psi - across_e e - across_bend (e_gamma - e)
        /// - across_line dy_w - across_roll dphi_w
        across,
        across_turn,
        across_psi,
        across_e,
        across_bend,
        across_line,
        across_roll,
        /// t_y of the right wheel is less by this, of the left one more.
        angle,
        /// Of the saturation, how much of it acts, and a third of that.
        share,
        share_third,
        clearance,
        minus_clearance,
        /// Accelerations: per phi_w, e (by gravitation and what springs of [`Contact::with_springs`] add), flange deflection,
        /// unit of creep force, V psi'.
        pub gravity,
        gravity_e,
        flange,
        creep,
        gyro,
        /// Angular accelerations: per unit of creep force, psi (by the contact angle, less what springs of
        /// [`Contact::with_springs`] take off), V y'.
        turn,
        turn_psi,
        turn_gyro,
    }
}

impl Contact<f64> {
    /// The products of (3.3)-(3.5), (3.8), (3.9).
    pub fn of(numbers: &ContactNumbers) -> Self {
        let ContactNumbers { wheelset: w, mass: [mass, inertia], limit, share, clearance, flange } = *numbers;
        let [kx, ky, ks] = [w.kappa_x, w.kappa_y, w.kappa_s].map(|kappa| kappa * w.n / limit);
        // phi_i = phi_w - sigma e/b moves the contact point, and gamma/r, on rollers also gamma/R, is spin
        let (roll, gyro) = (w.r * w.sigma / w.b, w.i_ya * w.sigma / (w.b * w.r));
        let spin_per_angle = ks / w.r + ks * w.roller;
        let across_bend = spin_per_angle * w.epsilon / w.b;
        Contact {
            r: w.r,
            along_e: kx * w.lambda / w.r,
            along_turn: kx * w.b,
            across: ky * (1.0 + roll),
            across_turn: ks,
            across_psi: ky,
            across_e: across_bend - ks * w.sigma / (w.b * w.r),
            across_bend,
            across_line: ky * (roll + w.moves_with_rails()),
            across_roll: ky * (1.0 + roll) * w.r,
            angle: spin_per_angle * w.delta,
            share,
            share_third: share * (1.0 / 3.0),
            clearance,
            minus_clearance: -clearance,
            gravity: 2.0 * w.n / mass,
            gravity_e: 2.0 * w.n * w.epsilon / w.b / mass,
            flange: flange / mass,
            creep: limit / mass,
            gyro: gyro / mass,
            turn: w.b * limit / inertia,
            turn_psi: 2.0 * w.b * w.n * w.turning() / inertia,
            turn_gyro: gyro / inertia,
        }
    }
}

/// The track under a wheelset: y_w, dy_w/ds, phi_w, dphi_w/ds from this column of the input table on.
#[inline(always)]
pub fn under<P: Part>(row: &[f64], column: usize) -> [P; 4] {
    let track = &row[column..column + 4];
    [P::splat(track[0]), P::splat(track[1]), P::splat(track[2]), P::splat(track[3])]
}

/// Lateral and yaw motion of a wheelset.
#[derive(Clone, Copy)]
pub struct Motion<P> {
    pub y: P,
    pub psi: P,
    pub vy: P,
    pub vpsi: P,
}

/// Displacement e relative to the rails, what the rolling radii make of it ((r_1 - r_2)/2, or e where the contact has its
/// conicity), and how much more the contact angles make of it.
#[derive(Clone, Copy)]
pub struct Displacement<P> {
    pub e: P,
    pub rolled: P,
    pub bend: Option<P>,
}

impl<P: Part> Displacement<P> {
    /// On linear profiles.
    #[inline(always)]
    pub fn linear(e: P) -> Self {
        Displacement { e, rolled: e, bend: None }
    }
}

/// Terms that depend on the speed: t_x per psi', t_y per y' and psi', accelerations per psi' and y'.
#[derive(Clone, Copy)]
pub struct AtSpeed<P> {
    along: P,
    pub across: P,
    across_turn: P,
    pub gyro: P,
    turn_gyro: P,
}

/// The creep forces of the linear law: t_x, t_y of the right and the left wheel.
#[derive(Clone, Copy)]
pub struct Slip<P> {
    pub tx: P,
    pub ty: [P; 2],
}

/// Creep forces of both wheels: t_y1 + t_y2, t_y1 - t_y2, t_x1 + t_x2 (T_x1 = -t_x1, T_x2 = t_x2).
#[derive(Clone, Copy)]
pub struct Pulls<P> {
    sum: P,
    difference: P,
    along: P,
}

impl<P: Part> Pulls<P> {
    #[inline(always)]
    pub fn of([tx_1, tx_2]: [P; 2], [ty_1, ty_2]: [P; 2]) -> Self {
        Pulls { sum: ty_1 + ty_2, difference: ty_1 - ty_2, along: tx_1 + tx_2 }
    }

    /// The forces of the linear law times a factor per wheel.
    #[inline(always)]
    fn of_factors(slip: &Slip<P>, [f_1, f_2]: [P; 2]) -> Self {
        let Slip { tx, ty: [ty_1, ty_2] } = *slip;
        let g_1 = f_1 * ty_1;
        Pulls { sum: f_2.mul_add(ty_2, g_1), difference: f_2.neg_mul_add(ty_2, g_1), along: (f_1 + f_2) * tx }
    }
}

impl Contact<Lanes> {
    /// The contact with the springs of its wheelset added: accelerations per e and psi.
    pub fn with_springs(mut self, lateral: &Lanes, yaw: &Lanes) -> Self {
        self.gravity_e = Lanes::from_fn(|l| self.gravity_e.0[l] + lateral.0[l]);
        self.turn_psi = Lanes::from_fn(|l| self.turn_psi.0[l] - yaw.0[l]);
        self
    }

    /// Do both wheels creep alike where the track has no cross-level: without roll and spin creep?
    pub fn creeps_alike(&self) -> bool {
        self.across_turn.is_zero() && self.across_line.is_zero()
    }

    /// Does the saturation act in full in every lane?
    pub fn acts_fully(&self) -> bool {
        self.share == Lanes::splat(1.0)
    }

    /// The acceleration per phi_w by gravitation, and by springs of [`Contact::with_springs`] on the centre line.
    pub fn leaning(&self, lateral: &Lanes) -> Lanes {
        Lanes::from_fn(|l| self.gravity.0[l] - lateral.0[l] * self.r.0[l])
    }
}

impl<P: Part> Contact<P> {
    /// True if both wheels creep alike, so that one is computed for both.
    #[inline(always)]
    pub fn alike(self) -> Self {
        Contact { creep: self.creep + self.creep, turn: self.turn + self.turn, ..self }
    }

    /// kappa_x N/r of a contact [`ContactNumbers::in_newtons`], and kappa_x N.
    #[inline(always)]
    pub fn along(&self) -> [P; 2] {
        [self.along_e, self.along_e * self.r]
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

    /// Its slope: the same of dy_w/ds and dphi_w/ds.
    #[inline(always)]
    pub fn line_slope(&self, [_, dy, _, dphi]: &[P; 4]) -> P {
        self.r.mul_add(*dphi, *dy)
    }

    /// Contribution of the slopes of the track to t_y.
    #[inline(always)]
    pub fn by_slopes(&self, [_, dy, _, dphi]: &[P; 4]) -> P {
        self.across_line.neg_mul_add(*dy, -(self.across_roll * *dphi))
    }

    /// The creep forces of the linear law (3.3), (3.5), in units of the limit; t_y with what the slopes of the track add.
    /// Without `SPIN` both wheels creep alike.
    #[inline(always)]
    pub fn slip<const SPIN: bool>(
        &self,
        at_speed: &AtSpeed<P>,
        at: &Displacement<P>,
        motion: &Motion<P>,
        slopes: P,
    ) -> Slip<P> {
        let Motion { psi, vy, vpsi, .. } = *motion;
        // velocities last: they are the last to be known of a state
        let tx = at_speed.along.mul_add(vpsi, self.along_e * at.rolled);
        if !SPIN {
            let ty = at_speed.across.mul_add(vy, -(self.across_psi * psi));
            return Slip { tx, ty: [ty, ty] };
        }
        let mut ty = self.across_psi.neg_mul_add(psi, slopes);
        ty = self.with_spin(at_speed, at, vpsi, ty);
        ty = at_speed.across.mul_add(vy, ty);
        Slip { tx, ty: [ty - self.angle, ty + self.angle] }
    }

    /// t_y with the part of it that is spin, but for that of the mean contact angle.
    #[inline(always)]
    fn with_spin(&self, at_speed: &AtSpeed<P>, at: &Displacement<P>, vpsi: P, mut ty: P) -> P {
        ty = self.across_e.neg_mul_add(at.e, ty);
        if let Some(bend) = at.bend {
            ty = self.across_bend.neg_mul_add(bend, ty);
        }
        at_speed.across_turn.mul_add(vpsi, ty)
    }

    /// The part of t_y of both wheels that is spin.
    #[inline(always)]
    pub fn spin(&self, at_speed: &AtSpeed<P>, at: &Displacement<P>, vpsi: P) -> [P; 2] {
        let spin = self.with_spin(at_speed, at, vpsi, P::zero());
        [spin - self.angle, spin + self.angle]
    }

    /// The factors of the creep forces of both wheels, one without `LAWS`, by the cubic saturation.
    #[inline(always)]
    pub fn factors<const LAWS: bool, const WHOLE: bool, const SPIN: bool>(&self, slip: &Slip<P>) -> [P; 2] {
        let Slip { tx, ty: [ty_1, ty_2] } = *slip;
        if !LAWS {
            return [P::splat(1.0); 2];
        }
        let (along, share) = (tx * tx, [self.share, self.share_third]);
        if SPIN {
            let squares = [ty_1.mul_add(ty_1, along), ty_2.mul_add(ty_2, along)];
            return cubic_saturation::<P, WHOLE, 2>(squares, share);
        }
        let [f] = cubic_saturation::<P, WHOLE, 1>([ty_1.mul_add(ty_1, along)], share);
        [f, f]
    }

    /// The lateral acceleration by gravitation, added to one given.
    #[inline(always)]
    pub fn gravitation(&self, at: &Displacement<P>, a_y: P) -> P {
        let a_y = self.gravity_e.neg_mul_add(at.e, a_y);
        if let Some(bend) = at.bend { self.gravity_e.neg_mul_add(bend, a_y) } else { a_y }
    }

    /// The accelerations of y and psi by all contact forces, added to those given, at this motion and these factors of the
    /// creep forces. Without `LAWS` no flange touches; without `SPIN` of a contact [`Contact::alike`].
    #[inline(always)]
    pub fn touch<const LAWS: bool, const SPIN: bool>(
        &self,
        at_speed: &AtSpeed<P>,
        motion: &Motion<P>,
        slip: &Slip<P>,
        factors: [P; 2],
        [a_y, a_psi]: [P; 2],
    ) -> [P; 2] {
        let e = motion.y;
        let mut a_y = self.gravitation(&Displacement::linear(e), a_y);
        if LAWS {
            let beyond = e - e.min(self.clearance).max(self.minus_clearance);
            a_y = self.flange.neg_mul_add(beyond, a_y);
        }
        // what waits for the factors comes last
        if !SPIN {
            let ([f, _], Slip { tx, ty: [ty, _] }) = (factors, *slip);
            let a_psi = self.turn_psi.mul_add(motion.psi, a_psi);
            return [(self.creep * ty).neg_mul_add(f, a_y), (self.turn * tx).neg_mul_add(f, a_psi)];
        }
        self.accelerations(at_speed, motion, &Pulls::of_factors(slip, factors), [a_y, a_psi])
    }

    /// The accelerations by creep forces, by normal forces that turn with the wheelset and by the gyroscopic moments, added to
    /// those given (3.4), (3.10).
    #[inline(always)]
    pub fn accelerations(
        &self,
        at_speed: &AtSpeed<P>,
        motion: &Motion<P>,
        pulls: &Pulls<P>,
        [a_y, a_psi]: [P; 2],
    ) -> [P; 2] {
        let Motion { psi, vy, vpsi, .. } = *motion;
        let per_psi = self.turn.mul_add(pulls.difference, self.turn_psi);
        let a_psi = per_psi.mul_add(psi, a_psi);
        let (a_y, a_psi) = (at_speed.gyro.mul_add(vpsi, a_y), at_speed.turn_gyro.neg_mul_add(vy, a_psi));
        [self.creep.neg_mul_add(pulls.sum, a_y), self.turn.neg_mul_add(pulls.along, a_psi)]
    }
}
