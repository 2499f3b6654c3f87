//! The contact of one wheelset: the one writing of (3.2)-(3.10) of Broersen (1976).
//!
//! Products of constants are made beforehand. Creep forces are in units of a limit, results are divided by the masses: limit
//! and masses of one leave forces. Laws of the catalogue enter through [`Displacement`] and [`Pulls`].
use crate::effects::effect::cubic_saturation;
use crate::simd::Part;
use crate::wheel_rail::coefficients::Contact;

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
    pub fn of_factors(slip: &Slip<P>, [f_1, f_2]: [P; 2]) -> Self {
        let Slip { tx, ty: [ty_1, ty_2] } = *slip;
        let g_1 = f_1 * ty_1;
        Pulls { sum: f_2.mul_add(ty_2, g_1), difference: f_2.neg_mul_add(ty_2, g_1), along: (f_1 + f_2) * tx }
    }
}

impl<P: Part> Contact<P> {
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
