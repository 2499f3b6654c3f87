//! The vehicle of an FMU: `vehicle.json` among its resources.
use railui_core::effects::Law;
use railui_core::error::Error;
use railui_core::vehicle::bodies::{Layout, Number};
use railui_core::vehicle::kinds::VehicleKind;
use railui_core::vehicle::structure::{Placed, Structure};
use serde::Deserialize;
use std::path::Path;

/// The vehicle and the order of its variables.
#[derive(Clone, Debug, Deserialize)]
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

#[derive(Clone, Debug, Deserialize)]
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
        let read: Self = serde_json::from_str(&text).map_err(|e| format!("{}: {e}", file.display()))?;
        read.check()?;
        Ok(read)
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
    fn placed(&self) -> Result<Placed, Error> {
        let law = Law::named(&self.kind).ok_or_else(|| Error::Effect(self.kind.clone()))?;
        let law = self.against.as_ref().map_or(Ok(law), |word| law.against(word))?;
        Ok(Placed { law, at: self.at.clone(), wheelset: self.wheelset, count: self.count })
    }
}
