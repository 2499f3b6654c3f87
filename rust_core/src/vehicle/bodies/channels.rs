//! Channels: displacements, accelerations, floor points, accelerometers, load transfer of a wheelset.
use super::joining::Transfer;
use super::motion::{Motion, Placed};
use super::{Layout, Number};
use crate::vehicle::assembly::{Assembly, Channel, Order};
use crate::vehicle::line::GRAVITY;
use crate::wheel_rail::coefficients::Wheelset;

impl Layout {
    /// The channel dQ of a wheelset: by how much its right wheel is loaded more, its left one less.
    ///
    /// 2 b dQ = moments of springs and dampers about the middle of the track - m r y'' + 2 N e, quasi-static in its roll.
    pub(super) fn load_transfer(vehicle: &mut Assembly, i: usize, transfer: &Transfer) {
        let Wheelset { y, column, r, b, n, .. } = vehicle.wheelsets[i];
        let (share, mass) = (0.5 / b, vehicle.mass[y]);
        let displaced = Motion { row: vec![(y, 1.0)], inputs: vec![(column, -1.0), (column + 2, -r)] };
        let moment = transfer.track.of_springs.times(share).plus(&displaced, n / b);
        let damped = transfer.track.of_dampers.times(share);
        let channel = vehicle.channel(format!("dQ{}", i + 1), Order::Position, &moment.row);
        channel.inputs = moment.inputs;
        channel.rates = damped.slopes();
        channel.also = vec![(Order::Velocity, damped.row), (Order::Acceleration, vec![(y, -share * mass * r)])];
    }

    /// Share of the guiding force Y by load transfer on inclined contacts: (sigma/b) M, M the moment about the axle
    /// of a wheelset whose roll follows its displacement, phi_i = phi_w - sigma e/b.
    pub(super) fn lean(vehicle: &mut Assembly, i: usize, transfer: &Transfer) {
        let Wheelset { sigma, b, .. } = vehicle.wheelsets[i];
        let (moment, damped) = (transfer.axle.of_springs.times(sigma / b), transfer.axle.of_dampers.times(sigma / b));
        let mut leaning = Channel::new(format!("Y{}", i + 1), Order::Position, &moment.row);
        leaning.inputs = moment.inputs;
        leaning.rates = damped.slopes();
        leaning.also = vec![(Order::Velocity, damped.row)];
        vehicle.leaning.push(leaning);
    }

    /// The channels: wheelsets, bodies, floor points, accelerometers.
    pub(super) fn add_channels(&self, vehicle: &mut Assembly, placed: &[Placed], value: &dyn Fn(&Number) -> f64) {
        for (i, (at, ..)) in self.wheelsets().enumerate() {
            let (number, Wheelset { column, r, .. }) = (i + 1, vehicle.wheelsets[i]);
            let y = placed[at].y.row.clone();
            let e = vehicle.channel(format!("e{number}"), Order::Position, &y);
            e.inputs = vec![(column, -1.0), (column + 2, -r)];
            e.rail = Some(i);
            vehicle.channel(format!("ay{number}"), Order::Acceleration, &y);
            vehicle.channel(format!("psi{number}"), Order::Position, &placed[at].psi.row);
            let Some(joint) = self.joints.iter().find(|j| j.bodies.contains(&Some(at))) else { continue };
            let name = format!("{}_lateral", joint.name);
            if let Some(port) = vehicle.ports.iter().find(|p| p.at == name && p.wheelset == joint.number).cloned() {
                vehicle.channel(format!("d{number}"), Order::Position, &port.row).inputs = port.inputs;
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
                    vehicle.channel(format!("{letter}.{}", body.name), Order::Position, &motion.row);
                    vehicle.channel(format!("a{letter}.{}", body.name), Order::Acceleration, &motion.row);
                }
            }
        }
        for floor in &self.floor {
            let body = &placed[floor.body];
            let [_, lateral, _] = body.point(self.seen(Some(floor.body), &floor.point).each_ref().map(value));
            // a sensor on the floor measures gravity through roll
            let felt = vehicle.channel(format!("floor.{}", floor.name), Order::Acceleration, &lateral.row);
            felt.also = vec![(Order::Position, body.phi.times(-GRAVITY).row)];
        }
        for sensor in &self.accelerometers {
            let (body, [x, z]) = (&placed[sensor.body], sensor.at);
            let [_, lateral, _] = body.point([x, 0.0, -z]);
            let channel = vehicle.channel(sensor.name.clone(), Order::Acceleration, &lateral.row);
            if sensor.with_gravity {
                channel.also = vec![(Order::Position, body.phi.times(-GRAVITY).row)];
            }
        }
    }
}
