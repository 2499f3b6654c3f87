//! Groups over threads: designs, perturbed parameters, candidates.
use crate::curving::{Equilibrium, EquilibriumForces};
use crate::error::{Result, expect_len};
use crate::integrate::comparison::{Filter, apply_sensors, as_rows, filtered};
use crate::integrate::recorder::{Recorder, Series};
use crate::integrate::ride_statistics::{RideSums, cascade};
use crate::integrate::run::run;
use crate::rate::Rate;
use crate::rate::forms::Choice;
use crate::rate::general::GroupPart;
use crate::rate::input_table::InputTable;
use crate::simd::{Dual, Job, LANES, Lanes, Part, Portable, STATES, dispatch, level};
use crate::vehicle::group::Group;
use crate::vehicle::structure::{Single, Structure};
use rayon::prelude::*;
use std::cell::RefCell;
use std::sync::atomic::AtomicBool;

/// Vehicles of one structure; every row is one vehicle.
pub struct VehicleBatch<'a> {
    pub structure: &'a Structure,
    pub count: usize,
    pub numbers: &'a [f64],
    pub effects: &'a [f64],
    pub amounts: &'a [f64],
    /// Empty: 1 for all.
    pub speed_scale: &'a [f64],
    /// [vehicle][state], empty: at rest.
    pub initial: &'a [f64],
}

/// Vehicles that step together, [`group_size`] or what is left: the first, and how many.
#[derive(Clone, Copy)]
struct LaneGroup {
    from: usize,
    live: usize,
}

impl LaneGroup {
    /// The vehicle of a lane; lanes that are left over carry the first.
    fn of(self, lane: usize) -> usize {
        self.from + if lane < self.live { lane } else { 0 }
    }
}

/// Vehicles of a group: sixteen, in which one part hides the latency of the other; eight where sixteen would leave one
/// thread of a pool with most of the work. The digits of a vehicle do not depend on the others in its group.
fn group_size(count: usize) -> usize {
    let is_shared = rayon::current_thread_index().is_some() && rayon::current_num_threads() > 1;
    if is_shared && 2 * count <= 3 * LANES { LANES / 2 } else { LANES }
}

/// Steps of a run from which it takes longer than to make its groups ready.
const LONG_RUN: usize = 500;

/// Vehicles of a group whose channels are recorded: no more than the widest part takes, so that what is recorded stays in
/// the cache; and of long runs those of one register where the form fills it as well as two.
fn recorded_group_size(vehicles: &VehicleBatch<'_>, inputs: &InputTable<'_>) -> Result<usize> {
    let size = group_size(vehicles.count).min(level().widest().max(LANES / 2));
    if inputs.step_count() < LONG_RUN || size <= level().register() {
        return Ok(size);
    }
    // of a batch the first often lacks what the others have
    let ends = [vehicles.single(0), vehicles.single(vehicles.count - 1)];
    let group = vehicles.structure.group(&ends, &[])?;
    Ok(if Choice::of(&group, inputs.level).is_straight() { level().register() } else { size })
}

/// Work on groups: side by side on the threads of a pool, one after the other outside of one.
fn for_each_group<G: Send, R: Send>(groups: Vec<G>, work: impl Fn(G) -> Result<R> + Sync + Send) -> Result<Vec<R>> {
    if rayon::current_thread_index().is_some() {
        groups.into_par_iter().map(work).collect()
    } else {
        groups.into_iter().map(work).collect()
    }
}

