//! The contact chain of one wheelset: e, rolling radii, creepage, creep forces.
//!
//! Source: Broersen (1976), (3.2)-(3.9); letters as there.
use crate::effects::effect::{Creeping, Numbers, RollingRadius};
use crate::effects::flange_contact::{self, Flanging, in_gauge};
use crate::effects::{Law, PlacedLaw};
use crate::numeric::profile_table::ShapeLanes;
use crate::simd::{Lanes, Part};

/// Indices of one wheelset: its degrees of freedom, and the columns of its track.
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
    pub fn moves_with_rails(&self) -> f64 {
        f64::from(self.roller > 0.0)
    }

    /// Yaw moment of the normal forces per yaw, over 2 N b: delta, and (b + R delta)/(R + r) on rollers, from whose top
    /// a yawed wheelset stands off (docs/theory.md).
    pub fn turning(&self) -> f64 {
        (self.b * self.roller + self.delta) / (1.0 + self.r * self.roller)
    }

    /// The forces Q_y, Q_psi of (3.9) less the gyroscopic terms of (3.10), as [[K], [C]] of (y, psi): Q = -K q - C q'.
    pub fn linear(&self, speed: f64) -> ([[f64; 2]; 2], [[f64; 2]; 2]) {
        let w = self;
        let roll = 1.0 + w.r * w.sigma / w.b;
        let spin = w.kappa_s * (w.epsilon - w.sigma) / (w.b * w.r) + w.kappa_s * w.epsilon * w.roller / w.b;
        let rollers = 2.0 * w.b * w.n * (w.kappa_s * w.roller * w.delta - (w.turning() - w.delta));
        let k = [
            [2.0 * w.n * (w.epsilon / w.b - spin), -2.0 * w.kappa_y * w.n],
            [
                2.0 * w.b * w.n * w.kappa_x * w.lambda / w.r,
                -2.0 * w.b * w.n * (1.0 - w.kappa_s / w.r) * w.delta + rollers,
            ],
        ];
        let gyro = w.i_ya * speed * w.sigma / (w.b * w.r);
        let c = [
            [2.0 * w.kappa_y * w.n * roll / speed, 2.0 * w.kappa_s * w.n / speed - gyro],
            [gyro, 2.0 * w.b * w.b * w.n * w.kappa_x / speed],
        ];
        (k, c)
    }
}

/// The same wheelset of sixteen vehicles, products made once.
#[derive(Clone, Debug)]
pub struct WheelsetLanes {
    pub y: usize,
    pub psi: usize,
    pub column: usize,
    curvature: Option<usize>,
    lambda: Lanes,
    pub r: Lanes,
    b: Lanes,
    /// kappa_x N / r and b kappa_x N
    kx_r: Lanes,
    kx_b: Lanes,
    /// kappa_y N and kappa_y N (1 + r sigma/b), r times it, kappa_y N r sigma/b (on rollers kappa_y N more)
    ky: Lanes,
    ky_roll: Lanes,
    ky_roll_r: Lanes,
    ky_sigma: Lanes,
    /// kappa_s N, kappa_s N (epsilon - sigma)/(b r), kappa_s N epsilon/(b r), kappa_s N delta/r; on rollers 1/r + 1/R of gamma
    ks: Lanes,
    ks_e: Lanes,
    ks_tilt: Lanes,
    ks_delta: Lanes,
    /// 2 N, 2 N epsilon/b, 2 N delta, and 2 N delta as [`Wheelset::turning`] has it
    n2: Lanes,
    n2_e: Lanes,
    n2_delta: Lanes,
    n2_turn: Lanes,
    gyro: Lanes,
    pub laws: Vec<PlacedLaw>,
    pub creeps: Vec<PlacedLaw>,
    pub rolls: Vec<PlacedLaw>,
    pub shape: Option<ShapeLanes>,
    pub rail: Option<RailLanes>,
    /// Does a flange slide with friction?
    pub has_friction: bool,
}

/// The track as a group passes it: the input row, the speed and its inverse.
#[derive(Clone, Copy)]
pub struct Passing<'a, P> {
    pub row: &'a [f64],
    pub speed: P,
    pub inv_speed: P,
}

impl<'a, P: Part> Passing<'a, P> {
    /// At the lanes' multiples of the speed of the row, with their inverses.
    #[inline(always)]
    pub fn new(row: &'a [f64], share: P, inv_share: P) -> Self {
        Passing { row, speed: P::splat(row[1]) * share, inv_speed: P::splat(1.0 / row[1]) * inv_share }
    }
}

/// Lateral and yaw motion of a wheelset.
#[derive(Clone, Copy)]
pub struct Motion<P> {
    pub y: P,
    pub psi: P,
    pub vy: P,
    pub vpsi: P,
}

