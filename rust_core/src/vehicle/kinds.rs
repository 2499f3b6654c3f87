//! The kinds of vehicles that need no list of bodies: the bogie, a wheelset on springs, one mass on a rig.
use crate::effects::effect::Site;
use crate::error::{Error, Result, expect_len};
use crate::vehicle::assembly::{Assembly, LINKAGE, Order, Port, Row};
use crate::vehicle::bodies::Layout;
use crate::vehicle::line::{LinePlaces, LineSetup};
use crate::wheel_rail::coefficients::Wheelset;

/// The input u(t) of a rig.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum RigInput {
    #[default]
    Force,
    BaseDisplacement,
    BaseAcceleration,
    /// The motion is prescribed, the force is the response.
    Motion,
}

/// A kind of vehicle: one that the kernel knows, or one of bodies and elements.
#[derive(Clone, Debug)]
pub enum VehicleKind {
    Bogie,
    Wheelset,
    Rig(RigInput),
    Bodies(Layout),
}

impl VehicleKind {
    /// The kind of a name; only a rig may be given an input, by default a force.
    pub fn named(kind: &str, input: Option<&str>) -> Result<Self> {
        match (kind, input) {
            ("bogie", None) => Ok(VehicleKind::Bogie),
            ("wheelset", None) => Ok(VehicleKind::Wheelset),
            ("rig", None | Some("force")) => Ok(VehicleKind::Rig(RigInput::Force)),
            ("rig", Some("base_displacement")) => Ok(VehicleKind::Rig(RigInput::BaseDisplacement)),
            ("rig", Some("base_acceleration")) => Ok(VehicleKind::Rig(RigInput::BaseAcceleration)),
            ("rig", Some("motion")) => Ok(VehicleKind::Rig(RigInput::Motion)),
            ("bogie" | "wheelset" | "rig", Some(word)) => Err(Error::Input { kind: kind.into(), word: word.into() }),
            _ => Err(Error::Vehicle(kind.into())),
        }
    }

    /// The numbers that a kind is assembled from, by their paths in a design; those of bodies have no paths here.
    pub fn parameters(&self) -> &'static [&'static str] {
        match self {
            VehicleKind::Bogie => BOGIE,
            VehicleKind::Wheelset => WHEELSET,
            VehicleKind::Rig(RigInput::Motion) => COMPONENT,
            VehicleKind::Rig(_) => RIG,
            VehicleKind::Bodies(_) => &[],
        }
    }

    /// Columns of the input table that a kind of vehicle reads.
    pub fn columns(&self) -> usize {
        match self {
            VehicleKind::Bogie => 14,
            VehicleKind::Wheelset => 7,
            VehicleKind::Rig(_) => 5,
            VehicleKind::Bodies(layout) => layout.columns(),
        }
    }

    /// Positions on a line with curves: bodies, then the middle of the vehicle.
    pub fn positions(&self) -> usize {
        match self {
            VehicleKind::Bogie => 4,
            VehicleKind::Wheelset => 2,
            VehicleKind::Rig(_) => 0,
            VehicleKind::Bodies(layout) => layout.bodies.len() + 1,
        }
    }

    /// Bodies and elements, where the vehicle is described by these.
    pub fn layout(&self) -> Option<&Layout> {
        match self {
            VehicleKind::Bodies(layout) => Some(layout),
            _ => None,
        }
    }

    /// Assemble one vehicle; `measured` names the forces of the coach that the input table holds (Qy, Qpsi).
    pub fn assemble(&self, p: &[f64], measured: &[String], line: Option<LineSetup>) -> Result<Assembly> {
        let mut vehicle = match self {
            VehicleKind::Bodies(layout) => return layout.assemble(p, line),
            VehicleKind::Rig(_) if line.is_some() => return Err(Error::Layout("a rig has no line with curves".into())),
            VehicleKind::Bogie => bogie(self.checked("bogie", p)?, measured, line.is_some_and(|setup| setup.carbody)),
            VehicleKind::Wheelset => wheelset_on_springs(self.checked("wheelset", p)?),
            VehicleKind::Rig(RigInput::Motion) => component(self.checked("rig", p)?),
            VehicleKind::Rig(input) => rig(self.checked("rig", p)?, *input),
        };
        vehicle.check_masses()?;
        if let Some(setup) = line {
            LinePlaces::planar(&vehicle, setup).deflect(&mut vehicle);
        }
        Ok(vehicle)
    }

    /// As many numbers as the kind has, all of them finite.
    fn checked<'a>(&self, kind: &str, p: &'a [f64]) -> Result<&'a [f64]> {
        let names = self.parameters();
        expect_len(&format!("numbers of a {kind}"), p.len(), names.len())?;
        match names.iter().zip(p).find(|(_, value)| !value.is_finite()) {
            Some((name, value)) => Err(Error::VehicleNumber { what: (*name).into(), value: *value, rule: "finite" }),
            None => Ok(p),
        }
    }
}

