//! The vehicle of an FMU: `vehicle.json` among its resources.
use crate::json::Json;
use crate::layout::{layout, small, sum};
use railui_core::effects::Law;
use railui_core::error::Error;
use railui_core::vehicle::bodies::{Layout, Number};
use railui_core::vehicle::kinds::VehicleKind;
use railui_core::vehicle::structure::{Placed, Structure};
use std::path::Path;

/// The vehicle and the order of its variables.
#[derive(Clone, Debug)]
pub struct Description {
    /// Equal to that of modelDescription.xml.
    pub token: String,
    kind: String,
    layout: Option<Layout>,
    placed: Vec<PlacedEffect>,
    /// Numbers of the vehicle, then those of its effects.
    pub row: Vec<f64>,
    /// How many of them are of the vehicle.
    pub numbers: usize,
    /// Distance of each wheelset behind the first, over the row.
    pub behind: Vec<Number>,
    /// States that start at the lateral deviation of the track.
    pub lateral: Vec<usize>,
    /// Outputs, by the kernel's names.
    pub channels: Vec<String>,
    /// Entry of the row of each parameter.
    pub parameters: Vec<usize>,
    /// [m/s]
    pub speed: f64,
    /// Largest number of RK4 steps per communication step.
    pub most_steps: usize,
}

#[derive(Clone, Debug)]
struct PlacedEffect {
    kind: String,
    at: String,
    wheelset: u8,
    count: usize,
    against: Option<String>,
}

impl Description {
    /// Read the resources of an FMU.
    pub fn read(resources: &Path) -> Result<Self, String> {
        let file = resources.join("vehicle.json");
        let text = std::fs::read_to_string(&file).map_err(|e| format!("{}: {e}", file.display()))?;
        let read = Json::read(&text).and_then(|json| Self::of(&json));
        let read = read.map_err(|e| format!("{}: {e}", file.display()))?;
        read.check()?;
        Ok(read)
    }

    fn of(json: &Json) -> Result<Self, String> {
        let indices = |key: &str| json.get(key)?.list(Json::count);
        Ok(Description {
            token: json.get("token")?.text()?,
            kind: json.get("kind")?.text()?,
            layout: json.get("layout")?.optional(layout)?,
            placed: json.get("placed")?.list(PlacedEffect::of)?,
            row: json.get("row")?.list(Json::number)?,
            numbers: json.get("numbers")?.count()?,
            behind: json.get("behind")?.list(sum)?,
            lateral: indices("lateral")?,
            channels: json.get("channels")?.list(Json::text)?,
            parameters: indices("parameters")?,
            speed: json.get("speed")?.number()?,
            most_steps: json.get("most_steps")?.count()?,
        })
    }

    /// Every index within the row.
    fn check(&self) -> Result<(), String> {
        let terms = self.behind.iter().flatten().map(|(_, i)| i + 1);
        let most = terms.chain(self.parameters.iter().map(|i| i + 1)).chain([self.numbers]).max().unwrap_or(0);
        if most > self.row.len() {
            return Err(format!("vehicle.json: {} numbers, {most} expected", self.row.len()));
        }
        Ok(())
    }

    /// The structure of the vehicle, checked.
    pub fn structure(&self) -> Result<Structure, Error> {
        let kind = match &self.layout {
            Some(layout) => {
                layout.check()?;
                VehicleKind::Bodies(layout.clone())
            }
            None => VehicleKind::named(&self.kind, None)?,
        };
        let placed = self.placed.iter().map(PlacedEffect::placed).collect::<Result<_, _>>()?;
        let structure = Structure { kind, measured: Vec::new(), placed, line: false };
        structure.check()?;
        Ok(structure)
    }
}

impl PlacedEffect {
    fn of(json: &Json) -> Result<Self, String> {
        Ok(PlacedEffect {
            kind: json.get("kind")?.text()?,
            at: json.get("at")?.text()?,
            wheelset: small(json.get("wheelset")?)?,
            count: json.get("count")?.count()?,
            against: json.get("against")?.optional(Json::text)?,
        })
    }

    fn placed(&self) -> Result<Placed, Error> {
        let law = Law::named(&self.kind).ok_or_else(|| Error::Effect(self.kind.clone()))?;
        let law = self.against.as_ref().map_or(Ok(law), |word| law.against(word))?;
        Ok(Placed { law, at: self.at.clone(), wheelset: self.wheelset, count: self.count })
    }
}
