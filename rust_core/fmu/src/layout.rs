//! The layout of a vehicle of bodies and elements in `vehicle.json`.
use crate::json::Json;
use railui_core::vehicle::bodies::{Accelerometer, Acts, Body, Floor, Joint, Layout, Number, Point, Way, Wheels};

type Read<T> = Result<T, String>;

/// A sum of factor times number of the row.
pub fn sum(json: &Json) -> Read<Number> {
    json.list(|term| {
        let [factor, index] = term.tuple()?;
        Ok((factor.number()?, index.count()?))
    })
}

pub fn layout(json: &Json) -> Read<Layout> {
    Ok(Layout {
        numbers: json.get("numbers")?.count()?,
        bodies: json.get("bodies")?.list(body)?,
        joints: json.get("joints")?.list(joint)?,
        floor: json.get("floor")?.list(floor)?,
        accelerometers: json.get("accelerometers")?.list(accelerometer)?,
    })
}

/// A small number of a body or joint among its like.
pub fn small(json: &Json) -> Read<u8> {
    u8::try_from(json.count()?).map_err(|e| e.to_string())
}

fn point(json: &Json) -> Read<Point> {
    let [x, y, height] = json.tuple()?;
    Ok([sum(x)?, sum(y)?, sum(height)?])
}

fn body(json: &Json) -> Read<Body> {
    Ok(Body {
        name: json.get("name")?.text()?,
        family: json.get("family")?.text()?,
        number: small(json.get("number")?)?,
        mass: sum(json.get("mass")?)?,
        yaw_inertia: json.get("yaw_inertia")?.optional(sum)?,
        roll_inertia: json.get("roll_inertia")?.optional(sum)?,
        x: sum(json.get("x")?)?,
        height: sum(json.get("height")?)?,
        wheels: json.get("wheels")?.optional(wheels)?,
    })
}

fn wheels(json: &Json) -> Read<Wheels> {
    let contact = json.get("contact")?.list(sum)?;
    Ok(Wheels {
        spin_inertia: sum(json.get("spin_inertia")?)?,
        half_gauge: sum(json.get("half_gauge")?)?,
        rolling_radius: sum(json.get("rolling_radius")?)?,
        wheel_load: sum(json.get("wheel_load")?)?,
        contact: contact.try_into().map_err(|_| "a contact needs six numbers".to_string())?,
        spin_creep: sum(json.get("spin_creep")?)?,
        roller_radius: sum(json.get("roller_radius")?)?,
    })
}

fn joint(json: &Json) -> Read<Joint> {
    let bodies: &[Json; 2] = json.get("bodies")?.tuple()?;
    let points: &[Json; 2] = json.get("points")?.tuple()?;
    Ok(Joint {
        name: json.get("name")?.text()?,
        number: small(json.get("number")?)?,
        bodies: [bodies[0].optional(Json::count)?, bodies[1].optional(Json::count)?],
        points: [point(&points[0])?, point(&points[1])?],
        mirrored: json.get("mirrored")?.is_true()?,
        terms: json.get("terms")?.list(term)?,
        static_load: sum(json.get("static_load")?)?,
    })
}

/// A direction, and the law that acts in it with its numbers.
fn term(json: &Json) -> Read<(Way, Acts)> {
    let [direction, law, numbers] = json.tuple()?;
    let numbers = numbers.list(sum)?;
    let way = match direction.text()?.as_str() {
        "longitudinal" => Way::Longitudinal,
        "lateral" => Way::Lateral,
        "vertical" => Way::Vertical,
        "yaw" => Way::Yaw,
        "roll" => Way::Roll,
        "along" => Way::Along,
        other => return Err(format!("no direction {other:?}")),
    };
    let law = law.text()?;
    let wrong = || format!("{law:?} with another count of numbers");
    let acts = match (law.as_str(), &numbers[..]) {
        ("spring", [stiffness]) => Acts::Spring(stiffness.clone()),
        ("damper", [damping]) => Acts::Damper(damping.clone()),
        ("series", [_, _, _]) => Acts::Series(numbers.try_into().map_err(|_| wrong())?),
        ("stop", [_, _]) => Acts::Stop(numbers.try_into().map_err(|_| wrong())?),
        _ => return Err(wrong()),
    };
    Ok((way, acts))
}

fn floor(json: &Json) -> Read<Floor> {
    Ok(Floor { name: json.get("name")?.text()?, body: json.get("body")?.count()?, point: point(json.get("point")?)? })
}

fn accelerometer(json: &Json) -> Read<Accelerometer> {
    let [x, z] = json.get("at")?.tuple()?;
    Ok(Accelerometer {
        name: json.get("name")?.text()?,
        body: json.get("body")?.count()?,
        at: [x.number()?, z.number()?],
        with_gravity: json.get("with_gravity")?.is_true()?,
    })
}
