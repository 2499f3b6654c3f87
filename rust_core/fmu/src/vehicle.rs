//! The vehicle of an FMU on its way: its state, and the RK4 steps of one communication step.
use crate::description::Description;
use crate::history::{History, TrackSample};
use railui_core::error::Error;
use railui_core::integrate::recorder::{Recorder, Series};
use railui_core::integrate::run::run;
use railui_core::rate::input_table::InputTable;
use railui_core::simd::Lanes;
use railui_core::vehicle::group::Group;
use railui_core::vehicle::structure::{Single, Structure};
use std::sync::atomic::AtomicBool;

/// s and v before the columns of the wheelsets, five of each, and two forces of the carbody.
const FIRST_WHEELSET: usize = 2;
const PER_WHEELSET: usize = 5;

/// Relative difference of communication steps that rounding of times makes.
const STEP_TOLERANCE: f64 = 1e-6;

/// The vehicle with its numbers, ready to step.
#[derive(Clone, Debug)]
pub struct Vehicle {
    structure: Structure,
    row: Vec<f64>,
    numbers: usize,
    speed: f64,
    most_steps: usize,
    group: Group,
    behind: Vec<f64>,
    lateral: Vec<usize>,
    channels: usize,
    history: History,
    state: Vec<f64>,
    /// Length of the last communication step [s], whose RK4 steps follow when its end is known.
    pending: Option<f64>,
    /// A communication step and its number of RK4 steps.
    steps: Option<(f64, usize)>,
    pub outputs: Vec<f64>,
}

impl Vehicle {
    /// The vehicle of a description with other numbers, at a speed [m/s].
    pub fn new(description: &Description, row: &[f64], speed: f64) -> Result<Self, Error> {
        if !(speed > 0.0 && speed.is_finite()) {
            return Err(Error::Value { what: "speed".into(), value: speed, rule: "positive" });
        }
        let structure = description.structure()?;
        let one = single(&structure, row, description.numbers);
        let states = structure.group(&[one.view()], &[])?.states;
        let names = description.channels.iter().cloned().chain((0..states).map(|k| format!("state.{k}")));
        let group = structure.group(&[one.view()], &names.collect::<Vec<_>>())?;
        let wheelsets = description.behind.len();
        let columns = FIRST_WHEELSET + PER_WHEELSET * wheelsets + 2;
        if group.columns != columns {
            let what = "columns of a vehicle on a track".into();
            return Err(Error::Shape { what, got: group.columns, expected: columns });
        }
        let distance = |terms: &Vec<(f64, usize)>| terms.iter().map(|(a, i)| a * row[*i]).sum();
        Ok(Vehicle {
            structure,
            row: row.to_vec(),
            numbers: description.numbers,
            speed,
            most_steps: description.most_steps,
            behind: description.behind.iter().map(distance).collect(),
            lateral: description.lateral.clone(),
            channels: description.channels.len(),
            history: History::default(),
            state: vec![0.0; states],
            pending: None,
            steps: None,
            outputs: vec![0.0; description.channels.len()],
            group,
        })
    }

    /// The outputs of the vehicle at rest on the track of a first sample.
    pub fn start(&mut self, first: TrackSample) -> Result<(), Error> {
        self.history = History::default();
        self.pending = None;
        self.history.push(first, 0.0);
        self.state.fill(0.0);
        for i in &self.lateral {
            self.state[*i] = first.value[0];
        }
        let table = self.table_row(first.s);
        self.advance(&table, 1.0, 1)
    }

    /// Take the sample at a communication point and a step [s] from there: the RK4 steps up to this point.
    pub fn step(&mut self, sample: TrackSample, length: f64) -> Result<(), Error> {
        let Some(before) = self.pending else {
            self.start(sample)?;
            self.pending = Some(length);
            return Ok(());
        };
        let reach = self.behind.iter().copied().fold(0.0, f64::max);
        self.history.push(sample, reach);
        let steps = self.steps_of(before)?;
        let table = self.table(steps);
        self.pending = Some(length);
        self.advance(&table, before, steps)
    }

    /// RK4 steps of a communication step, by the rule of a ride.
    fn steps_of(&mut self, length: f64) -> Result<usize, Error> {
        if let Some((known, steps)) = self.steps
            && (known - length).abs() <= STEP_TOLERANCE * known
        {
            return Ok(steps);
        }
        let one = single(&self.structure, &self.row, self.numbers);
        let steps = self.structure.steps(&one.view(), [self.speed; 2], length, 1.0, self.most_steps)?;
        self.steps = Some((length, steps));
        Ok(steps)
    }

    /// The rows of the input table at the half steps of the last interval.
    fn table(&self, steps: usize) -> Vec<f64> {
        let Some([first, last]) = self.history.last_interval() else { return Vec::new() };
        let half = (last.s - first.s) / (2 * steps) as f64;
        let place = |i: usize| if i == 2 * steps { last.s } else { first.s + half * i as f64 };
        (0..=2 * steps).flat_map(|i| self.table_row(place(i))).collect()
    }

    fn table_row(&self, s: f64) -> Vec<f64> {
        let mut row = vec![s, self.speed];
        row.extend(self.behind.iter().flat_map(|behind| self.history.at(s - behind).columns()));
        row.extend([0.0; 2]);
        row
    }

    /// RK4 steps along a table; the outputs are those of its last row.
    fn advance(&mut self, table: &[f64], length: f64, steps: usize) -> Result<(), Error> {
        let inputs = InputTable::new(table, self.group.columns, steps, length);
        let samples = inputs.samples();
        let mut series = Series::new(self.group.readings.len(), samples, 1);
        let initial: Vec<_> = self.state.iter().map(|x| Lanes::splat(*x)).collect();
        let never = AtomicBool::new(false);
        let diverged = run(&self.group, &inputs, &initial, 1, Recorder::Series(&mut series), &never)?;
        if diverged[0].is_some() {
            let what = format!("the motion of the vehicle at s = {:.3} m", table[table.len() - self.group.columns]);
            return Err(Error::Value { what, value: f64::INFINITY, rule: "bounded: it left the rails" });
        }
        let mut last = (0..self.group.readings.len()).map(|channel| series.value(channel, samples - 1, 0));
        self.outputs = last.by_ref().take(self.channels).collect();
        self.state = last.collect();
        Ok(())
    }
}

/// The numbers of one vehicle with all of its effects in full.
struct Whole<'a> {
    numbers: &'a [f64],
    effects: &'a [f64],
    amounts: Vec<f64>,
}

fn single<'a>(structure: &Structure, row: &'a [f64], numbers: usize) -> Whole<'a> {
    Whole { numbers: &row[..numbers], effects: &row[numbers..], amounts: vec![1.0; structure.placed.len()] }
}

impl Whole<'_> {
    fn view(&self) -> Single<'_> {
        Single { numbers: self.numbers, effects: self.effects, amounts: &self.amounts, speed_scale: 1.0 }
    }
}