/// Input of the creep laws of both wheels of a wheelset: t_x, the spin parts of t_y, the speed.
#[derive(Clone, Copy)]
struct Slipping<P> {
    tx: P,
    spin: [P; 2],
    speed: P,
}

/// Forces of both wheels on the rails: gravitation and flange, t_x of the linear law, t_x and t_y of the treads as the
/// creep laws make them (T_x1 = -t_x1, T_x2 = t_x2), u' of the rail, friction at the flanges.
#[derive(Clone, Copy)]
struct Touch<P> {
    outer: P,
    /// The flange's part of `outer`.
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
    fn add(&mut self, p: Numbers<'_>, of: &Flanging<P>) {
        let none = P::zero();
        let ([x, y], wear) = flange_contact::friction(p, of);
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
        let lanes = |f: &dyn Fn(&Wheelset) -> f64| Lanes::from_fn(|i| f(&one[i]));
        WheelsetLanes {
            y: one[0].y,
            psi: one[0].psi,
            column: one[0].column,
            curvature: one[0].curvature,
            lambda: lanes(&|w| w.lambda),
            r: lanes(&|w| w.r),
            b: lanes(&|w| w.b),
            kx_r: lanes(&|w| w.kappa_x * w.n / w.r),
            kx_b: lanes(&|w| w.kappa_x * w.n * w.b),
            ky: lanes(&|w| w.kappa_y * w.n),
            ky_roll: lanes(&|w| w.kappa_y * w.n * (1.0 + w.r * w.sigma / w.b)),
            ky_roll_r: lanes(&|w| w.kappa_y * w.n * (1.0 + w.r * w.sigma / w.b) * w.r),
            ky_sigma: lanes(&|w| w.kappa_y * w.n * w.r * w.sigma / w.b + w.moves_with_rails() * w.kappa_y * w.n),
            ks: lanes(&|w| w.kappa_s * w.n),
            ks_e: lanes(&|w| {
                w.kappa_s * w.n * (w.epsilon - w.sigma) / (w.b * w.r) + w.kappa_s * w.n * w.epsilon * w.roller / w.b
            }),
            ks_tilt: lanes(&|w| {
                w.kappa_s * w.n * w.epsilon / (w.b * w.r) + w.kappa_s * w.n * w.epsilon * w.roller / w.b
            }),
            ks_delta: lanes(&|w| w.kappa_s * w.n * w.delta / w.r + w.kappa_s * w.n * w.delta * w.roller),
            n2: lanes(&|w| 2.0 * w.n),
            n2_e: lanes(&|w| 2.0 * w.n * w.epsilon / w.b),
            n2_delta: lanes(&|w| 2.0 * w.n * w.delta),
            n2_turn: lanes(&|w| 2.0 * w.n * w.turning()),
            gyro: lanes(&|w| w.i_ya * w.sigma / (w.b * w.r)),
            laws: Vec::new(),
            creeps: Vec::new(),
            rolls: Vec::new(),
            shape: None,
            rail: None,
            has_friction: false,
        }
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
    pub fn add<P: Part>(&self, part: usize, track: &Passing<'_, P>, n: usize, x: &[P; 64], dx: &mut [P; 64]) {
        let (motion, u) = self.motion(n, x);
        let (q_y, q_psi, du) = self.forces(part, track, &motion, u);
        let (iy, ipsi) = ((n + self.y) & 63, (n + self.psi) & 63);
        dx[iy] = dx[iy] + q_y;
        dx[ipsi] = dx[ipsi] + q_psi;
        if let Some(rail) = &self.rail {
            dx[rail.state & 63] = du;
        }
    }

    /// Q_y, Q_psi with the gyroscopic moments, and u' of the rail whose movement is u.
    #[inline(always)]
    pub fn forces<P: Part>(&self, part: usize, track: &Passing<'_, P>, motion: &Motion<P>, u: P) -> (P, P, P) {
        let g = |l: &Lanes| P::load(l, part);
        let Motion { psi, vy, vpsi, .. } = *motion;
        let touch = self.touch(part, track, motion, u);
        let ([tx_1, tx_2], [ty_1, ty_2]) = touch.creep();
        // (3.4); T_x1 = -t_x1, T_x2 = t_x2
        let q_y = touch.outer - ty_1 - ty_2;
        let q_psi = g(&self.b) * (psi * (g(&self.n2_turn) + ty_1 - ty_2) - (tx_1 + tx_2));
        let gyro = g(&self.gyro) * track.speed;
        (gyro.mul_add(vpsi, q_y), gyro.neg_mul_add(vy, q_psi), touch.du)
    }

    /// The guiding forces Y of the right and the left wheel on the rails, to the right.
    ///
    /// (3.4) with gamma_1, gamma_2 of (3.8); a flange presses where the wheelset has moved to.
    #[inline(always)]
    pub fn guiding<P: Part>(&self, part: usize, track: &Passing<'_, P>, n: usize, x: &[P; 64]) -> [P; 2] {
        let (motion, u) = self.motion(n, x);
        let touch = self.touch(part, track, &motion, u);
        let (Touch { outer, flange, .. }, (_, [ty_1, ty_2])) = (touch, touch.creep());
        let (none, half) = (P::zero(), P::splat(0.5));
        let gyro = P::load(&self.gyro, part) * track.speed;
        // N (gamma_1 - gamma_2)/2 with the gyroscopic moment, and N (gamma_1 + gamma_2)/2 that spreads the wheels
        let leaning = half * (flange - outer - gyro * motion.vpsi);
        let spread = half * P::load(&self.n2_delta, part);
        let right = flange.if_less(none, -flange, none);
        let left = none.if_less(flange, -flange, none);
        [leaning + spread + ty_1 + right, leaning - spread + ty_2 + left]
    }

    /// Forces of the wheels on the rails: creep forces, and other lateral forces.
    #[inline(always)]
    fn touch<P: Part>(&self, part: usize, track: &Passing<'_, P>, motion: &Motion<P>, u: P) -> Touch<P> {
        let Passing { row, speed, inv_speed } = *track;
        let Motion { y, psi, vy, mut vpsi } = *motion;
        if let Some(curvature) = self.curvature {
            // turning with the curve: b/R in the longitudinal creepage, 1/R in the spin
            vpsi = speed.mul_add(P::splat(row[curvature]), vpsi);
        }
        let g = |l: &Lanes| P::load(l, part);
        let track: &[f64] = &row[self.column..self.column + 5];
        let phi_w = P::splat(track[2]);
        let mut e = g(&self.r).neg_mul_add(phi_w, y - P::splat(track[0]));
        if let Some(rail) = &self.rail {
            e = g(&rail.alpha).neg_mul_add(u, e);
        }

        // (r_1 - r_2)/2, and what takes the place of e in gamma_1 - gamma_2
        let mut tilt = e;
        let dr = if self.rolls.is_empty() && self.shape.is_none() {
            g(&self.lambda) * e
        } else {
            let mut to = RollingRadius { shift: P::zero(), conicity: g(&self.lambda), cubic: P::zero() };
            for roll in &self.rolls {
                roll.law.roll(roll.numbers(part), g(&roll.alpha), P::splat(track[4]), row[0], &mut to);
            }
            let d = e - to.shift;
            let mut rolled = d;
            if let Some(shape) = &self.shape {
                (rolled, tilt) = shape.at(part, d, P::splat(track[4]), e);
            }
            to.conicity * rolled * (to.cubic * d).mul_add(d, P::splat(1.0))
        };

        // creepages (3.5) into (3.3), without and with the contact angle: t_x = kappa_x N (dr/r + b psi'/V),
        // t_y = kappa_y N u_y + kappa_s N u_n, where phi' = phi_w' - sigma e'/b and y_w'/V = dy_w/ds
        let tx = g(&self.kx_r).mul_add(dr, g(&self.kx_b) * vpsi * inv_speed);
        let moving = g(&self.ky_roll).mul_add(vy, g(&self.ks) * vpsi);
        let prepared = g(&self.ky_sigma).mul_add(P::splat(track[1]), g(&self.ky_roll_r) * P::splat(track[3]));
        let turned = g(&self.ks_tilt).mul_add(tilt - e, g(&self.ks_e) * e);
        let ty = moving.mul_add(inv_speed, -(g(&self.ky).mul_add(psi, prepared) + turned));
        let ty_delta = g(&self.ks_delta);
        let gravity = g(&self.n2_e).neg_mul_add(tilt, g(&self.n2) * phi_w);
        // the part of t_y that is spin
        let spin = (g(&self.ks) * vpsi).mul_add(inv_speed, -turned);
        let mut flange = P::zero();
        let mut friction = self.has_friction.then(SlidingFlanges::none);
        for law in &self.laws {
            let de = if law.looks_at_speed {
                g(&self.r).neg_mul_add(P::splat(track[3]), P::splat(-track[1])).mul_add(speed, vy)
            } else {
                P::zero()
            };
            let mut unused = P::zero();
            let f = if law.law == Law::FlangeContactInGauge {
                in_gauge(law.numbers(part), e, track[4])
            } else {
                law.law.force(law.numbers(part), e, de, row[0], P::zero(), &mut unused)
            };
            flange = g(&law.alpha).mul_add(f, flange);
            if let (Some(friction), true) = (&mut friction, law.has_friction_numbers()) {
                let force = g(&law.alpha) * f;
                friction.add(law.numbers(part), &Flanging { force, tx, ty: ty - spin, kx_r: g(&self.kx_r) });
            }
        }
        let outer = gravity + flange;

        let mut ty_1 = ty - ty_delta;
        let mut ty_2 = ty + ty_delta;
        let (mut tx_1, mut tx_2) = (tx, tx);
        let creeps = if self.creeps.is_empty() {
            None
        } else {
            Some(Slipping { tx, spin: [spin - ty_delta, spin + ty_delta], speed })
        };
        let mut du = P::zero();
        if let Some(rail) = &self.rail {
            // what u' takes off the creep force of each wheel, through y' - u' and through the roll
            let share = g(&rail.alpha) * g(&self.ky_roll) * inv_speed;
            // the speed at which the rail yields is small against that of a sliding flange
            let pushed = friction.map_or(outer, |f| outer - f.ty[0] - f.ty[1]);
            let still = g(&rail.stiffness).mul_add(u, pushed);
            du = self.yielding(part, g(&rail.damping), still, share, creeps.as_ref(), [ty_1, ty_2]);
            (ty_1, ty_2) = (share.neg_mul_add(du, ty_1), share.neg_mul_add(du, ty_2));
        }
        if let Some(creeps) = &creeps {
            ([tx_1, ty_1], [tx_2, ty_2]) = self.creep_forces(part, creeps, ty_1, ty_2);
        }
        Touch { outer, flange, linear: tx, tx: [tx_1, tx_2], ty: [ty_1, ty_2], du, friction }
    }

    /// Equilibrium of a wheelset at rest in a curve of curvature 1/R without irregularities: turning with
    /// the curve it has the creepages that docs/theory.md adds, b/R and 1/R, and no gyroscopic moment.
    pub fn standing<P: Part>(&self, part: usize, row: &[f64], curvature: P, y: P, psi: P, u: P) -> Standing<P> {
        let g = |l: &Lanes| P::load(l, part);
        let e = self.rail.as_ref().map_or(y, |rail| g(&rail.alpha).neg_mul_add(u, y));
        let still = WheelsetLanes { rail: None, curvature: None, ..self.clone() };
        let track = Passing { row, speed: P::splat(1.0), inv_speed: P::splat(1.0) };
        let motion = Motion { y: e, psi, vy: P::zero(), vpsi: curvature };
        let touch = still.touch(part, &track, &motion, P::zero());
        let (q_y, q_psi, _) = still.forces(part, &track, &motion, P::zero());
        let q_y = g(&self.gyro).neg_mul_add(curvature, q_y);
        let rail = self.rail.as_ref().map_or(P::zero(), |rail| g(&rail.stiffness).mul_add(u, q_y));
        let creepage = touch.linear / (g(&self.kx_r) * g(&self.r));
        let flange_wear = touch.friction.map_or(P::zero(), |f| f.wear);
        Standing { e, q_y, q_psi, creepage, rail, tx: [-touch.tx[0], touch.tx[1]], ty: touch.ty, flange_wear }
    }

    /// u' of the rail from k_r u + c_r u' = -Q_y, in which Q_y holds u' through the lateral creepage.
    ///
    /// `still`: k_r u + Q_y without creep forces; `ty`: those at u' = 0. With saturation the sum's slope lies between
    /// c_r and c_r + 2 share, which bounds Newton's steps; a converged lane stays, whatever its neighbours do.
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
        let at_rest = sum(none);
        let (near, far) = (-at_rest / steepest, -at_rest / damping);
        let (mut low, mut high) = (near.min(far), near.max(far));
        let nudge = (high - low).mul_add(P::splat(1e-7), P::splat(1e-9));
        let (mut du, mut on_the_way) = (near, one);
        for _ in 0..40 {
            let total = sum(du);
            low = total.if_less(none, du, low);
            high = total.if_less(none, high, du);
            let slope = ((sum(du + nudge) - total) / nudge).max(damping);
            let step = du - total / slope;
            let middle = half * (low + high);
            let inside = step.if_less(low, middle, high.if_less(step, middle, step));
            let moved = (inside - du).abs();
            du = on_the_way.if_less(half, du, inside);
            let near_enough = inside.abs().mul_add(P::splat(1e-9), P::splat(1e-13));
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
            for wheel in &mut wheels {
                let mut acts_fully = creep.law.creep(creep.numbers(part), wheel);
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
