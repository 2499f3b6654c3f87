//! A vehicle on a line with curves: columns of the input table, inertia forces, the carbody above springs to the ground.
//!
//! y and psi count from the line under each body, phi from the plane of the track under the middle of the vehicle. The
//! suspension deflects by these plus the line under each body against the tangent at the middle.
use crate::error::{Error, Result};
use crate::vehicle::assembly::{Assembly, Inputs, Name, Order, Row};

/// Columns behind those of a straight track: g phi_m and V^2 phi_m'', phi_m the cant under the middle of the vehicle;
/// then these of every position, the middle of the vehicle last.
pub const COMMON: usize = 2;
pub const PER_POSITION: usize = 7;
/// Of a position: 1/R; the line's offset y and its slope, its heading psi and its slope, against the tangent at the
/// middle; V^2/R; V^2 d(1/R)/ds.
const CURVATURE: usize = 0;
const OFFSET: usize = 1;
const HEADING: usize = 3;
const ACCELERATION: usize = 5;
const TURNING: usize = 6;
/// Gravity as the wheel loads contain it [m/s^2].
pub const GRAVITY: f64 = 9.81;
/// Least mass of the carbody above springs to the ground, of the mass of the vehicle itself: a lighter one, which the
/// wheels do not carry, is given the inertia of the vehicle.
const LEAST_CARBODY: f64 = 0.05;

/// A line with curves, and whether springs to the ground hold a carbody.
#[derive(Clone, Copy, Debug)]
pub struct LineSetup {
    pub columns: LineColumns,
    pub carbody: bool,
}

/// First column behind those of a straight track.
#[derive(Clone, Copy, Debug)]
pub struct LineColumns(pub usize);

impl LineColumns {
    /// Number of columns of so many positions.
    pub fn count(positions: usize) -> usize {
        COMMON + PER_POSITION * positions
    }

    fn of(self, position: usize, column: usize) -> usize {
        self.0 + COMMON + PER_POSITION * position + column
    }

    /// The column of 1/R at a position.
    pub fn curvature(self, position: usize) -> usize {
        self.of(position, CURVATURE)
    }

    /// The line's offset and heading at a position, as inputs of a motion.
    pub fn offset(self, position: usize) -> Inputs {
        vec![(self.of(position, OFFSET), 1.0)]
    }

    pub fn heading(self, position: usize) -> Inputs {
        vec![(self.of(position, HEADING), 1.0)]
    }
}

/// The motion of a degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Letter {
    Lateral,
    Yaw,
    Roll,
}

/// A degree of freedom on the line: its motion, its position, the height of its centre of mass above the rails [m].
#[derive(Clone, Copy, Debug)]
pub struct OnLine {
    pub letter: Letter,
    pub position: usize,
    pub height: f64,
}

/// The vehicle's places on a line.
#[derive(Clone, Debug)]
pub struct LinePlaces {
    pub columns: LineColumns,
    /// Distance of every position behind the first wheelset [m], the middle of the wheelsets last.
    pub behind: Vec<f64>,
    /// Per degree of freedom.
    pub dofs: Vec<OnLine>,
    /// The carbody above springs to the ground.
    pub carbody: Option<usize>,
    /// Lateral degrees of freedom of the frames, which carry a carbody that is not modelled.
    pub frames: Vec<usize>,
}

impl LinePlaces {
    /// Of a vehicle that is no list of bodies: a frame in the middle, wheelsets, a carbody; all at the height of the axles.
    pub fn planar(vehicle: &Assembly, setup: LineSetup) -> Self {
        let mut behind: Vec<_> = vehicle.wheelsets.iter().map(|w| w.behind).collect();
        let middle = behind.iter().sum::<f64>() / behind.len().max(1) as f64;
        let frame = vehicle.dofs.iter().any(|dof| dof == "y");
        if frame {
            behind.insert(0, middle);
        }
        behind.push(middle);
        let height = vehicle.wheelsets.first().map_or(0.0, |w| w.r);
        let place = |(i, name): (usize, &Name)| {
            let letter = if name.starts_with('y') { Letter::Lateral } else { Letter::Yaw };
            let wheelset = vehicle.wheelsets.iter().position(|w| w.y == i || w.psi == i);
            match (wheelset, &**name) {
                (Some(number), _) => OnLine { letter, position: number + usize::from(frame), height },
                (None, "y_c") => OnLine { letter, position: behind.len() - 1, height: 0.0 },
                (None, _) => OnLine { letter, position: 0, height },
            }
        };
        let dofs = vehicle.dofs.iter().enumerate().map(place).collect();
        let carbody = if setup.carbody { vehicle.dofs.iter().position(|dof| dof == "y_c") } else { None };
        LinePlaces { columns: setup.columns, behind, dofs, carbody, frames: vec![0] }
    }

    /// Move the suspension of a vehicle that is no list of bodies with the line.
    pub fn deflect(&self, vehicle: &mut Assembly) {
        self.drive_suspension(vehicle);
        for port in &mut vehicle.ports {
            if port.class.starts_with("primary") || port.class.starts_with("secondary") {
                port.inputs = self.offsets(&port.row);
            }
        }
        for channel in &mut vehicle.channels {
            if matches!(&*channel.name, "d1" | "d2") {
                channel.inputs = self.offsets(&channel.row);
            }
        }
        for wheelset in &mut vehicle.wheelsets {
            wheelset.curvature = Some(self.columns.curvature(self.dofs[wheelset.y].position));
        }
    }

