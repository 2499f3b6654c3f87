//! A wheelset with any laws at its contact: rolling radii, creep forces, flanges, a rail that yields.
use crate::effects::PlacedLaw;
use crate::effects::effect::{Creeping, Flanging, RollingRadius};
use crate::numeric::profile_table::ShapeLanes;
use crate::simd::{Lanes, Part};
use crate::wheel_rail::contact::{
    AtSpeed, Contact, ContactNumbers, Displacement, Motion, Pulls, Slip, Wheelset, under,
};

/// A wheelset of sixteen vehicles and the laws at its contact.
#[derive(Clone, Debug)]
pub struct WheelsetLanes {
    pub y: usize,
    pub psi: usize,
    pub column: usize,
    curvature: Option<usize>,
    /// In newtons, without conicity, saturation and flange.
    contact: Contact<Lanes>,
    lambda: Lanes,
    pub r: Lanes,
    /// N delta, which spreads the wheels.
    spread: Lanes,
    pub laws: Vec<PlacedLaw>,
    pub creeps: Vec<PlacedLaw>,
    pub rolls: Vec<PlacedLaw>,
    pub shape: Option<ShapeLanes>,
    pub rail: Option<RailLanes>,
    /// Does a flange slide with friction?
    pub has_friction: bool,
}

/// The track as a group passes it: the input row and the speed.
#[derive(Clone, Copy)]
pub struct Passing<'a, P> {
    pub row: &'a [f64],
    pub speed: P,
}

/// A contact, and its terms at the present speed.
type Touching<'a, P> = &'a (Contact<P>, AtSpeed<P>);

/// Input of the creep laws of both wheels of a wheelset: t_x, the spin parts of t_y, the speed.
#[derive(Clone, Copy)]
struct Slipping<P> {
    tx: P,
    spin: [P; 2],
    speed: P,
}

/// Forces of both wheels on the rails: by gravitation and at the flange, t_x of the linear law, t_x and t_y of the treads as the
/// creep laws make them (T_x1 = -t_x1, T_x2 = t_x2), u' of the rail, friction at the flanges.
#[derive(Clone, Copy)]
struct Touch<P> {
    gravitation: P,
    flange: P,
    linear: P,
    tx: [P; 2],
    ty: [P; 2],
    du: P,
    friction: Option<SlidingFlanges<P>>,
}

/// Creep forces of both wheels at their flanges, of which one touches, and friction times creepage.
#[derive(Clone, Copy)]
struct SlidingFlanges<P> {
    tx: [P; 2],
    ty: [P; 2],
    wear: P,
}

impl<P: Part> SlidingFlanges<P> {
    fn none() -> Self {
        SlidingFlanges { tx: [P::zero(); 2], ty: [P::zero(); 2], wear: P::zero() }
    }

    /// With another flange: its right wheel touches where it pushes the wheelset to the left.
    #[inline(always)]
    fn add(&mut self, law: &PlacedLaw, part: usize, of: &Flanging<P>) {
        let none = P::zero();
        let ([x, y], wear) = law.law.friction(law.numbers(part), of);
        for (sum, f) in [(&mut self.tx, x), (&mut self.ty, y)] {
            *sum = [sum[0] + of.force.if_less(none, f, none), sum[1] + none.if_less(of.force, f, none)];
        }
        self.wear = self.wear + wear;
    }
}

