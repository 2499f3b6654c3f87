//! A wheelset with any laws at its contact: rolling radii, creep forces, flanges, a rail that yields.
use crate::effects::PlacedLaw;
use crate::effects::effect::{Creeping, Flanging, RollingRadius};
use crate::numeric::profile_table::ShapeLanes;
use crate::simd::{Lanes, Part, STATES, Work};
use crate::wheel_rail::coefficients::Contact;
use crate::wheel_rail::contact::{AtSpeed, Displacement, Motion, Pulls, Slip, under};

/// A wheelset of sixteen vehicles and the laws at its contact.
#[derive(Clone, Debug)]
pub struct WheelsetLanes {
    pub y: usize,
    pub psi: usize,
    pub column: usize,
    pub(super) curvature: Option<usize>,
    /// In newtons, without conicity, saturation and flange.
    pub(super) contact: Contact<Lanes>,
    pub(super) lambda: Lanes,
    pub r: Lanes,
    /// N delta, which spreads the wheels.
    pub(super) spread: Lanes,
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
pub(super) struct Slipping<P> {
    tx: P,
    spin: [P; 2],
    speed: P,
}

/// Forces on the wheelset by gravitation and at the flange; on the rails t_x of the linear law, t_x and t_y of the treads as the
/// creep laws make them (T_x1 = -t_x1, T_x2 = t_x2); u' of the rail, friction at the flanges.
#[derive(Clone, Copy)]
pub(super) struct Touch<P> {
    pub(super) gravitation: P,
    pub(super) flange: P,
    pub(super) linear: P,
    pub(super) tx: [P; 2],
    pub(super) ty: [P; 2],
    pub(super) du: P,
    pub(super) friction: Option<SlidingFlanges<P>>,
}

/// Creep forces of both wheels at their flanges, of which one touches, and friction times creepage.
#[derive(Clone, Copy)]
pub(super) struct SlidingFlanges<P> {
    pub(super) tx: [P; 2],
    pub(super) ty: [P; 2],
    pub(super) wear: P,
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
    pub(super) fn creep(&self) -> ([P; 2], [P; 2]) {
        let (tx, ty) = (self.tx, self.ty);
        let Some(SlidingFlanges { tx: x, ty: y, .. }) = self.friction else { return (tx, ty) };
        ([tx[0] + x[0], tx[1] + x[1]], [ty[0] + y[0], ty[1] + y[1]])
    }
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
    /// Its contact in newtons at a speed and its inverse.
    #[inline(always)]
    pub(super) fn contact_at<P: Part>(&self, at: usize, speed: P, inv_speed: P) -> (Contact<P>, AtSpeed<P>) {
        let contact = self.contact.part::<P>(at);
        (contact, contact.at_speed(speed, inv_speed))
    }

    /// Motion of the wheelset, and u of the rail under it; x: n degrees of freedom, their rates, own states.
    #[inline(always)]
    pub(super) fn motion<P: Part>(&self, n: usize, x: &[P; STATES]) -> (Motion<P>, P) {
        let (y, psi) = (self.y, self.psi);
        let motion =
            Motion { y: x[y % STATES], psi: x[psi % STATES], vy: x[(n + y) % STATES], vpsi: x[(n + psi) % STATES] };
        (motion, self.rail.as_ref().map_or(P::zero(), |rail| x[rail.state % STATES]))
    }

    /// Adds Q_y, Q_psi and the gyroscopic moments to the forces dx[n ..], and u' where the rail yields.
    #[inline(always)]
    pub fn add<P: Part>(
        &self,
        part: usize,
        contact: Touching<'_, P>,
        track: &Passing<'_, P>,
        n: usize,
        x: &[P; STATES],
        dx: &mut [P; STATES],
    ) {
        let (motion, u) = self.motion(n, x);
        let (q_y, q_psi, du) = self.forces(part, contact, track, &motion, u);
        let (iy, ipsi) = ((n + self.y) % STATES, (n + self.psi) % STATES);
        dx[iy] = dx[iy] + q_y;
        dx[ipsi] = dx[ipsi] + q_psi;
        if let Some(rail) = &self.rail {
            dx[rail.state % STATES] = du;
        }
    }