/// The numbers of a kind of vehicle from one list: their names here, and their paths in a design in the same order.
macro_rules! numbers {
    ($(#[$about:meta])* $paths:ident: $name:ident { $($field:ident: $path:literal,)* }) => {
        pub const $paths: &[&str] = &[$($path),*];

        $(#[$about])*
        struct $name { $($field: f64,)* }

        impl $name {
            fn of(numbers: &[f64]) -> Self {
                let &[$($field),*] = numbers else { unreachable!("as many numbers as have been checked") };
                $name { $($field),* }
            }
        }
    };
}

numbers! {
    /// A bogie of two wheelsets; its flange clearance is for laws alone.
    #[allow(dead_code)]
    BOGIE: BogieNumbers {
        frame_mass: "vehicle.frame.mass",
        frame_yaw_inertia: "vehicle.frame.yaw_inertia",
        wheelset_mass: "vehicle.wheelset.mass",
        wheelset_yaw_inertia: "vehicle.wheelset.yaw_inertia",
        wheelset_spin_inertia: "vehicle.wheelset.spin_inertia",
        half_wheelbase: "vehicle.geometry.half_wheelbase",
        half_gauge: "vehicle.geometry.half_gauge",
        half_spring_base: "vehicle.geometry.half_spring_base",
        rolling_radius: "vehicle.geometry.rolling_radius",
        wheel_load: "vehicle.wheel_load",
        primary_lateral_stiffness: "vehicle.primary.lateral_stiffness",
        primary_longitudinal_stiffness: "vehicle.primary.longitudinal_stiffness",
        secondary_lateral_stiffness: "vehicle.secondary.lateral_stiffness",
        secondary_yaw_stiffness: "vehicle.secondary.yaw_stiffness",
        secondary_lateral_damping: "vehicle.secondary.lateral_damping",
        secondary_yaw_damping: "vehicle.secondary.yaw_damping",
        leading_conicity: "contact.leading.conicity",
        leading_longitudinal_creep: "contact.leading.longitudinal_creep",
        leading_lateral_creep: "contact.leading.lateral_creep",
        leading_gravitational_stiffness: "contact.leading.gravitational_stiffness",
        leading_contact_angle: "contact.leading.contact_angle",
        leading_roll: "contact.leading.roll",
        trailing_conicity: "contact.trailing.conicity",
        trailing_longitudinal_creep: "contact.trailing.longitudinal_creep",
        trailing_lateral_creep: "contact.trailing.lateral_creep",
        trailing_gravitational_stiffness: "contact.trailing.gravitational_stiffness",
        trailing_contact_angle: "contact.trailing.contact_angle",
        trailing_roll: "contact.trailing.roll",
        spin_creep: "contact.spin_creep",
        flange_clearance: "contact.flange_clearance",
    }
}

/// The bogie of docs/theory.md: q = [y, psi, y1, psi1, y2, psi2], (3.1) and (3.10).
///
/// With a carbody the secondary suspension ends at y_c, else it stands still.
fn bogie(p: &[f64], measured: &[String], carbody: bool) -> Assembly {
    let p = BogieNumbers::of(p);
    let (a, b_c, c_y, c_x) =
        (p.half_wheelbase, p.half_spring_base, p.primary_lateral_stiffness, p.primary_longitudinal_stiffness);
    let (mut c_sy, mut c_spsi) = (p.secondary_lateral_stiffness, p.secondary_yaw_stiffness);
    let (mut k_y, mut k_psi) = (p.secondary_lateral_damping, p.secondary_yaw_damping);
    let (m_a, i_za) = (p.wheelset_mass, p.wheelset_yaw_inertia);
    let leading = [
        p.leading_conicity,
        p.leading_longitudinal_creep,
        p.leading_lateral_creep,
        p.leading_gravitational_stiffness,
        p.leading_contact_angle,
        p.leading_roll,
    ];
    let trailing = [
        p.trailing_conicity,
        p.trailing_longitudinal_creep,
        p.trailing_lateral_creep,
        p.trailing_gravitational_stiffness,
        p.trailing_contact_angle,
        p.trailing_roll,
    ];
    let (drives_y, drives_psi) = (measured.iter().any(|q| q == "Qy"), measured.iter().any(|q| q == "Qpsi"));
    if drives_y {
        (c_sy, k_y) = (0.0, 0.0);
    }
    if drives_psi {
        (c_spsi, k_psi) = (0.0, 0.0);
    }
    let mut bodies = vec![("y", p.frame_mass), ("psi", p.frame_yaw_inertia)];
    bodies.extend([("y1", m_a), ("psi1", i_za), ("y2", m_a), ("psi2", i_za)]);
    bodies.extend(carbody.then_some(("y_c", p.frame_mass)));
    let mut v = Assembly::of(bodies);
    let secondary: &[_] = if carbody { &[(0, 1.0), (6, -1.0)] } else { &[(0, 1.0)] };
    let lateral = [[(2, 1.0), (0, -1.0), (1, -a)], [(4, 1.0), (0, -1.0), (1, a)]];
    let yaw = [[(3, 1.0), (1, -1.0)], [(5, 1.0), (1, -1.0)]];
    let yaw_stiffness = 2.0 * c_x * b_c * b_c;
    v.spring(secondary, c_sy);
    v.damper(secondary, k_y);
    v.spring(&[(1, 1.0)], c_spsi);
    v.damper(&[(1, 1.0)], k_psi);
    v.port("secondary_lateral", 0, secondary, c_sy, k_y);
    v.port("secondary_yaw", 0, &[(1, 1.0)], c_spsi, k_psi);
    for (i, contact) in [leading, trailing].into_iter().enumerate() {
        let number = i as u8 + 1;
        v.spring(&lateral[i], 2.0 * c_y);
        v.spring(&yaw[i], yaw_stiffness);
        v.port("primary_lateral", number, &lateral[i], 2.0 * c_y, 0.0);
        v.port("primary_yaw", number, &yaw[i], yaw_stiffness, 0.0);
        v.port("wheelset", number, &[(2 + 2 * i, 1.0)], 0.0, 0.0);
        v.port("wheelset_yaw", number, &[(3 + 2 * i, 1.0)], 0.0, 0.0);
        v.wheelsets.push(Wheelset {
            y: 2 + 2 * i,
            psi: 3 + 2 * i,
            column: 2 + 5 * i,
            kappa_s: p.spin_creep,
            n: p.wheel_load,
            r: p.rolling_radius,
            b: p.half_gauge,
            i_ya: p.wheelset_spin_inertia,
            behind: 2.0 * a * i as f64,
            ..Wheelset::with_contact(contact)
        });
    }
    // the linkage between the two wheelsets
    v.port("wheelset_yaw", LINKAGE, &[(3, 1.0), (5, 1.0)], 0.0, 0.0);
    v.port("frame", 0, &[(0, 1.0)], 0.0, 0.0);
    v.port("frame_yaw", 0, &[(1, 1.0)], 0.0, 0.0);
    for (drives, dof) in [(drives_y, 0), (drives_psi, 1)] {
        if drives {
            v.inputs.push((dof, 12 + dof, 1.0));
        }
    }
    for i in 0..2 {
        let column = 2 + 5 * i;
        let e = v.channel(["e1", "e2"][i], Order::Position, &[(2 + 2 * i, 1.0)]);
        e.inputs = vec![(column, -1.0), (column + 2, -p.rolling_radius)];
        e.rail = Some(i);
    }
    v.channel("ay1", Order::Acceleration, &[(2, 1.0)]);
    v.channel("ay2", Order::Acceleration, &[(4, 1.0)]);
    v.channel("ayf", Order::Acceleration, &[(0, 1.0)]);
    v.channel("rf", Order::Velocity, &[(1, 1.0)]);
    v.channel("d1", Order::Position, &lateral[0]);
    v.channel("d2", Order::Position, &lateral[1]);
    v.channel("psi1", Order::Position, &[(3, 1.0)]);
    v.channel("psi2", Order::Position, &[(5, 1.0)]);
    v
}

numbers! {
    /// A wheelset on springs.
    WHEELSET: WheelsetNumbers {
        mass: "mass",
        yaw_inertia: "yaw_inertia",
        spin_inertia: "spin_inertia",
        half_gauge: "half_gauge",
        rolling_radius: "rolling_radius",
        wheel_load: "wheel_load",
        lateral_stiffness: "lateral_stiffness",
        yaw_stiffness: "yaw_stiffness",
        conicity: "conicity",
        longitudinal_creep: "longitudinal_creep",
        lateral_creep: "lateral_creep",
        gravitational_stiffness: "gravitational_stiffness",
        contact_angle: "contact_angle",
        roll: "roll",
        spin_creep: "spin_creep",
    }
}

/// One wheelset on springs to the ground.
fn wheelset_on_springs(p: &[f64]) -> Assembly {
    let p = WheelsetNumbers::of(p);
    let (s_y, s_psi) = (p.lateral_stiffness, p.yaw_stiffness);
    let contact =
        [p.conicity, p.longitudinal_creep, p.lateral_creep, p.gravitational_stiffness, p.contact_angle, p.roll];
    let mut v = Assembly::of(vec![("y1", p.mass), ("psi1", p.yaw_inertia)]);
    v.spring(&[(0, 1.0)], s_y);
    v.spring(&[(1, 1.0)], s_psi);
    v.port("primary_lateral", 1, &[(0, 1.0)], s_y, 0.0);
    v.port("primary_yaw", 1, &[(1, 1.0)], s_psi, 0.0);
    v.wheelsets.push(Wheelset {
        y: 0,
        psi: 1,
        column: 2,
        kappa_s: p.spin_creep,
        n: p.wheel_load,
        r: p.rolling_radius,
        b: p.half_gauge,
        i_ya: p.spin_inertia,
        ..Wheelset::with_contact(contact)
    });
    let e = v.channel("e1", Order::Position, &[(0, 1.0)]);
    e.inputs = vec![(2, -1.0), (4, -p.rolling_radius)];
    e.rail = Some(0);
    v.channel("ay1", Order::Acceleration, &[(0, 1.0)]);
    v.channel("psi1", Order::Position, &[(1, 1.0)]);
    v
}

numbers! {
    /// A mass on a test bench.
    RIG: RigNumbers {
        mass: "vehicle.rig.mass",
        stiffness: "vehicle.rig.stiffness",
        damping: "vehicle.rig.damping",
        gain: "vehicle.rig.gain",
        preload: "vehicle.rig.preload",
    }
}

/// One mass on a test bench: m z'' + c z' + k z + preload + effects = gain u. With a moving base the co-ordinate is the
/// deflection, which the suspension feels.
fn rig(p: &[f64], input: RigInput) -> Assembly {
    let RigNumbers { mass: m, stiffness: k, damping: c, gain, preload } = RigNumbers::of(p);
    let mut v = Assembly::of(vec![("z", m)]);
    v.spring(&[(0, 1.0)], k);
    v.damper(&[(0, 1.0)], c);
    v.port("rig", 0, &[(0, 1.0)], k, c);
    // columns: 2 u, 3 u', 4 u''
    v.inputs.push(match input {
        RigInput::BaseDisplacement => (0, 4, -m * gain),
        RigInput::BaseAcceleration => (0, 2, -m * gain),
        RigInput::Force | RigInput::Motion => (0, 2, gain),
    });
    v.inputs.push((0, ONE, -preload));
    for (name, order, column) in [("z", Order::Position, 2), ("vz", Order::Velocity, 3), ("az", Order::Acceleration, 4)]
    {
        let channel = v.channel(name, order, &[(0, 1.0)]);
        if input == RigInput::BaseDisplacement {
            channel.inputs = vec![(column, gain)];
        }
    }
    v.limit = 1e12;
    v
}

/// The column of a rig's input table that is one throughout: the speed of a vehicle.
const ONE: usize = 1;

numbers! {
    /// A component whose motion is prescribed.
    COMPONENT: ComponentNumbers {
        stiffness: "vehicle.rig.stiffness",
        damping: "vehicle.rig.damping",
        preload: "vehicle.rig.preload",
    }
}

/// A component whose motion z is prescribed: F = k z + c z' + preload + effects. A body of unit mass that nothing else
/// moves feels -F, so that F is its acceleration reversed; the laws follow the columns, not that body.
fn component(p: &[f64]) -> Assembly {
    let ComponentNumbers { stiffness: k, damping: c, preload } = ComponentNumbers::of(p);
    let mut v = Assembly::of(vec![("reaction", 1.0)]);
    // columns: 2 z, 3 z', 4 z''
    v.inputs = vec![(0, 2, -k), (0, 3, -c), (0, ONE, -preload)];
    let site = Site::moving("rig", k, c);
    let (row, inputs, reaction) = (Row::new(), vec![(2, 1.0)], Some(vec![(0, 1.0)]));
    v.ports.push(Port { at: "rig".into(), class: "rig", wheelset: 0, row, inputs, reaction, site });
    v.channel("F", Order::Acceleration, &[(0, -1.0)]);
    // the reaction body runs away by nature: only what is not finite has diverged
    v.limit = f64::INFINITY;
    v
}
