//! Joints between two bodies: springs, dampers and laws, the weight that they carry, their ports.
use super::motion::{Motion, Placed, drive};
use super::{Acts, Joint, Layout, Number, Point, Way};
use crate::effects::Law;
use crate::effects::effect::Site;
use crate::vehicle::assembly::{Assembly, OwnLaw, Port};

/// Largest force of a damper without blow-off [N, or N m].
const UNLIMITED: f64 = 1e9;

/// A moment of the suspension forces on a wheelset: per motion, per rate.
#[derive(Clone, Debug, Default)]
pub(super) struct Moment {
    pub(super) of_springs: Motion,
    pub(super) of_dampers: Motion,
}

/// Moments of the suspension forces on a wheelset about the middle of the track and about its axle; those of stops and of
/// springs and dampers in series are left out.
#[derive(Clone, Debug, Default)]
pub(super) struct Transfer {
    pub(super) track: Moment,
    pub(super) axle: Moment,
}

/// From the point on the first body to that on the second, and how both move apart.
struct Span {
    from: [f64; 3],
    to: [f64; 3],
    between: [Motion; 3],
    /// In yaw and roll.
    turned: [Motion; 2],
}

impl Span {
    /// The motion that a term acts on.
    fn row(&self, way: Way) -> Motion {
        match way {
            Way::Longitudinal => self.between[0].clone(),
            Way::Lateral => self.between[1].clone(),
            Way::Vertical => self.between[2].clone(),
            Way::Yaw => self.turned[0].clone(),
            Way::Roll => self.turned[1].clone(),
            Way::Along => {
                let line = self.line();
                (0..3).fold(Motion::default(), |sum, i| sum.plus(&self.between[i], line[i]))
            }
        }
    }

    /// Which of the ports lateral, yaw, roll, along a term belongs to, and what a unit of it counts there.
    fn port(&self, way: Way) -> (usize, f64) {
        let arm = self.from[1];
        match way {
            Way::Lateral => (0, 1.0),
            Way::Yaw => (1, 1.0),
            Way::Longitudinal => (1, arm * arm),
            Way::Roll => (2, 1.0),
            Way::Vertical => (2, arm * arm),
            Way::Along => (3, 1.0),
        }
    }

    /// The arms of a term's force about a height above the rails, as it acts on the first body and on the second.
    fn arms(&self, way: Way, height: f64) -> [f64; 2] {
        let line = self.line();
        let [from, to] = [self.from, self.to].map(|end| match way {
            Way::Lateral => end[2] - height,
            Way::Vertical => end[1],
            Way::Roll => 1.0,
            Way::Along => line[1] * (end[2] - height) + line[2] * end[1],
            Way::Longitudinal | Way::Yaw => 0.0,
        });
        [-from, to]
    }

    /// Direction from the point on the first body to that on the second; heights count upwards, u_z downwards.
    fn line(&self) -> [f64; 3] {
        let Span { from, to, .. } = self;
        let line = [to[0] - from[0], to[1] - from[1], from[2] - to[2]];
        let length = line.iter().map(|l| l * l).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
        line.map(|l| l / length)
    }
}

impl Layout {
    pub(super) fn join(
        &self,
        vehicle: &mut Assembly,
        joint: &Joint,
        (placed, ground): (&[Placed], &Placed),
        transfers: &mut [Transfer],
        value: &dyn Fn(&Number) -> f64,
    ) {
        let bodies = joint.bodies.map(|body| body.map_or(ground, |i| &placed[i]));
        let span = self.span(joint, bodies, value);
        // left and right see the same motion or its opposite: both are one row, twice as strong
        let sides = if joint.mirrored { 2.0 } else { 1.0 };
        // lateral, yaw, roll, along: the linear terms at each port
        let mut declared = [[0.0; 2]; 4];
        for (way, acts) in &joint.terms {
            let motion = span.row(*way);
            let (port, arm) = span.port(*way);
            let mut add_moment = |law: f64, of: fn(&mut Moment) -> &mut Motion| {
                for (end, i) in self.wheelset_ends(joint) {
                    let Transfer { track, axle } = &mut transfers[i];
                    for (moment, height) in [(track, 0.0), (axle, placed[i].height)] {
                        let sum = of(moment);
                        *sum = sum.plus(&motion, span.arms(*way, height)[end] * law);
                    }
                }
            };
            match acts {
                Acts::Spring(k) => {
                    let k = sides * value(k);
                    add_moment(k, |moment| &mut moment.of_springs);
                    vehicle.spring(&motion.row, k);
                    drive(&mut vehicle.inputs, &motion.row, &motion.inputs, k);
                    declared[port][0] += k * arm;
                }
                Acts::Damper(c) => {
                    let c = sides * value(c);
                    add_moment(c, |moment| &mut moment.of_dampers);
                    vehicle.damper(&motion.row, c);
                    drive(&mut vehicle.rates, &motion.row, &motion.slopes(), c);
                    declared[port][1] += c * arm;
                }
                Acts::Series(numbers) => {
                    let [stiffness, damping, most] = numbers;
                    let most = if most.is_empty() { UNLIMITED } else { sides * value(most) };
                    let numbers = [sides * value(stiffness), sides * value(damping), most];
                    own(vehicle, Law::SERIES, motion, numbers.into_iter());
                }
                Acts::Stop([gap, k]) => own(vehicle, Law::STOP, motion, [value(gap), sides * value(k)].into_iter()),
            }
        }
        if !joint.static_load.is_empty() {
            let load = sides * value(&joint.static_load);
            carry(vehicle, load, bodies, &span);
            for (end, i) in self.wheelset_ends(joint) {
                let axle = &mut transfers[i].axle.of_springs;
                *axle = axle.plus(&leaning_moment(&span, end, placed[i].height), load);
            }
        }
        self.ports(vehicle, joint, declared, &span, bodies.iter().any(|body| body.rolls));
    }