impl VehicleBatch<'_> {
    /// One of them.
    pub fn single(&self, i: usize) -> Single<'_> {
        let row = |x: &[f64]| i * (x.len() / self.count)..(i + 1) * (x.len() / self.count);
        Single {
            numbers: &self.numbers[row(self.numbers)],
            effects: &self.effects[row(self.effects)],
            amounts: &self.amounts[row(self.amounts)],
            speed_scale: self.speed_scale.get(i).copied().unwrap_or(1.0),
        }
    }

    fn initial(&self, some: LaneGroup) -> Vec<Lanes> {
        let states = self.initial.len() / self.count;
        (0..states).map(|s| Lanes::from_fn(|l| self.initial[some.of(l) * states + s])).collect()
    }

    fn lane_groups(&self, size: usize) -> Vec<LaneGroup> {
        let of = |from| LaneGroup { from, live: (self.count - from).min(size) };
        (0..self.count).step_by(size).map(of).collect()
    }

    /// The first group and its sums, for counting operations.
    #[cfg(test)]
    pub fn first_group(&self, statistics_request: &StatisticsRequest<'_>, samples: usize) -> Result<(Group, RideSums)> {
        let first = LaneGroup { from: 0, live: self.count.min(LANES) };
        Ok((self.group(first, &statistics_request.channels)?, statistics_request.sums(self, first, samples)?))
    }

    fn group(&self, some: LaneGroup, channels: &[String]) -> Result<Group> {
        let singles: Vec<_> = (some.from..some.from + some.live).map(|i| self.single(i)).collect();
        self.structure.group(&singles, channels)
    }
}

/// Numbers of a series that a thread retains for its next one.
const MAX_RETAINED: usize = 1 << 23;

thread_local! {
    /// Memory of the series of this thread.
    static MEMORY: RefCell<Vec<f64>> = const { RefCell::new(Vec::new()) };
}

/// Series of one group after its sensor laws as rows, filtered, cut and weighted where a filter is given; where lanes diverged.
fn simulate_group(
    vehicles: &VehicleBatch<'_>,
    inputs: &InputTable<'_>,
    channels: &[String],
    filter: Option<&Filter>,
    some: LaneGroup,
    cancel: &AtomicBool,
    out: &mut [f64],
) -> Result<[Option<usize>; LANES]> {
    let (group, live) = (vehicles.group(some, channels)?, some.live);
    let mut series = Series::in_memory(MEMORY.take(), group.readings.len(), inputs.samples(), live);
    let diverged = run(&group, inputs, &vehicles.initial(some), live, Recorder::Series(&mut series), cancel)?;
    apply_sensors(&group, &mut series, live, inputs.dt);
    match filter {
        Some(filter) => filtered(&series, live, filter, out),
        None => as_rows(&series, live, out),
    }
    let memory = series.into_memory();
    if memory.len() <= MAX_RETAINED {
        MEMORY.set(memory);
    }
    Ok(diverged)
}

/// Series of every vehicle, [vehicle][channel][sample], filtered, cut and weighted where a filter is given.
pub fn simulate(
    vehicles: &VehicleBatch<'_>,
    inputs: &InputTable<'_>,
    channels: &[String],
    filter: Option<&Filter>,
    cancel: &AtomicBool,
) -> Result<(Vec<f64>, Vec<Option<usize>>)> {
    let samples = inputs.samples();
    if let Some(filter) = filter {
        filter.check(channels.len(), samples)?;
    }
    let row = channels.len() * filter.map_or(samples, |f| f.kept_samples(samples));
    let mut out = vec![0.0; vehicles.count * row];
    let mut diverged = vec![None; vehicles.count];
    let size = recorded_group_size(vehicles, inputs)?;
    let parts = out.chunks_mut((size * row).max(1)).zip(diverged.chunks_mut(size)).zip(vehicles.lane_groups(size));
    for_each_group(parts.collect(), |((out, diverged_at), some)| {
        let found = simulate_group(vehicles, inputs, channels, filter, some, cancel, out)?;
        diverged_at.copy_from_slice(&found[..some.live]);
        Ok(())
    })?;
    Ok((out, diverged))
}