impl<P: Part> Touch<P> {
    /// Creep forces of both wheels, of treads and flanges.
    #[inline(always)]
    fn creep(&self) -> ([P; 2], [P; 2]) {
        let (tx, ty) = (self.tx, self.ty);
        let Some(SlidingFlanges { tx: x, ty: y, .. }) = self.friction else { return (tx, ty) };
        ([tx[0] + x[0], tx[1] + x[1]], [ty[0] + y[0], ty[1] + y[1]])
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

/// The rail under the wheelset: k_r u + c_r u' = -Q_y.
#[derive(Clone, Debug)]
pub struct RailLanes {
    pub state: usize,
    pub alpha: Lanes,
    pub stiffness: Lanes,
    pub damping: Lanes,
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

    /// Its contact in newtons, of the lanes from `at` on, at no speed yet.
    #[inline(always)]
    pub fn contact<P: Part>(&self, at: usize) -> (Contact<P>, AtSpeed<P>) {
        self.contact_at(at, P::zero(), P::zero())
    }

    /// Its contact in newtons at a speed and its inverse.
    #[inline(always)]
    fn contact_at<P: Part>(&self, at: usize, speed: P, inv_speed: P) -> (Contact<P>, AtSpeed<P>) {
        let contact = self.contact.part::<P>(at);
        (contact, contact.at_speed(speed, inv_speed))
    }

    /// Motion of the wheelset, and u of the rail under it; x: n degrees of freedom, their rates, own states.
    #[inline(always)]
    fn motion<P: Part>(&self, n: usize, x: &[P; 64]) -> (Motion<P>, P) {
        let (y, psi) = (self.y, self.psi);
        let motion = Motion { y: x[y & 63], psi: x[psi & 63], vy: x[(n + y) & 63], vpsi: x[(n + psi) & 63] };
        (motion, self.rail.as_ref().map_or(P::zero(), |rail| x[rail.state & 63]))
    }

    /// Adds Q_y, Q_psi and the gyroscopic moments to the forces dx[n ..], and u' where the rail yields.
    #[inline(always)]
    pub fn add<P: Part>(
        &self,
        part: usize,
        contact: Touching<'_, P>,
        track: &Passing<'_, P>,
        n: usize,
        x: &[P; 64],
        dx: &mut [P; 64],
    ) {
        let (motion, u) = self.motion(n, x);
        let (q_y, q_psi, du) = self.forces(part, contact, track, &motion, u);
        let (iy, ipsi) = ((n + self.y) & 63, (n + self.psi) & 63);
        dx[iy] = dx[iy] + q_y;
        dx[ipsi] = dx[ipsi] + q_psi;
        if let Some(rail) = &self.rail {
            dx[rail.state & 63] = du;
        }
    }

    /// Q_y, Q_psi with the gyroscopic moments, and u' of the rail whose movement is u.
    #[inline(always)]
    fn forces<P: Part>(
        &self,
        part: usize,
        contact: Touching<'_, P>,
        track: &Passing<'_, P>,
        motion: &Motion<P>,
        u: P,
    ) -> (P, P, P) {
        let touch = self.touch(part, contact, track, motion, u);
        let ((tx, ty), (contact, at_speed)) = (touch.creep(), contact);
        let [q_y, q_psi] =
            contact.accelerations(at_speed, motion, &Pulls::of(tx, ty), [touch.gravitation + touch.flange, P::zero()]);
        (q_y, q_psi, touch.du)
    }

    /// The guiding forces Y of the right and the left wheel on the rails, to the right.
    ///
    /// (3.4) with gamma_1, gamma_2 of (3.8); a flange presses where the wheelset has moved to.
    #[inline(always)]
    pub fn guiding<P: Part>(&self, part: usize, track: &Passing<'_, P>, inv_speed: P, n: usize, x: &[P; 64]) -> [P; 2] {
        let (motion, u) = self.motion(n, x);
        let contact = self.contact_at(part, track.speed, inv_speed);
        let touch = self.touch(part, &contact, track, &motion, u);
        let (flange, (_, [ty_1, ty_2])) = (touch.flange, touch.creep());
        let (none, half) = (P::zero(), P::splat(0.5));
        // N (gamma_1 - gamma_2)/2 with the gyroscopic moment, and N (gamma_1 + gamma_2)/2 that spreads the wheels
        let leaning = half * contact.1.gyro.neg_mul_add(motion.vpsi, -touch.gravitation);
        let spread = P::load(&self.spread, part);
        let right = flange.if_less(none, -flange, none);
        let left = none.if_less(flange, -flange, none);
        [leaning + spread + ty_1 + right, leaning - spread + ty_2 + left]
    }

    /// Displacement of the wheelset relative to the rails under it, through its laws of the rolling radii and its profile.
    #[inline(always)]
    fn displacement<P: Part>(&self, part: usize, e: P, row: &[f64]) -> Displacement<P> {
        let g = |l: &Lanes| P::load(l, part);
        if self.rolls.is_empty() && self.shape.is_none() {
            return Displacement { e, rolled: g(&self.lambda) * e, bend: None };
        }
        let gauge = P::splat(row[self.column + 4]);
        let mut to = RollingRadius { shift: P::zero(), conicity: g(&self.lambda), cubic: P::zero() };
        for roll in &self.rolls {
            roll.law.roll(roll.numbers(part), g(&roll.alpha), gauge, row[0], &mut to);
        }
        let d = e - to.shift;
        let (mut rolled, mut bend) = (d, None);
        if let Some(shape) = &self.shape {
            let (by_radii, by_angles) = shape.at(part, d, gauge, e);
            (rolled, bend) = (by_radii, Some(by_angles - e));
        }
        Displacement { e, rolled: to.conicity * rolled * (to.cubic * d).mul_add(d, P::splat(1.0)), bend }
    }

    /// Forces of the wheels on the rails: creep forces, and other lateral forces.
    #[inline(always)]
    fn touch<P: Part>(
        &self,
        part: usize,
        (contact, at_speed): Touching<'_, P>,
        track: &Passing<'_, P>,
        motion: &Motion<P>,
        u: P,
    ) -> Touch<P> {
        let Passing { row, speed, .. } = *track;
        let mut motion = *motion;
        if let Some(curvature) = self.curvature {
            // turning with the curve: b/R in the longitudinal creepage, 1/R in the spin
            motion.vpsi = speed.mul_add(P::splat(row[curvature]), motion.vpsi);
        }
        let g = |l: &Lanes| P::load(l, part);
        let under: [P; 4] = under(row, self.column);
        let mut e = motion.y - contact.line(&under);
        if let Some(rail) = &self.rail {
            e = g(&rail.alpha).neg_mul_add(u, e);
        }
        let at = self.displacement(part, e, row);
        let Slip { tx, ty: [mut ty_1, mut ty_2] } =
            contact.slip::<true>(at_speed, &at, &motion, contact.by_slopes(&under));
        let spin = contact.spin(at_speed, &at, motion.vpsi);
        let gravitation = contact.gravitation(&at, contact.gravity * under[2]);
        let mut flange = P::zero();
        let mut friction = self.has_friction.then(SlidingFlanges::none);
        for law in &self.laws {
            let de =
                if law.looks_at_speed { contact.line_slope(&under).neg_mul_add(speed, motion.vy) } else { P::zero() };
            let f = law.law.at_contact(law.numbers(part), e, de, row[0], row[self.column + 4]);
            flange = g(&law.alpha).mul_add(f, flange);
            if let Some(friction) = &mut friction {
                let (force, [kx_r, _]) = (g(&law.alpha) * f, contact.along());
                friction.add(law, part, &Flanging { force, tx, ty: ty_1 - spin[0], kx_r });
            }
        }
        let outer = gravitation + flange;

        let (mut tx_1, mut tx_2) = (tx, tx);
        let creeps = if self.creeps.is_empty() { None } else { Some(Slipping { tx, spin, speed }) };
        let mut du = P::zero();
        if let Some(rail) = &self.rail {
            // what u' takes off the creep force of each wheel, through y' - u' and through the roll
            let share = g(&rail.alpha) * at_speed.across;
            // the speed at which the rail yields is small against that of a sliding flange
            let pushed = friction.map_or(outer, |f| outer - f.ty[0] - f.ty[1]);
            let still = g(&rail.stiffness).mul_add(u, pushed);
            du = self.yielding(part, g(&rail.damping), still, share, creeps.as_ref(), [ty_1, ty_2]);
            (ty_1, ty_2) = (share.neg_mul_add(du, ty_1), share.neg_mul_add(du, ty_2));
        }
        if let Some(creeps) = &creeps {
            ([tx_1, ty_1], [tx_2, ty_2]) = self.creep_forces(part, creeps, ty_1, ty_2);
        }
        Touch { gravitation, flange, linear: tx, tx: [tx_1, tx_2], ty: [ty_1, ty_2], du, friction }
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

    /// u' of the rail from k_r u + c_r u' = -Q_y, in which Q_y holds u' through the lateral creepage.
    ///
    /// `still`: k_r u + Q_y without creep forces; `ty`: those at u' = 0. With saturation the sum's slope lies between
    /// c_r and c_r + 2 share, which bounds the steps of the secant method; its last step is the square of a small one.
    /// A converged lane stays, whatever its neighbours do.
    #[inline(always)]
    fn yielding<P: Part>(
        &self,
        part: usize,
        damping: P,
        still: P,
        share: P,
        creeps: Option<&Slipping<P>>,
        ty: [P; 2],
    ) -> P {
        let steepest = share.mul_add(P::splat(2.0), damping);
        let Some(creeps) = creeps else {
            return (ty[0] + ty[1] - still) / steepest;
        };
        let (none, one, half) = (P::zero(), P::splat(1.0), P::splat(0.5));
        let sum = |du: P| {
            let (ty_1, ty_2) = (share.neg_mul_add(du, ty[0]), share.neg_mul_add(du, ty[1]));
            let ([_, ty_1], [_, ty_2]) = self.creep_forces(part, creeps, ty_1, ty_2);
            damping.mul_add(du, still) - ty_1 - ty_2
        };
        let (mut before, mut total_before) = (none, sum(none));
        let (near, far) = (-total_before / steepest, -total_before / damping);
        let (mut low, mut high) = (near.min(far), near.max(far));
        let (mut du, mut on_the_way) = (near, one);
        for _ in 0..40 {
            let total = sum(du);
            low = total.if_less(none, du, low);
            high = total.if_less(none, high, du);
            let (apart, smallest) = (du - before, P::splat(1e-300));
            let secant = (total - total_before) / apart.abs().if_less(smallest, one, apart);
            let slope = apart.abs().if_less(smallest, steepest, secant.max(damping));
            let step = du - total / slope;
            let middle = half * (low + high);
            let inside = step.if_less(low, middle, high.if_less(step, middle, step));
            let moved = (inside - du).abs();
            (before, total_before) = (du, total);
            du = on_the_way.if_less(half, du, inside);
            let near_enough = inside.abs().mul_add(P::splat(1e-6), P::splat(1e-12));
            on_the_way = moved.if_less(near_enough, none, on_the_way);
            if !on_the_way.any_from(half) {
                break;
            }
        }
        du
    }

    /// T_x, T_y of both wheels where the linear law gives t_x and t_y.
    #[inline(always)]
    fn creep_forces<P: Part>(&self, part: usize, slipping: &Slipping<P>, ty_1: P, ty_2: P) -> ([P; 2], [P; 2]) {
        let one = P::splat(1.0);
        let Slipping { tx, spin, speed } = *slipping;
        let mut wheels =
            [Creeping { tx, ty: ty_1, spin: spin[0], speed }, Creeping { tx, ty: ty_2, spin: spin[1], speed }];
        for creep in &self.creeps {
            let forces = creep.law.creep(creep.numbers(part), &wheels);
            for i in 0..2 {
                let (wheel, mut acts_fully) = (&mut wheels[i], forces[i]);
                if !creep.acts_fully {
                    let alpha = P::load(&creep.alpha, part);
                    // amount 1 has the same digits as without blending
                    let blend = |linear: P, acts_fully: P| {
                        let partly = alpha.mul_add(acts_fully - linear, linear);
                        alpha.if_less(one, partly, one.if_less(alpha, partly, acts_fully))
                    };
                    acts_fully = [blend(wheel.tx, acts_fully[0]), blend(wheel.ty, acts_fully[1])];
                }
                [wheel.tx, wheel.ty] = acts_fully;
            }
        }
        ([wheels[0].tx, wheels[0].ty], [wheels[1].tx, wheels[1].ty])
    }
}
