//! Vehicles as bodies and elements: rigid bodies that move laterally, yaw and roll, joined between points.
//!
//! A point at (x, y, h) of a body whose centre of mass is at (x_0, 0, h_0), h the height above the rails, moves by
//! u_x = -psi y, u_y = y + psi (x - x_0) + phi (h - h_0), u_z = phi y: axes x forward, y right, z down.
use crate::assemble::{Assembly, Inputs, Order, OwnLaw, Port, Row};
use crate::effects::Law;
use crate::effects::effect::Site;
use crate::error::{Error, Result, expect_len};
use crate::wheelset::Wheelset;

/// A number made of those of the design: the sum of factor times number; empty: 0.
pub type Number = Vec<(f64, usize)>;

/// Where a point lies: x, y, height above the rails.
pub type Point = [Number; 3];

/// What makes a body a wheelset; its roll is the track's and that of its own lateral displacement.
#[derive(Clone, Debug)]
pub struct Wheels {
    pub spin_inertia: Number,
    pub half_gauge: Number,
    pub rolling_radius: Number,
    pub wheel_load: Number,
    /// lambda, kappa_x, kappa_y, epsilon, delta, sigma
    pub contact: [Number; 6],
    pub spin_creep: Number,
}

/// A rigid body; without a yaw or roll inertia it does not yaw or roll.
#[derive(Clone, Debug)]
pub struct Body {
    pub name: String,
    /// The name that it shares with its like, and its number among them (0: the only one).
    pub family: String,
    pub number: u8,
    pub mass: Number,
    pub yaw_inertia: Option<Number>,
    pub roll_inertia: Option<Number>,
    pub x: Number,
    pub height: Number,
    pub wheels: Option<Wheels>,
}

/// The direction in which a term acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    Longitudinal,
    Lateral,
    Vertical,
    Yaw,
    Roll,
    /// Along the line from the point on the first body to that on the second.
    Along,
}

#[derive(Clone, Debug)]
pub enum Acts {
    Spring(Number),
    Damper(Number),
    /// Stiffness, damping and largest force of a spring and a damper in series.
    Series([Number; 3]),
    /// Gap and stiffness of a stop.
    Stop([Number; 2]),
}

/// What acts between two bodies, the motion being that of the first less that of the second (none: the ground).
#[derive(Clone, Debug)]
pub struct Joint {
    pub name: String,
    pub number: u8,
    pub bodies: [Option<usize>; 2],
    pub points: [Point; 2],
    /// The same again on the other side of the vehicle, at -y.
    pub mirrored: bool,
    pub terms: Vec<(Way, Acts)>,
    /// The weight that it carries, of the second body on the first.
    pub static_load: Number,
}

/// A place on a body where comfort is felt.
#[derive(Clone, Debug)]
pub struct Floor {
    pub name: String,
    pub body: usize,
    pub point: Point,
}

/// A vehicle as a list of bodies (wheelsets from the front to the rear) and what joins them.
#[derive(Clone, Debug, Default)]
pub struct Layout {
    /// How many numbers describe it.
    pub numbers: usize,
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    pub floor: Vec<Floor>,
}

const GRAVITY: f64 = 9.81;
/// Force of a damper without blow-off [N].
const UNLIMITED: f64 = 1e9;
/// Columns s and v, before those of the wheelsets; Qy and Qpsi stand behind them.
const FIRST: usize = 2;
const PER_WHEELSET: usize = 5;

/// A linear motion: terms of q and of the input table.
#[derive(Clone, Debug, Default)]
struct Motion {
    row: Row,
    inputs: Inputs,
}

impl Motion {
    fn of(dof: Option<usize>) -> Self {
        Motion { row: dof.map(|i| (i, 1.0)).into_iter().collect(), inputs: Inputs::new() }
    }

    fn plus(&self, other: &Motion, factor: f64) -> Self {
        Motion { row: sum(&self.row, &other.row, factor), inputs: sum(&self.inputs, &other.inputs, factor) }
    }

    fn times(&self, factor: f64) -> Self {
        Motion::default().plus(self, factor)
    }

    fn slopes(&self) -> Inputs {
        self.inputs.iter().map(|(column, factor)| (column + 1, *factor)).collect()
    }
}

/// The moment about the middle of the track that the suspension lays on a wheelset: of its motion, of its rates.
#[derive(Clone, Debug, Default)]
struct Transfer {
    held: Motion,
    damped: Motion,
}

