//! The numbers of a wheelset, and the products of constants of its contact (3.2)-(3.10).
use crate::simd::{Lanes, Part, coefficients};

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
        pub r,
        /// t_x = along_e e + along_turn psi'/V
        pub along_e,
        pub along_turn,
        /// t_y = (across y' + across_turn psi')/V - across_psi psi - across_e e - across_bend (e_gamma - e)
        /// - across_line dy_w - across_roll dphi_w
        pub across,
        pub across_turn,
        pub across_psi,
        pub across_e,
        pub across_bend,
        pub across_line,
        pub across_roll,
        /// t_y of the right wheel is less by this, of the left one more.
        pub angle,
        /// Of the saturation, how much of it acts, and a third of that.
        pub share,
        pub share_third,
        pub clearance,
        pub minus_clearance,
        /// Accelerations: per phi_w, e (by gravitation and what springs of [`Contact::with_springs`] add), flange deflection,
        /// unit of creep force, V psi'.
        pub gravity,
        pub gravity_e,
        pub flange,
        pub creep,
        pub gyro,
        /// Angular accelerations: per unit of creep force, psi (by the contact angle, less what springs of
        /// [`Contact::with_springs`] take off), V y'.
        pub turn,
        pub turn_psi,
        pub turn_gyro,
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
}
