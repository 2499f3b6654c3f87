//! Vehicles as bodies and elements: rigid bodies that move laterally, yaw and roll, joined between points.
//!
//! A point at (x, y, h) of a body whose centre of mass is at (x_0, 0, h_0), h the height above the rails, moves by
//! u_x = -psi y, u_y = y + psi (x - x_0) + phi (h - h_0), u_z = phi y: axes x forward, y right, z down.
mod assembly;
mod channels;
mod joining;
mod motion;

use crate::error::{Error, Result};
use serde::{Deserialize, Deserializer};

/// A number made of those of the design: the sum of factor times number; empty: 0.
pub type Number = Vec<(f64, usize)>;

/// Position of a point: x, y, height above the rails.
pub type Point = [Number; 3];

/// Wheels of a body that is a wheelset; its roll is the track's and that of its own lateral displacement.
#[derive(Clone, Debug, Deserialize)]
pub struct Wheels {
    pub spin_inertia: Number,
    pub half_gauge: Number,
    pub rolling_radius: Number,
    pub wheel_load: Number,
    /// lambda, kappa_x, kappa_y, epsilon, delta, sigma
    pub contact: [Number; 6],
    pub spin_creep: Number,
    /// Radius of the rollers; empty: the wheels run on a track.
    pub roller_radius: Number,
}

/// A rigid body; without a yaw or roll inertia it does not yaw or roll.
#[derive(Clone, Debug, Deserialize)]
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
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "lowercase")]
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

/// Element between two bodies, acting on the motion of the first less that of the second (none: the ground).
#[derive(Clone, Debug, Deserialize)]
pub struct Joint {
    pub name: String,
    pub number: u8,
    pub bodies: [Option<usize>; 2],
    pub points: [Point; 2],
    /// The same again on the other side of the vehicle, at -y.
    pub mirrored: bool,
    #[serde(deserialize_with = "read_terms")]
    pub terms: Vec<(Way, Acts)>,
    /// The weight that it carries, of the second body on the first.
    pub static_load: Number,
}

/// A place on a body where comfort is felt.
#[derive(Clone, Debug, Deserialize)]
pub struct Floor {
    pub name: String,
    pub body: usize,
    pub point: Point,
}

/// A lateral accelerometer on a body: x forwards and z downwards from the centre of mass [m].
#[derive(Clone, Debug, Deserialize)]
pub struct Accelerometer {
    pub name: String,
    pub body: usize,
    pub at: [f64; 2],
    /// Does it measure gravity through roll?
    pub with_gravity: bool,
}

/// A vehicle as a list of bodies (wheelsets from the front to the rear) and what joins them.
#[derive(Clone, Debug, Default, Deserialize)]
pub struct Layout {
    /// Number of numbers that describe it.
    pub numbers: usize,
    pub bodies: Vec<Body>,
    pub joints: Vec<Joint>,
    pub floor: Vec<Floor>,
    pub accelerometers: Vec<Accelerometer>,
}

/// Direction, law and numbers of every term.
fn read_terms<'de, D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Vec<(Way, Acts)>, D::Error> {
    let terms = Vec::<(Way, String, Vec<Number>)>::deserialize(deserializer)?;
    let read = terms.into_iter().map(|(way, law, numbers)| Ok((way, Acts::of(&law, numbers)?)));
    read.collect::<std::result::Result<_, String>>().map_err(serde::de::Error::custom)
}

impl Acts {
    fn numbers(&self) -> &[Number] {
        match self {
            Acts::Spring(number) | Acts::Damper(number) => std::slice::from_ref(number),
            Acts::Series(numbers) => numbers,
            Acts::Stop(numbers) => numbers,
        }
    }

    fn of(law: &str, numbers: Vec<Number>) -> std::result::Result<Self, String> {
        let count = numbers.len();
        let acts = match law {
            "spring" => numbers.try_into().map(|[stiffness]: [Number; 1]| Acts::Spring(stiffness)),
            "damper" => numbers.try_into().map(|[damping]: [Number; 1]| Acts::Damper(damping)),
            "series" => numbers.try_into().map(Acts::Series),
            "stop" => numbers.try_into().map(Acts::Stop),
            _ => return Err(format!("no law {law:?} of an element")),
        };
        acts.map_err(|_| format!("{law:?} with {count} numbers"))
    }
}