/// Terms of a + factor b, each place once; nothing is left out, so that all vehicles of a layout have the same terms.
fn sum(a: &[(usize, f64)], b: &[(usize, f64)], factor: f64) -> Vec<(usize, f64)> {
    let mut terms = a.to_vec();
    for &(i, value) in b {
        match terms.iter_mut().find(|(j, _)| *j == i) {
            Some((_, old)) => *old += factor * value,
            None => terms.push((i, factor * value)),
        }
    }
    terms
}

/// a - b
fn less(a: &Number, b: &Number) -> Number {
    let mut terms = a.clone();
    for &(factor, i) in b {
        match terms.iter_mut().find(|(_, j)| *j == i) {
            Some((old, _)) => *old -= factor,
            None => terms.push((-factor, i)),
        }
    }
    terms
}

/// A body among the degrees of freedom.
struct Placed {
    y: Motion,
    psi: Motion,
    phi: Motion,
    rolls: bool,
    x: f64,
    height: f64,
}

impl Placed {
    fn ground() -> Self {
        let still = Motion::default;
        Placed { y: still(), psi: still(), phi: still(), rolls: false, x: 0.0, height: 0.0 }
    }

    /// u_x, u_y, u_z of a point, seen from the centre of mass.
    fn point(&self, [x, y, h]: [f64; 3]) -> [Motion; 3] {
        let lateral = self.y.plus(&self.psi, x).plus(&self.phi, h);
        [self.psi.times(-y), lateral, self.phi.times(y)]
    }
}

impl Layout {
    /// Columns of the input table: s, v, five per wheelset, Qy, Qpsi.
    pub fn columns(&self) -> usize {
        FIRST + PER_WHEELSET * self.wheelsets().count() + 2
    }

    /// Every index within its list, every wheelset free to yaw.
    pub fn check(&self) -> Result<()> {
        let bodies =
            self.joints.iter().flat_map(|j| j.bodies.iter().flatten()).chain(self.floor.iter().map(|f| &f.body));
        let most = bodies.max().map_or(0, |i| i + 1);
        if most > self.bodies.len() {
            return Err(Error::Shape { what: "bodies of a layout".into(), got: self.bodies.len(), expected: most });
        }
        match self.wheelsets().find(|(_, body, _)| body.yaw_inertia.is_none()) {
            Some((_, body, _)) => Err(Error::Value {
                what: format!("yaw inertia of {}", body.name),
                value: 0.0,
                rule: "given for a wheelset",
            }),
            None => Ok(()),
        }
    }

    fn wheelsets(&self) -> impl Iterator<Item = (usize, &Body, &Wheels)> {
        self.bodies.iter().enumerate().filter_map(|(i, body)| Some((i, body, body.wheels.as_ref()?)))
    }

    /// Assemble the vehicle of these numbers: bodies, then joints, then what is looked at.
    pub fn assemble(&self, p: &[f64]) -> Result<Assembly> {
        expect_len("numbers of a vehicle", p.len(), self.numbers)?;
        // a place that no number has reads as not a number, which the masses then tell
        let at = |i: usize| p.get(i).copied().unwrap_or(f64::NAN);
        let value = |number: &Number| number.iter().map(|(factor, i)| factor * at(*i)).sum::<f64>();
        let mut masses = Vec::new();
        let mut placed = Vec::new();
        for body in &self.bodies {
            let mut dof = |letter: &str, mass: Option<&Number>| {
                mass.map(|m| {
                    masses.push((format!("{letter}.{}", body.name), value(m)));
                    masses.len() - 1
                })
            };
            let (y, psi) = (dof("y", Some(&body.mass)), dof("psi", body.yaw_inertia.as_ref()));
            let phi = dof("phi", body.roll_inertia.as_ref());
            let (x, height) = (value(&body.x), value(&body.height));
            let rolls = phi.is_some();
            placed.push(Placed { y: Motion::of(y), psi: Motion::of(psi), phi: Motion::of(phi), rolls, x, height });
        }
        let named: Vec<_> = masses.iter().map(|(name, mass)| (name.as_str(), *mass)).collect();
        let mut vehicle = Assembly::of(&named);
        vehicle.check_masses()?;
        let mut first = None;
        for (i, (at, _, wheels)) in self.wheelsets().enumerate() {
            let mut wheelset = wheelset(wheels, &placed[at], FIRST + PER_WHEELSET * i, &value);
            wheelset.behind = *first.get_or_insert(placed[at].x) - placed[at].x;
            let turn = wheelset.sigma / wheelset.b;
            let (y, column) = (wheelset.y, wheelset.column);
            // phi_i = phi_w - sigma e/b, e = y - y_w - r phi_w
            let inputs = vec![(column, turn), (column + 2, 1.0 + wheelset.r * turn)];
            placed[at].phi = Motion { row: vec![(y, -turn)], inputs };
            vehicle.wheelsets.push(wheelset);
        }
        let mut transfers = vec![Transfer::default(); self.bodies.len()];
        for joint in &self.joints {
            self.join(&mut vehicle, joint, &placed, &mut transfers, &value);
        }
        for (body, at) in self.bodies.iter().zip(&placed) {
            self.outer(&mut vehicle, body, at);
        }
        self.look(&mut vehicle, &placed, &value);
        for (i, (at, ..)) in self.wheelsets().enumerate() {
            Self::load_transfer(&mut vehicle, i, &transfers[at]);
        }
        vehicle.port_channels();
        Ok(vehicle)
    }

