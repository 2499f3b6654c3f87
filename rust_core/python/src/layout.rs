//! The layout of a vehicle of bodies and elements as Python hands it over.
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use railui_core::vehicle::bodies::{self, Acts, Layout, Number, Way};

#[derive(FromPyObject)]
struct Wheels {
    spin_inertia: Number,
    half_gauge: Number,
    rolling_radius: Number,
    wheel_load: Number,
    contact: [Number; 6],
    spin_creep: Number,
    roller_radius: Number,
}

#[derive(FromPyObject)]
struct Body {
    name: String,
    family: String,
    number: u8,
    mass: Number,
    yaw_inertia: Option<Number>,
    roll_inertia: Option<Number>,
    x: Number,
    height: Number,
    wheels: Option<Wheels>,
}

#[derive(FromPyObject)]
struct Joint {
    name: String,
    number: u8,
    bodies: [Option<usize>; 2],
    points: [bodies::Point; 2],
    mirrored: bool,
    terms: Vec<(String, String, Vec<Number>)>,
    static_load: Number,
}

#[derive(FromPyObject)]
struct Floor {
    name: String,
    body: usize,
    point: bodies::Point,
}

#[derive(FromPyObject)]
struct Accelerometer {
    name: String,
    body: usize,
    at: [f64; 2],
    with_gravity: bool,
}

/// `railui.core.Layout`.
#[derive(FromPyObject)]
pub struct Given {
    numbers: usize,
    bodies: Vec<Body>,
    joints: Vec<Joint>,
    floor: Vec<Floor>,
    accelerometers: Vec<Accelerometer>,
}

fn way(word: &str) -> PyResult<Way> {
    Ok(match word {
        "longitudinal" => Way::Longitudinal,
        "lateral" => Way::Lateral,
        "vertical" => Way::Vertical,
        "yaw" => Way::Yaw,
        "roll" => Way::Roll,
        "along" => Way::Along,
        _ => return Err(PyValueError::new_err(format!("no direction {word:?}"))),
    })
}

fn acts(word: &str, numbers: Vec<Number>) -> PyResult<Acts> {
    let wrong = |numbers: Vec<Number>| PyValueError::new_err(format!("{word:?} with {} numbers", numbers.len()));
    Ok(match word {
        "spring" => Acts::Spring(<[Number; 1]>::try_from(numbers).map_err(wrong)?[0].clone()),
        "damper" => Acts::Damper(<[Number; 1]>::try_from(numbers).map_err(wrong)?[0].clone()),
        "series" => Acts::Series(numbers.try_into().map_err(wrong)?),
        "stop" => Acts::Stop(numbers.try_into().map_err(wrong)?),
        _ => return Err(wrong(numbers)),
    })
}

impl Given {
    /// The layout, its indices checked: what comes from Python must not make the kernel panic.
    pub fn layout(self) -> PyResult<Layout> {
        let body = |b: Body| bodies::Body {
            name: b.name,
            family: b.family,
            number: b.number,
            mass: b.mass,
            yaw_inertia: b.yaw_inertia,
            roll_inertia: b.roll_inertia,
            x: b.x,
            height: b.height,
            wheels: b.wheels.map(|w| bodies::Wheels {
                spin_inertia: w.spin_inertia,
                half_gauge: w.half_gauge,
                rolling_radius: w.rolling_radius,
                wheel_load: w.wheel_load,
                contact: w.contact,
                spin_creep: w.spin_creep,
                roller_radius: w.roller_radius,
            }),
        };
        let joint = |j: Joint| {
            let terms = j.terms.into_iter().map(|(to, law, numbers)| Ok((way(&to)?, acts(&law, numbers)?)));
            Ok::<_, PyErr>(bodies::Joint {
                terms: terms.collect::<PyResult<_>>()?,
                name: j.name,
                number: j.number,
                bodies: j.bodies,
                points: j.points,
                mirrored: j.mirrored,
                static_load: j.static_load,
            })
        };
        let accelerometer = |a: Accelerometer| bodies::Accelerometer {
            name: a.name,
            body: a.body,
            at: a.at,
            with_gravity: a.with_gravity,
        };
        let layout = Layout {
            numbers: self.numbers,
            bodies: self.bodies.into_iter().map(body).collect(),
            joints: self.joints.into_iter().map(joint).collect::<PyResult<_>>()?,
            floor: self
                .floor
                .into_iter()
                .map(|f| bodies::Floor { name: f.name, body: f.body, point: f.point })
                .collect(),
            accelerometers: self.accelerometers.into_iter().map(accelerometer).collect(),
        };
        layout.check().map_err(crate::to_py_error)?;
        Ok(layout)
    }
}