    /// The forces of the line, and what sensors feel of it.
    pub fn drive(self, vehicle: &mut Assembly) {
        self.weigh_carbody(vehicle);
        self.drive_bodies(vehicle);
        self.extend_channels(vehicle);
        vehicle.positions = self.behind;
    }

    /// The acceleration that the line gives a degree of freedom: V^2/R - g phi + h phi'', V^2 d(1/R)/ds, phi''.
    fn acceleration(&self, dof: usize) -> Inputs {
        let OnLine { letter, position, height } = self.dofs[dof];
        let (columns, common) = (self.columns, self.columns.0);
        match letter {
            Letter::Lateral => {
                vec![(columns.of(position, ACCELERATION), 1.0), (common, -1.0), (common + 1, height)]
            }
            Letter::Yaw => vec![(columns.of(position, TURNING), 1.0)],
            Letter::Roll => vec![(common + 1, 1.0)],
        }
    }

    fn accelerations(&self, row: &[(usize, f64)]) -> Inputs {
        row.iter().flat_map(|(dof, a)| self.acceleration(*dof).into_iter().map(|(i, b)| (i, *a * b))).collect()
    }

    /// Inputs of a deflection from the offsets and headings of the line.
    fn offsets(&self, row: &[(usize, f64)]) -> Inputs {
        let mut inputs = Inputs::new();
        for &(dof, a) in row {
            let OnLine { letter, position, .. } = self.dofs[dof];
            match letter {
                Letter::Lateral => inputs.extend(self.columns.offset(position).iter().map(|(i, b)| (*i, a * b))),
                Letter::Yaw => inputs.extend(self.columns.heading(position).iter().map(|(i, b)| (*i, a * b))),
                Letter::Roll => {}
            }
        }
        inputs
    }

    /// The forces of the linear springs and dampers of a vehicle by the line's offsets.
    fn drive_suspension(&self, vehicle: &mut Assembly) {
        let n = vehicle.dofs.len();
        for i in 0..n {
            for j in 0..n {
                for (column, a) in self.offsets(&[(j, 1.0)]) {
                    vehicle.inputs.push((i, column, -vehicle.stiffness[(i, j)] * a));
                    vehicle.rates.push((i, column + 1, -vehicle.damping[(i, j)] * a));
                }
            }
        }
    }

    /// The mass that the wheels carry beyond the vehicle's own.
    fn remaining_mass(&self, vehicle: &Assembly) -> f64 {
        let own = self.lateral(vehicle).filter(|i| Some(*i) != self.carbody).map(|i| vehicle.mass[i]).sum::<f64>();
        let carried = vehicle.wheelsets.iter().map(|w| 2.0 * w.n).sum::<f64>() / GRAVITY;
        (carried - own).max(0.0)
    }

    fn lateral(&self, vehicle: &Assembly) -> impl Iterator<Item = usize> {
        (0..vehicle.dofs.len()).filter(|i| self.dofs[*i].letter == Letter::Lateral)
    }

    /// The mass of the carbody above springs to the ground.
    fn weigh_carbody(&self, vehicle: &mut Assembly) {
        let Some(carbody) = self.carbody else { return };
        let remaining = self.remaining_mass(vehicle);
        let own = self.lateral(vehicle).filter(|i| *i != carbody).map(|i| vehicle.mass[i]).sum::<f64>();
        vehicle.mass[carbody] = if remaining > LEAST_CARBODY * own { remaining } else { own };
    }

    /// The inertia forces of every body, and of the carbody that is not modelled: this acts on the springs to the ground
    /// where there are any, else on the frames.
    fn drive_bodies(&self, vehicle: &mut Assembly) {
        for dof in (0..vehicle.dofs.len()).filter(|i| Some(*i) != self.carbody) {
            for (column, a) in self.acceleration(dof) {
                vehicle.inputs.push((dof, column, -vehicle.mass[dof] * a));
            }
        }
        let remaining = self.remaining_mass(vehicle);
        let sprung = self.carbody.filter(|c| vehicle.stiffness[(*c, *c)] > 0.0);
        // a term for each, so that all vehicles of a structure have the same
        let share = |dof: usize| match sprung {
            Some(carbody) => f64::from(u8::from(dof == carbody)),
            None if Some(dof) == self.carbody => 0.0,
            None => 1.0 / self.frames.len() as f64,
        };
        for dof in self.frames.iter().copied().chain(self.carbody) {
            let position = self.dofs[dof].position;
            for (column, a) in [(self.columns.of(position, ACCELERATION), 1.0), (self.columns.0, -1.0)] {
                vehicle.inputs.push((dof, column, -remaining * share(dof) * a));
            }
        }
    }

    /// Accelerations as a sensor on the body measures them, and the yaw rate of the frame as a gyroscope does.
    fn extend_channels(&self, vehicle: &mut Assembly) {
        for channel in &mut vehicle.channels {
            let rows: Vec<Row> = channel
                .also
                .iter()
                .chain([&(channel.order, channel.row.clone())])
                .filter(|(order, _)| *order == Order::Acceleration)
                .map(|(_, row)| row.clone())
                .collect();
            channel.inputs.extend(rows.iter().flat_map(|row| self.accelerations(row)));
            if channel.name == "rf" {
                let rate = |(dof, a): &(usize, f64)| (self.columns.curvature(self.dofs[*dof].position), *a);
                channel.rates.extend(channel.row.iter().map(rate));
            }
        }
    }

    /// An error for a speed that is not that of the input table.
    pub fn check_speed_scale(scale: f64) -> Result<()> {
        if scale == 1.0 {
            return Ok(());
        }
        Err(Error::Value { what: "speed scale on a line with curves".into(), value: scale, rule: "1" })
    }
}