    /// A point as it is seen from the centre of mass of its body; what both lie apart from leaves nothing, not even rounding.
    fn seen(&self, body: Option<usize>, [x, y, height]: &Point) -> Point {
        let Some(body) = body.map(|i| &self.bodies[i]) else { return [x.clone(), y.clone(), height.clone()] };
        [less(x, &body.x), y.clone(), less(height, &body.height)]
    }

    fn join(
        &self,
        vehicle: &mut Assembly,
        joint: &Joint,
        placed: &[Placed],
        transfers: &mut [Transfer],
        value: &dyn Fn(&Number) -> f64,
    ) {
        let ground = Placed::ground();
        let [a, b] = joint.bodies.map(|body| body.map_or(&ground, |i| &placed[i]));
        let at = |point: &Point| [0, 1, 2].map(|i| value(&point[i]));
        let [from, to] = [at(&joint.points[0]), at(&joint.points[1])];
        let seen = |i: usize| self.seen(joint.bodies[i], &joint.points[i]).each_ref().map(value);
        let (first, second) = (a.point(seen(0)), b.point(seen(1)));
        let between = |i: usize| first[i].plus(&second[i], -1.0);
        let turned = [a.psi.plus(&b.psi, -1.0), a.phi.plus(&b.phi, -1.0)];
        // left and right see the same motion or its opposite: both are one row, twice as strong
        let sides = if joint.mirrored { 2.0 } else { 1.0 };
        let row = |way: Way| match way {
            Way::Longitudinal => between(0),
            Way::Lateral => between(1),
            Way::Vertical => between(2),
            Way::Yaw => turned[0].clone(),
            Way::Roll => turned[1].clone(),
            Way::Along => {
                // heights count upwards, u_z downwards
                let line = [to[0] - from[0], to[1] - from[1], from[2] - to[2]];
                let length = line.iter().map(|l| l * l).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
                (0..3).fold(Motion::default(), |sum, i| sum.plus(&between(i), line[i] / length))
            }
        };
        // lateral, yaw, roll, along: the linear terms at each place
        let mut declared = [[0.0; 2]; 4];
        for (way, acts) in &joint.terms {
            let motion = row(*way);
            let mut told = |k: f64, c: f64| {
                let (place, arm) = match way {
                    Way::Lateral => (0, 1.0),
                    Way::Yaw => (1, 1.0),
                    Way::Longitudinal => (1, from[1] * from[1]),
                    Way::Roll => (2, 1.0),
                    Way::Vertical => (2, from[1] * from[1]),
                    Way::Along => (3, 1.0),
                };
                declared[place][0] += k * arm;
                declared[place][1] += c * arm;
            };
            // the arm of its force about the middle of the track, on the first body and on the second
            let arms = [from, to].map(|end| match way {
                Way::Lateral => end[2],
                Way::Vertical => end[1],
                Way::Roll => 1.0,
                _ => 0.0,
            });
            let mut lay = |law: f64, damped: bool| {
                for (end, arm) in joint.bodies.iter().zip([-arms[0], arms[1]]) {
                    let Some(i) = end.filter(|i| self.bodies[*i].wheels.is_some()) else { continue };
                    let moment = if damped { &mut transfers[i].damped } else { &mut transfers[i].held };
                    *moment = moment.plus(&motion, arm * law);
                }
            };
            match acts {
                Acts::Spring(k) => {
                    let k = sides * value(k);
                    lay(k, false);
                    vehicle.spring(&motion.row, k);
                    drive(&mut vehicle.inputs, &motion.row, &motion.inputs, k);
                    told(k, 0.0);
                }
                Acts::Damper(c) => {
                    let c = sides * value(c);
                    lay(c, true);
                    vehicle.damper(&motion.row, c);
                    drive(&mut vehicle.rates, &motion.row, &motion.slopes(), c);
                    told(0.0, c);
                }
                Acts::Series(numbers) => {
                    let limited = |n: &Number| if n.is_empty() { UNLIMITED } else { sides * value(n) };
                    own(vehicle, Law::MaxwellDamper, motion, numbers.iter().map(limited));
                }
                Acts::Stop([gap, k]) => own(vehicle, Law::BumpStop, motion, [value(gap), sides * value(k)].into_iter()),
            }
        }
        if !joint.static_load.is_empty() {
            self.carry(vehicle, sides * value(&joint.static_load), [a, b], [from, to], &between(1));
        }
        self.places(
            vehicle,
            joint,
            declared,
            [row(Way::Lateral), row(Way::Yaw), row(Way::Roll), row(Way::Along)],
            a.rolls || b.rolls,
        );
    }

