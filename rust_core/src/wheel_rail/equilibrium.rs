//! A wheelset beyond the steps: made of its numbers, its slopes at rest, its equilibrium in a curve.
use crate::simd::{Dual, Lanes, Part, Portable};
use crate::wheel_rail::coefficients::{Contact, ContactNumbers, Wheelset};
use crate::wheel_rail::contact::{Displacement, Motion, Pulls};
use crate::wheel_rail::wheelset::{Passing, WheelsetLanes};

impl Wheelset {
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

/// Equilibrium of a wheelset in a curve: e, Q_y, Q_psi, the longitudinal creepage of wheel 2, k_r u + Q_y of a rail
/// that yields, T_x and T_y of the treads of both wheels, friction times creepage at the flange.
#[derive(Clone, Copy)]
pub struct Standing<P> {
    pub e: P,
    pub q_y: P,
    pub q_psi: P,
    pub creepage: P,
    pub rail: P,
    pub tx: [P; 2],
    pub ty: [P; 2],
    pub flange_wear: P,
}

impl WheelsetLanes {
    pub fn new(one: &[Wheelset]) -> Self {
        let lanes = |f: fn(&Wheelset) -> f64| Lanes::from_fn(|l| f(&one[l]));
        WheelsetLanes {
            y: one[0].y,
            psi: one[0].psi,
            column: one[0].column,
            curvature: one[0].curvature,
            contact: Contact::of_lanes(|l| Contact::of(&ContactNumbers::in_newtons(one[l]))),
            lambda: lanes(|w| w.lambda),
            r: lanes(|w| w.r),
            spread: lanes(|w| w.n * w.delta),
            laws: Vec::new(),
            creeps: Vec::new(),
            rolls: Vec::new(),
            shape: None,
            rail: None,
            has_friction: false,
        }
    }

    /// Equilibrium of a wheelset at rest in a curve of curvature 1/R without irregularities: turning with
    /// the curve it has the creepages that docs/theory.md adds, b/R and 1/R, and no gyroscopic moment.
    pub fn standing<P: Part>(&self, part: usize, row: &[f64], curvature: P, y: P, psi: P, u: P) -> Standing<P> {
        let g = |l: &Lanes| P::load(l, part);
        let e = self.rail.as_ref().map_or(y, |rail| g(&rail.alpha).neg_mul_add(u, y));
        let still = WheelsetLanes { rail: None, curvature: None, ..self.clone() };
        let (one, track) = (P::splat(1.0), Passing { row, speed: P::splat(1.0) });
        let at = self.contact_at(part, one, one);
        let motion = Motion { y: e, psi, vy: P::zero(), vpsi: curvature };
        let touch = still.touch(part, &at, &track, &motion, P::zero());
        let (q_y, q_psi, _) = still.forces(part, &at, &track, &motion, P::zero());
        let (contact, at_speed) = at;
        let q_y = at_speed.gyro.neg_mul_add(curvature, q_y);
        let rail = self.rail.as_ref().map_or(P::zero(), |rail| g(&rail.stiffness).mul_add(u, q_y));
        let [_, kappa_n] = contact.along();
        let creepage = touch.linear / kappa_n;
        let flange_wear = touch.friction.map_or(P::zero(), |f| f.wear);
        Standing { e, q_y, q_psi, creepage, rail, tx: [-touch.tx[0], touch.tx[1]], ty: touch.ty, flange_wear }
    }
}
