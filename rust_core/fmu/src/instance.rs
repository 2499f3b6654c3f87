//! An instance of the FMU: its variables by value reference and the mode it is in.
use crate::description::Description;
use crate::history::TrackSample;
use crate::vehicle::Vehicle;

/// Value references, in the order of modelDescription.xml: time, yw, dyw_ds, phiw, dphiw_ds, gauge, dgauge_ds, speed,
/// start, then the outputs and the parameters of the vehicle.
const TIME: usize = 0;
const INPUTS: usize = 1;
const SPEED: usize = 7;
const START: usize = 8;
const OUTPUTS: usize = 9;

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    Instantiated,
    Initialization,
    Step,
    Terminated,
}

#[derive(Clone, Debug)]
pub struct Instance {
    description: Description,
    pub mode: Mode,
    time: f64,
    begin: f64,
    inputs: [f64; SPEED - INPUTS],
    speed: f64,
    start: f64,
    row: Vec<f64>,
    vehicle: Option<Vehicle>,
}

impl Instance {
    pub fn new(description: Description) -> Self {
        let (row, speed) = (description.row.clone(), description.speed);
        let (vehicle, inputs, mode) = (None, Default::default(), Mode::Instantiated);
        Instance { description, mode, time: 0.0, begin: 0.0, inputs, speed, start: 0.0, row, vehicle }
    }

    /// As after its instantiation.
    pub fn reset(&mut self) {
        *self = Self::new(self.description.clone());
    }

    pub fn enter_initialization(&mut self, time: f64) -> Result<(), String> {
        self.expect(Mode::Instantiated, "fmi3EnterInitializationMode")?;
        (self.time, self.begin, self.mode) = (time, time, Mode::Initialization);
        Ok(())
    }

    pub fn exit_initialization(&mut self) -> Result<(), String> {
        self.expect(Mode::Initialization, "fmi3ExitInitializationMode")?;
        self.initialise()?;
        self.mode = Mode::Step;
        Ok(())
    }

    /// The vehicle with its present numbers, at rest on the present track.
    fn initialise(&mut self) -> Result<(), String> {
        let built = Vehicle::new(&self.description, &self.row, self.speed).and_then(|mut vehicle| {
            vehicle.start(self.sample(self.begin))?;
            Ok(vehicle)
        });
        self.vehicle = Some(built.map_err(|e| e.to_string())?);
        Ok(())
    }

    pub fn terminate(&mut self) -> Result<(), String> {
        self.expect(Mode::Step, "fmi3Terminate")?;
        self.mode = Mode::Terminated;
        Ok(())
    }

    pub fn do_step(&mut self, time: f64, length: f64) -> Result<(), String> {
        self.expect(Mode::Step, "fmi3DoStep")?;
        if !(length > 0.0 && length.is_finite() && time.is_finite()) {
            return Err(format!("fmi3DoStep: a step of {length} s from {time} s"));
        }
        let sample = self.sample(time);
        let vehicle = self.vehicle.as_mut().ok_or("the FMU is not initialized")?;
        vehicle.step(sample, length).map_err(|e| e.to_string())?;
        self.time = time + length;
        Ok(())
    }

    fn expect(&self, mode: Mode, function: &str) -> Result<(), String> {
        if self.mode == mode { Ok(()) } else { Err(format!("{function} in mode {:?}", self.mode)) }
    }

    /// The inputs at a time.
    fn sample(&self, time: f64) -> TrackSample {
        let [yw, dyw, phiw, dphiw, gauge, dgauge] = self.inputs;
        let s = self.start + self.speed * (time - self.begin);
        TrackSample { s, value: [yw, phiw, gauge], slope: [dyw, dphiw, dgauge] }
    }

    pub fn get(&mut self, reference: u32) -> Result<f64, String> {
        let i = reference as usize;
        let parameters = OUTPUTS + self.description.channels.len();
        match i {
            TIME => Ok(self.time),
            INPUTS..SPEED => Ok(self.inputs[i - INPUTS]),
            SPEED => Ok(self.speed),
            START => Ok(self.start),
            _ if i < parameters => self.output(i - OUTPUTS),
            _ => Ok(self.row[self.entry(i)?]),
        }
    }

    /// An output; before the steps that of the vehicle at rest on the present track.
    fn output(&mut self, i: usize) -> Result<f64, String> {
        if self.mode == Mode::Initialization {
            self.initialise()?;
        }
        self.vehicle.as_ref().map(|vehicle| vehicle.outputs[i]).ok_or_else(|| "outputs before initialization".into())
    }

    pub fn set(&mut self, reference: u32, value: f64) -> Result<(), String> {
        let i = reference as usize;
        if !value.is_finite() {
            return Err(format!("variable {reference} set to {value}"));
        }
        if (INPUTS..SPEED).contains(&i) {
            self.inputs[i - INPUTS] = value;
            return Ok(());
        }
        if !matches!(self.mode, Mode::Instantiated | Mode::Initialization) {
            return Err(format!("variable {reference} is fixed once the FMU is initialized"));
        }
        match i {
            SPEED => self.speed = value,
            START => self.start = value,
            _ => {
                let entry = self.entry(i)?;
                self.row[entry] = value;
            }
        }
        Ok(())
    }

    /// Entry of the row of a parameter.
    fn entry(&self, reference: usize) -> Result<usize, String> {
        let first = OUTPUTS + self.description.channels.len();
        let entry = reference.checked_sub(first).and_then(|i| self.description.parameters.get(i));
        entry.copied().ok_or_else(|| format!("no variable {reference} that can be set"))
    }
}