    /// A weight P of the second body b on the first a through a spring that leans as both on the mean:
    /// V = P (d_b phi_b^2 - d_a phi_a^2)/2 - P (phi_a + phi_b)/2 (u_b - u_a), d the heights of its ends above the centres.
    fn carry(
        &self,
        vehicle: &mut Assembly,
        load: f64,
        [a, b]: [&Placed; 2],
        [from, to]: [[f64; 3]; 2],
        apart: &Motion,
    ) {
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

    /// The ports of a joint: NAME_lateral, NAME_yaw, NAME_roll, and NAME where it acts along a line.
    fn places(&self, vehicle: &mut Assembly, joint: &Joint, declared: [[f64; 2]; 4], rows: [Motion; 4], rolls: bool) {
        let wheeled = joint.bodies.iter().flatten().any(|i| self.bodies[*i].wheels.is_some());
        let along = joint.terms.iter().any(|(way, _)| *way == Way::Along);
        let shown = [!along, !along, !along && rolls, along];
        let [lateral, yaw] =
            if wheeled { ["primary_lateral", "primary_yaw"] } else { ["secondary_lateral", "secondary_yaw"] };
        for (i, (end, class)) in
            [("_lateral", lateral), ("_yaw", yaw), ("_roll", yaw), ("", lateral)].into_iter().enumerate()
        {
            if shown[i] {
                vehicle.ports.push(Port {
                    at: format!("{}{end}", joint.name),
                    class,
                    wheelset: joint.number,
                    row: rows[i].row.clone(),
                    inputs: rows[i].inputs.clone(),
                    site: Site::moving(declared[i][0], declared[i][1]),
                });
            }
        }
    }

    /// The places of outer forces on a body.
    fn outer(&self, vehicle: &mut Assembly, body: &Body, at: &Placed) {
        let [lateral, yaw] = if body.wheels.is_some() { ["wheelset", "wheelset_yaw"] } else { ["frame", "frame_yaw"] };
        for (end, class, motion) in [("", lateral, &at.y), ("_yaw", yaw, &at.psi), ("_roll", yaw, &at.phi)] {
            if !motion.row.is_empty() && (end != "_roll" || at.rolls) {
                let (row, inputs) = (motion.row.clone(), motion.inputs.clone());
                let site = Site::moving(0.0, 0.0);
                let name = format!("{}{end}", if body.wheels.is_some() { "wheelset" } else { &body.family });
                vehicle.ports.push(Port { at: name, class, wheelset: body.number, row, inputs, site });
            }
        }
    }

    /// The channel dQ of a wheelset: by how much its right wheel is loaded more, its left one less.
    ///
    /// 2 b dQ = moments of springs and dampers about the middle of the track - m r y'' + 2 N e, quasi-static in its roll.
    fn load_transfer(vehicle: &mut Assembly, i: usize, transfer: &Transfer) {
        let Wheelset { y, column, r, b, n, .. } = vehicle.wheelsets[i];
        let (share, mass) = (0.5 / b, vehicle.mass[y]);
        let displaced = Motion { row: vec![(y, 1.0)], inputs: vec![(column, -1.0), (column + 2, -r)] };
        let held = transfer.held.times(share).plus(&displaced, n / b);
        let damped = transfer.damped.times(share);
        let channel = vehicle.channel(&format!("dQ{}", i + 1), Order::Position, &held.row);
        channel.inputs = held.inputs;
        channel.rates = damped.slopes();
        channel.also = vec![(Order::Velocity, damped.row), (Order::Acceleration, vec![(y, -share * mass * r)])];
    }

    /// The channels: wheelsets, bodies, floor points.
    fn look(&self, vehicle: &mut Assembly, placed: &[Placed], value: &dyn Fn(&Number) -> f64) {
        for (i, (at, ..)) in self.wheelsets().enumerate() {
            let (number, Wheelset { column, r, .. }) = (i + 1, vehicle.wheelsets[i]);
            let y = placed[at].y.row.clone();
            let e = vehicle.channel(&format!("e{number}"), Order::Position, &y);
            e.inputs = vec![(column, -1.0), (column + 2, -r)];
            e.rail = Some(i);
            vehicle.channel(&format!("ay{number}"), Order::Acceleration, &y);
            vehicle.channel(&format!("psi{number}"), Order::Position, &placed[at].psi.row);
            let Some(joint) = self.joints.iter().find(|j| j.bodies.contains(&Some(at))) else { continue };
            let name = format!("{}_lateral", joint.name);
            if let Some(port) = vehicle.ports.iter().find(|p| p.at == name && p.wheelset == joint.number).cloned() {
                vehicle.channel(&format!("d{number}"), Order::Position, &port.row).inputs = port.inputs;
            }
            let Some(frame) = joint.bodies.iter().flatten().find(|b| self.bodies[**b].wheels.is_none()) else {
                continue;
            };
            if i == 0 {
                vehicle.channel("ayf", Order::Acceleration, &placed[*frame].y.row);
                vehicle.channel("rf", Order::Velocity, &placed[*frame].psi.row);
            }
        }
        for (body, at) in self.bodies.iter().zip(placed) {
            for (letter, motion) in [("y", &at.y), ("psi", &at.psi), ("phi", &at.phi)] {
                if letter != "phi" || at.rolls {
                    vehicle.channel(&format!("{letter}.{}", body.name), Order::Position, &motion.row);
                    vehicle.channel(&format!("a{letter}.{}", body.name), Order::Acceleration, &motion.row);
                }
            }
        }
        for floor in &self.floor {
            let body = &placed[floor.body];
            let [_, lateral, _] = body.point(self.seen(Some(floor.body), &floor.point).each_ref().map(value));
            // what stands on the floor feels gravity through its lean
            let felt = vehicle.channel(&format!("floor.{}", floor.name), Order::Acceleration, &lateral.row);
            felt.also = vec![(Order::Position, body.phi.times(-GRAVITY).row)];
        }
    }
}

/// The force of a spring k (or damper) on the bodies of a row, from what the input table moves.
fn drive(to: &mut Vec<(usize, usize, f64)>, row: &[(usize, f64)], inputs: &[(usize, f64)], k: f64) {
    for &(dof, a) in row {
        for &(column, b) in inputs {
            match to.iter_mut().find(|(i, j, _)| (*i, *j) == (dof, column)) {
                Some((.., old)) => *old -= a * k * b,
                None => to.push((dof, column, -a * k * b)),
            }
        }
    }
}

fn own(vehicle: &mut Assembly, law: Law, motion: Motion, numbers: impl Iterator<Item = f64>) {
    vehicle.laws.push(OwnLaw { law, row: motion.row, inputs: motion.inputs, numbers: numbers.collect() });
}

fn wheelset(wheels: &Wheels, at: &Placed, column: usize, value: &dyn Fn(&Number) -> f64) -> Wheelset {
    Wheelset {
        y: at.y.row[0].0,
        psi: at.psi.row[0].0,
        column,
        kappa_s: value(&wheels.spin_creep),
        n: value(&wheels.wheel_load),
        r: value(&wheels.rolling_radius),
        b: value(&wheels.half_gauge),
        i_ya: value(&wheels.spin_inertia),
        ..Wheelset::with_contact(wheels.contact.each_ref().map(value))
    }
}
