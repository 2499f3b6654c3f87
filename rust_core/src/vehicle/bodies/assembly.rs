//! From a layout to a vehicle: bodies, then joints, then channels.
use super::joining::Transfer;
use super::motion::{Motion, Placed, less};
use super::{Body, FIRST, Layout, Number, PER_WHEELSET, Point, Wheels};
use crate::effects::effect::Site;
use crate::error::{Result, expect_len};
use crate::vehicle::assembly::{Assembly, Port};
use crate::wheel_rail::wheelset::Wheelset;

impl Layout {
    /// Assemble the vehicle of these numbers: bodies, then joints, then channels.
    pub fn assemble(&self, p: &[f64]) -> Result<Assembly> {
        expect_len("numbers of a vehicle", p.len(), self.numbers)?;
        // a missing number reads as NaN, which the check of the masses reports
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
        self.add_channels(&mut vehicle, &placed, &value);
        for (i, (at, ..)) in self.wheelsets().enumerate() {
            Self::load_transfer(&mut vehicle, i, &transfers[at]);
        }
        vehicle.port_channels();
        Ok(vehicle)
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
                let (row, inputs) = (motion.row.clone(), motion.inputs.clone());
                let site = Site::moving(0.0, 0.0);
                let name = format!("{}{end}", if body.wheels.is_some() { "wheelset" } else { &body.family });
                vehicle.ports.push(Port { at: name, class, wheelset: body.number, row, inputs, reaction: None, site });
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
        ..Wheelset::with_contact(wheels.contact.each_ref().map(value))
    }
}