    /// Q_y, Q_psi with the gyroscopic moments, and u' of the rail whose movement is u.
    #[inline(always)]
    pub(super) fn forces<P: Part>(
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

    /// Creep forces on the rails, and other lateral forces on the wheelset.
    #[inline(always)]
    pub(super) fn touch<P: Part>(
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

    /// T_x, T_y of both wheels where the linear law gives t_x and t_y.
    #[inline(always)]
    pub(super) fn creep_forces<P: Part>(
        &self,
        part: usize,
        &Slipping { tx, spin, speed }: &Slipping<P>,
        ty_1: P,
        ty_2: P,
    ) -> ([P; 2], [P; 2]) {
        let mut wheels =
            [Creeping { tx, ty: ty_1, spin: spin[0], speed }, Creeping { tx, ty: ty_2, spin: spin[1], speed }];
        for creep in &self.creeps {
            let forces = creep.law.creep(creep.numbers(part), &wheels);
            for i in 0..2 {
                let (wheel, mut force) = (&mut wheels[i], forces[i]);
                if !creep.acts_fully {
                    let alpha = P::load(&creep.alpha, part);
                    force = [blend(alpha, wheel.tx, force[0]), blend(alpha, wheel.ty, force[1])];
                }
                [wheel.tx, wheel.ty] = force;
            }
        }
        ([wheels[0].tx, wheels[0].ty], [wheels[1].tx, wheels[1].ty])
    }
}

/// As much of the way from the linear law to a full one as the amount says; amount 1 has the same digits as the full one.
#[inline(always)]
fn blend<P: Part>(alpha: P, linear: P, full: P) -> P {
    let (one, partly) = (P::splat(1.0), alpha.mul_add(full - linear, linear));
    alpha.if_less(one, partly, one.if_less(alpha, partly, full))
}

/// The contacts of a part of the lanes with any laws, at the present speed.
pub struct Contacts<'a, P> {
    wheelsets: &'a [WheelsetLanes],
    at: usize,
    terms: Vec<(Contact<P>, AtSpeed<P>)>,
    /// Speed of the last row of the input table, and that of the lanes.
    row_speed: f64,
    speed: P,
    /// Share of the speed, and its inverse.
    scales: [P; 2],
}

impl<'a, P: Part> Contacts<'a, P> {
    /// The lanes from `at` on, at a share of the speed.
    pub fn new(wheelsets: &'a [WheelsetLanes], scales: [&Lanes; 2], at: usize) -> Self {
        let terms = wheelsets.iter().map(|wheelset| wheelset.contact_at(at, P::zero(), P::zero())).collect();
        let scales = scales.map(|scale| P::load(scale, at));
        Contacts { wheelsets, at, terms, row_speed: f64::NAN, speed: P::zero(), scales }
    }

    #[inline(always)]
    fn set_speed(&mut self, speed: f64) {
        let [share, inv_share] = self.scales;
        (self.row_speed, self.speed) = (speed, P::splat(speed) * share);
        let inv_speed = P::splat(1.0 / speed) * inv_share;
        for (contact, at_speed) in &mut self.terms {
            *at_speed = contact.at_speed(self.speed, inv_speed);
        }
    }

    /// Adds the contact forces to those of the n degrees of freedom in dx, and rates of the rails that yield.
    #[inline(always)]
    pub fn add(&mut self, row: &[f64], n: usize, x: &[P; STATES], dx: &mut [P; STATES]) {
        if row[1] != self.row_speed {
            self.set_speed(row[1]);
        }
        P::out_of_line(Wheels { contacts: self, row, n, x, dx });
    }
}

struct Wheels<'l, P> {
    contacts: &'l Contacts<'l, P>,
    row: &'l [f64],
    n: usize,
    x: &'l [P; STATES],
    dx: &'l mut [P; STATES],
}

impl<P: Part> Work for Wheels<'_, P> {
    #[inline(always)]
    fn run(self) {
        let Wheels { contacts, row, n, x, dx } = self;
        let track = Passing { row, speed: contacts.speed };
        for (wheelset, contact) in contacts.wheelsets.iter().zip(&contacts.terms) {
            wheelset.add(contacts.at, contact, &track, n, x, dx);
        }
    }
}