/// The form that these vehicles take on a track with cross-level or without.
pub fn form(vehicles: &VehicleBatch<'_>, is_level: bool) -> Result<&'static str> {
    let some = LaneGroup { from: 0, live: vehicles.count.min(LANES) };
    let group = vehicles.group(some, &[])?;
    Ok(Choice::of(&group, is_level).name())
}

/// A file of `structures`, by which the rows of these vehicles are compiled as straight code; none for vehicles in other
/// forms than that of bodies.
pub fn structure_file(vehicles: &VehicleBatch<'_>) -> Result<Option<String>> {
    let group = vehicles.group(LaneGroup { from: 0, live: vehicles.count.min(LANES) }, &[])?;
    Ok(match Choice::of(&group, false) {
        Choice::Fused { accelerations, .. } => Some(accelerations.file()),
        _ => None,
    })
}

/// The rate of change of every vehicle in its own state, [vehicle][state], under one row of the input table.
pub fn rates(vehicles: &VehicleBatch<'_>, row: &[f64], states: &[f64]) -> Result<Vec<f64>> {
    expect_len("columns of the input row", row.len(), vehicles.structure.columns())?;
    let mut out = Vec::with_capacity(states.len());
    for some in vehicles.lane_groups(group_size(vehicles.count)) {
        let group = vehicles.group(some, &[])?;
        expect_len("states", states.len(), vehicles.count * group.states)?;
        let mut x = [Lanes::ZERO; STATES];
        for (s, x) in x.iter_mut().enumerate().take(group.states) {
            *x = Lanes::from_fn(|l| states[some.of(l) * group.states + s]);
        }
        let dx = dispatch(level(), Rates { group: &group, row, x: &x });
        out.extend((0..some.live).flat_map(|l| dx[..group.states].iter().map(move |d| d.0[l])));
    }
    Ok(out)
}

struct Rates<'a> {
    group: &'a Group,
    row: &'a [f64],
    x: &'a [Lanes; STATES],
}

impl Job for Rates<'_> {
    type Output = Vec<Lanes>;

    #[inline(always)]
    fn run<P: Part>(self) -> Vec<Lanes> {
        let (n, mut out) = (self.group.dofs, vec![Lanes::ZERO; STATES]);
        for at in (0..LANES).step_by(P::WIDTH) {
            let mut x: [P; STATES] = std::array::from_fn(|i| P::load(&self.x[i], at));
            let mut dx = [P::zero(); STATES];
            GroupPart::new(self.group, at).rate(0, self.row, &mut x, &mut dx);
            for i in 0..self.group.states {
                (if i < n { x[n + i] } else { dx[i] }).store(&mut out[i], at);
            }
        }
        out
    }
}

/// Derivatives [vehicle][state][state] of [`rates`] at rest under an input row, exactly.
pub fn jacobians(vehicles: &VehicleBatch<'_>, row: &[f64]) -> Result<Vec<f64>> {
    expect_len("columns of the input row", row.len(), vehicles.structure.columns())?;
    let mut out = Vec::new();
    for some in vehicles.lane_groups(group_size(vehicles.count)) {
        let group = vehicles.group(some, &[])?;
        let columns: Vec<_> = (0..group.states).map(|j| jacobian_column(&group, some.live, row, j)).collect();
        for lane in 0..some.live {
            out.extend((0..group.states).flat_map(|i| columns.iter().map(move |column| column[i].0[lane])));
        }
    }
    Ok(out)
}

/// Derivatives of the rates of all states with respect to one of them.
fn jacobian_column(group: &Group, live: usize, row: &[f64], variable: usize) -> Vec<Lanes> {
    let (n, mut column) = (group.dofs, vec![Lanes::ZERO; group.states]);
    let mut x = [Dual::<Portable>::zero(); STATES];
    x[variable].slope = Portable::splat(1.0);
    for at in (0..live).step_by(Portable::WIDTH) {
        let mut dx = [Dual::zero(); STATES];
        GroupPart::new(group, at).rate(0, row, &mut x, &mut dx);
        for (i, to) in column.iter_mut().enumerate() {
            (if i < n { x[n + i] } else { dx[i] }).slope.store(to, at);
        }
    }
    column
}

