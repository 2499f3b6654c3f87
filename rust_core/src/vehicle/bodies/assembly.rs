//! From a layout to a vehicle: bodies, then joints, then channels.
use super::joining::Transfer;
use super::motion::{Motion, Placed, bend, less};
use super::{Body, FIRST, Joint, Layout, Number, PER_WHEELSET, Point, Wheels};
use crate::effects::effect::Site;
use crate::error::{Result, expect_len};
use crate::vehicle::assembly::{Assembly, Inputs, Port};
use crate::vehicle::line::{Letter, LinePlaces, LineSetup, OnLine};
use crate::wheel_rail::coefficients::Wheelset;

impl Layout {
    /// Assemble the vehicle of these numbers: bodies, then joints, then channels.
    ///
    /// On a line with curves y and psi of a body count from the line under it, and springs to the ground end at a carbody
    /// that moves laterally.
    pub fn assemble(&self, p: &[f64], line: Option<LineSetup>) -> Result<Assembly> {
        expect_len("numbers of a vehicle", p.len(), self.numbers)?;
        let value = |number: &Number| number.iter().map(|(factor, i)| factor * p[*i]).sum::<f64>();
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
        let carbody = line.filter(|_| self.has_ground()).map(|_| {
            masses.push(("y_c".to_string(), 1.0));
            masses.len() - 1
        });
        let mut vehicle = Assembly::of(masses);
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
        let places = line.map(|setup| self.places(&vehicle, &placed, setup, carbody));
        if let Some(places) = &places {
            bend(places, &mut vehicle, &mut placed);
        }
        let ground = Placed { y: Motion::of(carbody), ..Placed::ground() };
        let mut transfers = vec![Transfer::default(); self.bodies.len()];
        for joint in &self.joints {
            self.join(&mut vehicle, joint, (&placed, &ground), &mut transfers, &value);
        }
        for (body, at) in self.bodies.iter().zip(&placed) {
            self.outer(&mut vehicle, body, at);
        }
        self.add_channels(&mut vehicle, &placed, &value);
        for (i, (at, ..)) in self.wheelsets().enumerate() {
            Self::load_transfer(&mut vehicle, i, &transfers[at]);
            Self::lean(&mut vehicle, i, &transfers[at]);
        }
        if let Some(places) = places {
            places.drive(&mut vehicle);
        }
        Ok(vehicle)
    }

    /// Is anything joined to the ground?
    fn has_ground(&self) -> bool {
        self.joints.iter().any(|joint| joint.bodies.iter().any(Option::is_none))
    }

    /// The bodies on a line with curves, whose degrees of freedom come one body after the other.
    fn places(&self, vehicle: &Assembly, placed: &[Placed], setup: LineSetup, carbody: Option<usize>) -> LinePlaces {
        let wheelsets: Vec<_> = self.wheelsets().map(|(i, ..)| placed[i].x).collect();
        let middle = wheelsets.iter().sum::<f64>() / wheelsets.len().max(1) as f64;
        let first = wheelsets.first().copied().unwrap_or(0.0);
        let behind = placed.iter().map(|body| body.x).chain([middle]).map(|x| first - x).collect();
        let mut dofs = Vec::new();
        for (position, body) in placed.iter().enumerate() {
            let moves = [(Letter::Lateral, true), (Letter::Yaw, !body.psi.row.is_empty()), (Letter::Roll, body.rolls)];
            let height = body.height;
            dofs.extend(moves.iter().filter(|m| m.1).map(|(letter, _)| OnLine { letter: *letter, position, height }));
        }
        dofs.extend(carbody.map(|_| OnLine { letter: Letter::Lateral, position: placed.len(), height: 0.0 }));
        let is_wheelset = |i: &usize| self.bodies[*i].wheels.is_some();
        let is_on_wheelset = |i: &usize| {
            let joined =
                |joint: &Joint| joint.bodies.contains(&Some(*i)) && joint.bodies.iter().flatten().any(is_wheelset);
            !is_wheelset(i) && self.joints.iter().any(joined)
        };
        let any = self.bodies.iter().position(|body| body.wheels.is_none());
        let mut frames: Vec<_> = (0..placed.len()).filter(is_on_wheelset).collect();
        if frames.is_empty() {
            frames.extend(any.or(Some(0)));
        }
        let frames = frames.iter().map(|i| placed[*i].y.row[0].0).collect();
        debug_assert_eq!(dofs.len(), vehicle.dofs.len());
        LinePlaces { columns: setup.columns, behind, dofs, carbody, frames }
    }

    /// A point relative to the centre of mass of its body; a common offset leaves nothing, not even rounding.
    pub(super) fn seen(&self, body: Option<usize>, [x, y, height]: &Point) -> Point {
        let Some(body) = body.map(|i| &self.bodies[i]) else { return [x.clone(), y.clone(), height.clone()] };
        [less(x, &body.x), y.clone(), less(height, &body.height)]
    }

    /// The places of outer forces on a body.
    fn outer(&self, vehicle: &mut Assembly, body: &Body, at: &Placed) {
        let [lateral, yaw] = if body.wheels.is_some() { ["wheelset", "wheelset_yaw"] } else { ["frame", "frame_yaw"] };
        for (end, class, motion) in [("", lateral, &at.y), ("_yaw", yaw, &at.psi), ("_roll", yaw, &at.phi)] {
            if !motion.row.is_empty() && (end != "_roll" || at.rolls) {
                let (row, inputs) = (motion.row.clone(), Inputs::new()); // relative to the line
                let site = Site::moving(class, 0.0, 0.0);
                let name = format!("{}{end}", if body.wheels.is_some() { "wheelset" } else { &body.family });
                vehicle.ports.push(Port {
                    at: name.into(),
                    class,
                    wheelset: body.number,
                    row,
                    inputs,
                    reaction: None,
                    site,
                });
            }
        }
    }
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
        roller: if wheels.roller_radius.is_empty() { 0.0 } else { 1.0 / value(&wheels.roller_radius) },
        ..Wheelset::with_contact(wheels.contact.each_ref().map(value))
    }
}