    /// The ends of a joint that are wheelsets: which of its two ends, and which body.
    fn wheelset_ends(&self, joint: &Joint) -> impl Iterator<Item = (usize, usize)> {
        let wheelset = |body: Option<usize>| body.filter(|i| self.bodies[*i].wheels.is_some());
        joint.bodies.into_iter().enumerate().filter_map(move |(end, body)| Some((end, wheelset(body)?)))
    }

    fn span(&self, joint: &Joint, [a, b]: [&Placed; 2], value: &dyn Fn(&Number) -> f64) -> Span {
        let at = |point: &Point| point.each_ref().map(value);
        let seen = |i: usize| at(&self.seen(joint.bodies[i], &joint.points[i]));
        let (first, second) = (a.point(seen(0)), b.point(seen(1)));
        Span {
            from: at(&joint.points[0]),
            to: at(&joint.points[1]),
            between: [0, 1, 2].map(|i| first[i].plus(&second[i], -1.0)),
            turned: [a.psi.plus(&b.psi, -1.0), a.phi.plus(&b.phi, -1.0)],
        }
    }

    /// The ports of a joint: NAME_lateral, NAME_yaw, NAME_roll, and NAME where it acts along a line.
    fn ports(&self, vehicle: &mut Assembly, joint: &Joint, declared: [[f64; 2]; 4], span: &Span, rolls: bool) {
        let wheeled = self.wheelset_ends(joint).next().is_some();
        let along = joint.terms.iter().any(|(way, _)| *way == Way::Along);
        let shown = [!along, !along, !along && rolls, along];
        let [lateral, yaw] =
            if wheeled { ["primary_lateral", "primary_yaw"] } else { ["secondary_lateral", "secondary_yaw"] };
        let rows = [Way::Lateral, Way::Yaw, Way::Roll, Way::Along].map(|way| span.row(way));
        for (i, (end, class)) in
            [("_lateral", lateral), ("_yaw", yaw), ("_roll", yaw), ("", lateral)].into_iter().enumerate()
        {
            if shown[i] {
                vehicle.ports.push(Port {
                    at: format!("{}{end}", joint.name).into(),
                    class,
                    wheelset: joint.number,
                    row: rows[i].row.clone(),
                    inputs: rows[i].inputs.clone(),
                    reaction: None,
                    site: Site::moving(class, declared[i][0], declared[i][1]),
                });
            }
        }
    }
}

/// A weight P of the second body b on the first a through a spring that leans as both on the mean:
/// V = P (d_b phi_b^2 - d_a phi_a^2)/2 - P (phi_a + phi_b)/2 (u_b - u_a), d the heights of its ends above the centres.
fn carry(vehicle: &mut Assembly, load: f64, [a, b]: [&Placed; 2], span: &Span) {
    let Span { from, to, between: [_, apart, _], .. } = span;
    for (body, point, sign) in [(b, to, 1.0), (a, from, -1.0)] {
        if body.rolls {
            vehicle.spring(&body.phi.row, sign * load * (point[2] - body.height));
        }
    }
    // x y^T + y x^T = ((x + y)(x + y)^T - (x - y)(x - y)^T)/2 with x the lean and y = u_a - u_b
    let lean = a.phi.times(0.5).plus(&b.phi, 0.5);
    for (sign, motion) in [(0.5, lean.plus(apart, 1.0)), (-0.5, lean.plus(apart, -1.0))] {
        vehicle.spring(&motion.row, sign * load);
        drive(&mut vehicle.inputs, &motion.row, &motion.inputs, sign * load);
    }
}

/// The moment of a weight of 1 N, carried as above, on the first body or the second about a height:
/// (u_b - u_a)/2 + d (phi_a - phi_b)/2.
fn leaning_moment(span: &Span, end: usize, height: f64) -> Motion {
    let d = [span.from, span.to][end][2] - height;
    span.between[1].times(-0.5).plus(&span.turned[1], 0.5 * d)
}

fn own(vehicle: &mut Assembly, law: Law, motion: Motion, numbers: impl Iterator<Item = f64>) {
    vehicle.laws.push(OwnLaw { law, row: motion.row, inputs: motion.inputs, numbers: numbers.collect() });
}