/// Equilibrium forces of every vehicle in its curve, a row of the input table each, at `initial`:
/// [vehicle][dof and own state], and wheelset results.
pub fn statics(vehicles: &VehicleBatch<'_>, table: &[f64], curvature: &[f64]) -> Result<(Vec<f64>, Vec<f64>)> {
    let (mut forces, mut results) = (Vec::new(), Vec::new());
    for some in vehicles.lane_groups(group_size(vehicles.count)) {
        let group = vehicles.group(some, &[])?;
        let rows = |of: &[f64], width: usize| -> Result<Vec<Lanes>> {
            expect_len("numbers of an equilibrium in the curve", of.len(), width * vehicles.count)?;
            Ok((0..width).map(|k| Lanes::from_fn(|l| of[some.of(l) * width + k])).collect())
        };
        let (states, row) = (rows(vehicles.initial, group.states)?, rows(table, group.columns)?);
        let stand = Equilibrium { states: &states, row: &row, curvature: rows(curvature, 1)?[0] };
        // a few iterations: not worth compiling for each level
        let found = EquilibriumForces { group: &group, stand: &stand }.run::<Portable>();
        for lane in 0..some.live {
            forces.extend(found.residual.iter().map(|f| f.0[lane]));
            results.extend(found.wheelsets.iter().flatten().map(|w| w.0[lane]));
        }
    }
    Ok((forces, results))
}

/// The statistics of a ride of every vehicle.
pub struct Scores {
    /// Per vehicle: mean, standard deviation and share of flange contact of e_1, e_2, ...
    pub displacement: Vec<Vec<[f64; 3]>>,
    /// Per vehicle, per acceleration, per cascade: rms.
    pub rms: Vec<Vec<f64>>,
    /// Per vehicle, per acceleration: mean squares of the blocks.
    pub blocks: Vec<Vec<f64>>,
    pub diverged: Vec<Option<usize>>,
}

/// Request for the statistics of a ride.
pub struct StatisticsRequest<'a> {
    /// e_1, e_2, ..., then accelerations.
    pub channels: Vec<String>,
    /// Number of channels that are displacements.
    pub wheelsets: usize,
    /// Per vehicle [m].
    pub clearance: &'a [f64],
    /// Per cascade: sections of every vehicle, [vehicle][section][6].
    pub cascades: Vec<&'a [f64]>,
    pub block: usize,
}

impl StatisticsRequest<'_> {
    /// The sums of vehicles that step together.
    fn sums(&self, vehicles: &VehicleBatch<'_>, some: LaneGroup, samples: usize) -> Result<RideSums> {
        expect_len("clearances", self.clearance.len(), vehicles.count)?;
        let clearance = Lanes::from_fn(|l| self.clearance[some.of(l)]);
        let lanes = |all: &&[f64]| {
            let n = all.len() / vehicles.count;
            cascade(&(some.from..some.from + some.live).map(|i| &all[i * n..(i + 1) * n]).collect::<Vec<_>>())
        };
        let cascades = self.cascades.iter().map(lanes).collect::<Result<_>>()?;
        let wheelsets = self.wheelsets.min(self.channels.len());
        Ok(RideSums::new(samples, clearance, [wheelsets, self.channels.len() - wheelsets], cascades, self.block))
    }
}

/// The statistics of every vehicle's ride along a course.
pub fn score(
    vehicles: &VehicleBatch<'_>,
    inputs: &InputTable<'_>,
    statistics_request: &StatisticsRequest<'_>,
    cancel: &AtomicBool,
) -> Result<Scores> {
    let samples = inputs.samples();
    let parts = for_each_group(vehicles.lane_groups(group_size(vehicles.count)), |some| {
        let group = vehicles.group(some, &statistics_request.channels)?;
        let mut sums = statistics_request.sums(vehicles, some, samples)?;
        let initial = vehicles.initial(some);
        let diverged_at = run(&group, inputs, &initial, some.live, Recorder::RideSums(&mut sums), cancel)?;
        Ok((sums, diverged_at, some.live))
    })?;
    let mut scores = Scores { displacement: Vec::new(), rms: Vec::new(), blocks: Vec::new(), diverged: Vec::new() };
    for (sums, diverged_at, live) in parts {
        for (lane, diverged_at) in diverged_at.iter().enumerate().take(live) {
            scores.displacement.push(sums.displacement(lane));
            scores.rms.push((0..sums.squares.len()).map(|i| sums.rms(i, lane)).collect());
            scores.blocks.push(sums.blocks.iter().map(|b| b.0[lane]).collect());
            scores.diverged.push(*diverged_at);
        }
    }
    Ok(scores)
}