/// Columns s and v, before those of the wheelsets; Qy and Qpsi follow them.
const FIRST: usize = 2;
const PER_WHEELSET: usize = 5;

impl Layout {
    /// Read a layout, every index of which is checked: a wrong one must not make the kernel panic.
    pub fn from_json(text: &str) -> Result<Self> {
        let layout: Self = serde_json::from_str(text).map_err(|e| Error::Layout(e.to_string()))?;
        layout.check()?;
        Ok(layout)
    }

    /// Columns of the input table: s, v, five per wheelset, Qy, Qpsi.
    pub fn columns(&self) -> usize {
        FIRST + PER_WHEELSET * self.wheelsets().count() + 2
    }

    /// Every index within its list, every wheelset free to yaw.
    pub fn check(&self) -> Result<()> {
        let joined = self.joints.iter().flat_map(|j| j.bodies.iter().flatten());
        let sensors = self.floor.iter().map(|f| &f.body).chain(self.accelerometers.iter().map(|a| &a.body));
        let most = joined.chain(sensors).max().map_or(0, |i| i + 1);
        if most > self.bodies.len() {
            return Err(Error::Shape { what: "bodies of a layout".into(), got: self.bodies.len(), expected: most });
        }
        let most = self.sums().into_iter().flatten().map(|(_, i)| i + 1).max().unwrap_or(0);
        if most > self.numbers {
            return Err(Error::Shape { what: "numbers of a layout".into(), got: self.numbers, expected: most });
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

    /// Every quantity that is a sum of its numbers.
    fn sums(&self) -> Vec<&Number> {
        let mut all = Vec::new();
        for body in &self.bodies {
            all.extend([&body.mass, &body.x, &body.height]);
            all.extend(body.yaw_inertia.iter().chain(&body.roll_inertia));
            if let Some(w) = &body.wheels {
                all.extend([&w.spin_inertia, &w.half_gauge, &w.rolling_radius, &w.wheel_load]);
                all.extend(w.contact.iter().chain([&w.spin_creep, &w.roller_radius]));
            }
        }
        for joint in &self.joints {
            all.extend(joint.points.iter().flatten().chain([&joint.static_load]));
            all.extend(joint.terms.iter().flat_map(|(_, acts)| acts.numbers()));
        }
        all.extend(self.floor.iter().flat_map(|floor| &floor.point));
        all
    }

    fn wheelsets(&self) -> impl Iterator<Item = (usize, &Body, &Wheels)> {
        self.bodies.iter().enumerate().filter_map(|(i, body)| Some((i, body, body.wheels.as_ref()?)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn with_term(term: &str) -> Result<Layout> {
        let point = "[[], [], []]";
        Layout::from_json(&format!(
            r#"{{"numbers": 1, "bodies": [], "floor": [], "accelerometers": [], "joints": [{{"name": "a", "number": 0,
            "bodies": [null, null], "points": [{point}, {point}], "mirrored": false, "terms": [{term}],
            "static_load": []}}]}}"#
        ))
    }

    #[test]
    fn a_term_has_a_direction_a_law_and_its_numbers() {
        let layout = with_term(r#"["lateral", "spring", [[[0.1, 0]]]]"#).unwrap();
        let [(way, Acts::Spring(stiffness))] = &layout.joints[0].terms[..] else { panic!("no spring") };
        assert_eq!((*way, &stiffness[..]), (Way::Lateral, &[(0.1, 0)][..]));
    }

    #[test]
    fn faulty_layouts_are_errors_with_their_reason() {
        for (term, reason) in [
            (r#"["sideways", "spring", [[]]]"#, "sideways"),
            (r#"["lateral", "glue", [[]]]"#, "no law \"glue\""),
            (r#"["lateral", "stop", [[]]]"#, "\"stop\" with 1 numbers"),
            (r#"["lateral", "spring""#, "line"),
        ] {
            let error = with_term(term).unwrap_err().to_string();
            assert!(error.contains(reason), "{error}");
        }
    }
}
