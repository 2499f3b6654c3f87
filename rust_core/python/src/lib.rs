//! The one door to Python: conversions, no physics.
mod series;

use numpy::{PyArray1, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3, PyUntypedArrayMethods};
use pyo3::exceptions::{PyKeyboardInterrupt, PyRuntimeError, PyValueError};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyList};
use railui_core::batch::{self, StatisticsRequest, VehicleBatch};
use railui_core::effects::effect::{Kind, Param, Role, Site, Supersedes};
use railui_core::effects::{CATALOGUE, Law};
use railui_core::error::Error;
use railui_core::integrate::comparison::Filter;
use railui_core::rate::input_table::InputTable;

use railui_core::simd::peak::{self, Links};
use railui_core::vehicle::assembly::LINKAGE;
use railui_core::vehicle::bodies::Layout;
use railui_core::vehicle::kinds::VehicleKind;
use railui_core::vehicle::structure::{Placed, Structure};
// the C functions of an FMU, exported from this library too: `railui export --fmu` copies it
use railui_fmu as _;
use rayon::{ThreadPool, ThreadPoolBuilder};
use std::collections::{BTreeMap, HashMap};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, mpsc};
use std::time::Duration;

pyo3::create_exception!(
    railui._core,
    NoResultError,
    PyValueError,
    "Numbers of a vehicle for which an analysis has no result: the vehicle fails, not the program."
);

/// Error of the kernel as an exception of Python.
fn to_py_error(error: Error) -> PyErr {
    match error {
        Error::Interrupted => PyKeyboardInterrupt::new_err("interrupted"),
        other if other.is_of_vehicle_numbers() => NoResultError::new_err(other.to_string()),
        other => PyValueError::new_err(other.to_string()),
    }
}

/// Take a pool of threads that no other caller uses meanwhile: callers do not wait for each other.
///
/// Limit of threads, above the cores of any machine: a hundred thousand would stop it.
fn with_threads<T>(jobs: usize, using: impl FnOnce(&ThreadPool) -> T) -> T {
    const MOST: usize = 1024;
    let jobs = jobs.min(MOST);
    static IDLE: Mutex<BTreeMap<usize, Vec<ThreadPool>>> = Mutex::new(BTreeMap::new());
    let idle = || IDLE.lock().unwrap_or_else(|e| e.into_inner());
    let idle_pool = idle().get_mut(&jobs).and_then(Vec::pop);
    let pool = idle_pool
        .unwrap_or_else(|| ThreadPoolBuilder::new().num_threads(jobs).build().expect("threads can be started"));
    let out = using(&pool);
    idle().entry(jobs).or_default().push(pool);
    out
}

/// Vehicles times steps of work that is done long before signals are looked at: it needs no thread of its own.
const SHORT_WORK: usize = 50_000;

/// Work without the interpreter's lock, for so many vehicles times steps; ctrl-c interrupts what takes long.
fn without_gil<T: Send>(
    py: Python<'_>,
    jobs: usize,
    vehicle_steps: usize,
    work: impl FnOnce(&AtomicBool) -> Result<T, Error> + Send,
) -> PyResult<T> {
    let done = if vehicle_steps <= SHORT_WORK {
        py.detach(|| catch_unwind(AssertUnwindSafe(|| work(&AtomicBool::new(false)))))
    } else {
        py.detach(|| with_threads(jobs, |pool| attended(pool, work)))?
    };
    match done {
        Ok(result) => result.map_err(to_py_error),
        Err(panic) => {
            let what = panic
                .downcast_ref::<String>()
                .cloned()
                .unwrap_or_else(|| panic.downcast_ref::<&str>().map_or_else(|| "unknown".into(), |s| (*s).to_string()));
            Err(PyRuntimeError::new_err(format!("the kernel failed: {what}; this is a fault of railui")))
        }
    }
}

/// Work on the threads of a pool, while this thread checks the signals of the interpreter every 50 ms.
fn attended<T: Send>(
    pool: &ThreadPool,
    work: impl FnOnce(&AtomicBool) -> T + Send,
) -> PyResult<std::thread::Result<T>> {
    let cancel = AtomicBool::new(false);
    let mut interrupt = None;
    let (send, receive) = mpsc::channel();
    let done = pool.in_place_scope(|scope| {
        scope.spawn(|_| {
            let _ = send.send(catch_unwind(AssertUnwindSafe(|| work(&cancel))));
        });
        loop {
            match receive.recv_timeout(Duration::from_millis(50)) {
                Ok(done) => return done,
                Err(_) if interrupt.is_some() => {}
                Err(_) => {
                    interrupt = Python::attach(|py| py.check_signals()).err();
                    cancel.store(interrupt.is_some(), Ordering::Relaxed);
                }
            }
        }
    });
    interrupt.map_or(Ok(done), Err)
}

fn role(param: &Param) -> &'static str {
    match param.role {
        Role::Strength => "strength",
        Role::Shape => "shape",
        Role::Optional => "optional",
        Role::Run => "run",
    }
}

/// The records of all effects as data.
#[pyfunction]
fn catalogue(py: Python<'_>) -> PyResult<Bound<'_, PyList>> {
    let list = PyList::empty(py);
    for law in CATALOGUE {
        let record = law.record();
        let d = PyDict::new(py);
        d.set_item("kind", record.key)?;
        d.set_item("title", record.title)?;
        d.set_item("source", record.source)?;
        d.set_item("at", record.at)?;
        d.set_item(
            "acts",
            match record.kind {
                Kind::Force => "force",
                Kind::Creep => "creep",
                Kind::Rolling => "rolling",
                Kind::Profile => "profile",
                Kind::Rail => "rail",
                Kind::Body => "body",
                Kind::Sensor(_) => "sensor",
            },
        )?;
        d.set_item(
            "supersedes",
            match record.supersedes {
                Supersedes::Nothing => None,
                Supersedes::Stiffness => Some("stiffness"),
                Supersedes::StiffnessAndDamping => Some("stiffness_and_damping"),
                Supersedes::CreepForces => Some("creep_forces"),
                Supersedes::RollingRadii => Some("rolling_radii"),
                Supersedes::RigidRail => Some("rigid_rail"),
            },
        )?;
        d.set_item("law", record.law)?;
        d.set_item("states", record.states)?;
        d.set_item("odd", record.odd)?;
        d.set_item("dissipates", record.dissipates)?;
        d.set_item("candidate", record.candidate)?;
        let diagnosis = &record.diagnosis;
        d.set_item("inspection", diagnosis.inspection)?;
        d.set_item("family", diagnosis.family)?;
        d.set_item("linear", diagnosis.linear)?;
        d.set_item("damper", diagnosis.damper)?;
        d.set_item("smaller_is_stronger", diagnosis.smaller_is_stronger)?;
        d.set_item("undetermined_at_rest", diagnosis.undetermined_at_rest)?;
        d.set_item("column", diagnosis.column)?;
        d.set_item("common", diagnosis.common)?;
        d.set_item("followed", diagnosis.followed)?;
        d.set_item("shapes", record.shapes.iter().map(|s| s.to_vec()).collect::<Vec<_>>())?;
        let params = PyList::empty(py);
        for p in record.params {
            let q = PyDict::new(py);
            q.set_item("key", p.key)?;
            q.set_item("symbol", p.symbol)?;
            q.set_item("unit", p.unit)?;
            q.set_item("default", p.default)?;
            q.set_item("minimum", p.minimum)?;
            q.set_item("maximum", p.maximum)?;
            q.set_item("times", p.times)?;
            q.set_item("origin", p.origin)?;
            q.set_item("role", role(p))?;
            q.set_item("optional", matches!(p.role, Role::Optional | Role::Run))?;
            params.append(q)?;
        }
        d.set_item("parameters", params)?;
        list.append(d)?;
    }
    Ok(list)
}

/// Creep forces T_x, T_y of a law where the linear law gives t_x, t_y, in which `spin` is of t_y.
#[pyfunction]
fn creep_forces(
    kind: &str,
    numbers: Vec<f64>,
    wheel_load: f64,
    creep_slopes: [f64; 2],
    linear: Vec<[f64; 3]>,
    speed: f64,
) -> PyResult<Vec<[f64; 2]>> {
    let law =
        Law::named(kind).filter(|law| law.record().kind == Kind::Creep && law.record().params.len() == numbers.len());
    let Some(law) = law else {
        return Err(PyValueError::new_err(format!("{kind} with {} numbers is no law of creep", numbers.len())));
    };
    let site = Site { wheel_load, creep_slopes, ..Site::default() };
    Ok(linear.into_iter().map(|[tx, ty, spin]| law.creep_of_one(&numbers, &site, [tx, ty, spin, speed])).collect())
}

/// Paths of the numbers that a kind of vehicle is assembled from, in their order.
#[pyfunction]
#[pyo3(signature = (kind, rig_input=None))]
fn parameters(kind: &str, rig_input: Option<&str>) -> PyResult<Vec<&'static str>> {
    Ok(VehicleKind::named(kind, rig_input).map_err(to_py_error)?.parameters().to_vec())
}

/// The instructions that the lanes run on here.
#[pyfunction]
fn simd() -> &'static str {
    railui_core::simd::level().name()
}

/// Run so many rounds of chains of arithmetic in registers, fused products or square roots; returns how many operations
/// that were, counted per lane.
#[pyfunction]
fn chains(py: Python<'_>, roots: bool, rounds: usize) -> u64 {
    py.detach(|| peak::chains(if roots { Links::Roots } else { Links::Fused }, rounds))
}

/// Hash of the sources that this kernel was built from.
#[pyfunction]
fn sources() -> &'static str {
    railui_core::SOURCES
}

type Matrix<'py> = PyReadonlyArray2<'py, f64>;

/// The vehicles of one call: rows of numbers, effect numbers, amounts.
#[derive(FromPyObject)]
struct Batch<'py> {
    numbers: Matrix<'py>,
    effects: Matrix<'py>,
    amounts: Matrix<'py>,
    speed_scale: Option<PyReadonlyArray1<'py, f64>>,
    initial: Option<Matrix<'py>>,
}

/// Borrowed slices of a batch, safe to carry to other threads.
struct Rows<'a> {
    count: usize,
    numbers: &'a [f64],
    effects: &'a [f64],
    amounts: &'a [f64],
    speed_scale: &'a [f64],
    initial: &'a [f64],
}

impl Batch<'_> {
    fn rows(&self) -> PyResult<Rows<'_>> {
        let count = self.numbers.shape()[0];
        let mut lengths = vec![self.effects.shape()[0], self.amounts.shape()[0]];
        lengths.extend(self.speed_scale.as_ref().map(|s| s.shape()[0]));
        lengths.extend(self.initial.as_ref().map(|s| s.shape()[0]));
        if count == 0 || lengths.iter().any(|n| *n != count) {
            return Err(PyValueError::new_err(format!(
                "a batch needs equal numbers of rows, at least one: {count}, {lengths:?}"
            )));
        }
        Ok(Rows {
            count,
            numbers: self.numbers.as_slice()?,
            effects: self.effects.as_slice()?,
            amounts: self.amounts.as_slice()?,
            speed_scale: self.speed_scale.as_ref().map_or(Ok(&[][..]), |s| s.as_slice())?,
            initial: self.initial.as_ref().map_or(Ok(&[][..]), |s| s.as_slice())?,
        })
    }
}

impl<'a> Rows<'a> {
    fn of(&self, structure: &'a Structure) -> VehicleBatch<'a> {
        VehicleBatch {
            structure,
            count: self.count,
            numbers: self.numbers,
            effects: self.effects,
            amounts: self.amounts,
            speed_scale: self.speed_scale,
            initial: self.initial,
        }
    }
}

/// sos, zi, pad, cut, weights, every
type FilterParts<'py> = (Matrix<'py>, Matrix<'py>, usize, usize, PyReadonlyArray1<'py, f64>, usize);

fn filter(parts: FilterParts<'_>) -> PyResult<Filter> {
    let (sos, zi, pad, cut, weights, every) = parts;
    Ok(Filter {
        sos: sos.as_slice()?.as_chunks().0.to_vec(),
        zi: zi.as_slice()?.as_chunks().0.to_vec(),
        pad,
        cut,
        weights: weights.as_slice()?.to_vec(),
        every,
    })
}

/// Request for the statistics of the rides of so many vehicles.
fn statistics_request<'a>(
    count: usize,
    channels: Vec<String>,
    wheelsets: usize,
    clearance: &'a PyReadonlyArray1<'_, f64>,
    cascades: &'a [PyReadonlyArray3<'_, f64>],
    block: usize,
) -> PyResult<StatisticsRequest<'a>> {
    if let Some(odd) = cascades.iter().map(|c| c.shape()).find(|shape| shape[0] != count || shape[2] != 6) {
        let what = format!("a cascade is [vehicle, section, 6]: {odd:?} given for {count} vehicles");
        return Err(PyValueError::new_err(what));
    }
    let cascades = cascades.iter().map(|c| c.as_slice()).collect::<Result<_, _>>()?;
    Ok(StatisticsRequest { channels, wheelsets, clearance: clearance.as_slice()?, cascades, block })
}

/// Vehicles of one structure: a kind, the effects placed on it, the measured forces of the coach.
#[pyclass(frozen)]
struct Vehicle {
    structure: Structure,
}

impl Vehicle {
    /// The course that an input table is, where it fits the vehicle.
    fn inputs<'a>(&self, table: &'a Matrix<'_>, steps: usize, dt: f64) -> PyResult<InputTable<'a>> {
        let inputs = InputTable::new(table.as_slice()?, table.shape()[1], steps, dt);
        inputs.check(self.structure.columns()).map_err(to_py_error)?;
        Ok(inputs)
    }
}

#[pymethods]
impl Vehicle {
    /// placed: (kind, location, number of the location or 0, count of numbers, abscissa of a curve); layout: JSON of
    /// `railui.core.Layout`, in the place of the kind
    #[new]
    #[pyo3(signature = (kind, placed, measured, layout=None, rig_input=None, line=false))]
    fn new(
        kind: &str,
        placed: Vec<(String, String, u8, usize, Option<String>)>,
        measured: Vec<String>,
        layout: Option<&str>,
        rig_input: Option<&str>,
        line: bool,
    ) -> PyResult<Self> {
        let kind = match layout {
            Some(text) => VehicleKind::Bodies(Layout::from_json(text).map_err(to_py_error)?),
            None => VehicleKind::named(kind, rig_input).map_err(to_py_error)?,
        };
        let placed = placed
            .into_iter()
            .map(|(kind, at, wheelset, count, against)| {
                let law = Law::named(&kind).ok_or(Error::Effect(kind))?;
                let law = against.map_or(Ok(law), |word| law.against(&word))?;
                Ok(Placed { law, at, wheelset, count })
            })
            .collect::<Result<Vec<_>, Error>>()
            .map_err(to_py_error)?;
        let structure = Structure { kind, measured, placed, line };
        structure.check().map_err(to_py_error)?;
        Ok(Vehicle { structure })
    }

    /// Series [vehicle, channel x sample] and the sample at which each diverged (-1: never).
    #[pyo3(signature = (batch, table, dt, steps, channels, filter_parts=None, jobs=1))]
    #[allow(clippy::too_many_arguments)]
    fn simulate<'py>(
        &self,
        py: Python<'py>,
        batch: Batch<'py>,
        table: Matrix<'py>,
        dt: f64,
        steps: usize,
        channels: Vec<String>,
        filter_parts: Option<FilterParts<'py>>,
        jobs: usize,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Vec<i64>)> {
        let rows = batch.rows()?;
        let vehicles = rows.of(&self.structure);
        let inputs = self.inputs(&table, steps, dt)?;
        let filter = filter_parts.map(filter).transpose()?;
        let work = |cancel: &AtomicBool| batch::simulate(&vehicles, &inputs, &channels, filter.as_ref(), cancel);
        let (series, diverged_at) = without_gil(py, jobs, vehicles.count * inputs.step_count(), work)?;
        Ok((PyArray1::from_vec(py, series), diverged_at.into_iter().map(|k| k.map_or(-1, |k| k as i64)).collect()))
    }

    /// Statistics of a ride: (e [vehicle x wheelset x 3], rms [vehicle x acceleration x cascade], blocks
    /// [vehicle x acceleration x block], diverged).
    #[pyo3(signature = (batch, table, dt, steps, channels, clearance, cascades, block, jobs=1, wheelsets=2))]
    #[allow(clippy::too_many_arguments, clippy::type_complexity)]
    fn score<'py>(
        &self,
        py: Python<'py>,
        batch: Batch<'py>,
        table: Matrix<'py>,
        dt: f64,
        steps: usize,
        channels: Vec<String>,
        clearance: PyReadonlyArray1<'py, f64>,
        cascades: Vec<PyReadonlyArray3<'py, f64>>,
        block: usize,
        jobs: usize,
        wheelsets: usize,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>, Vec<i64>)> {
        let rows = batch.rows()?;
        let vehicles = rows.of(&self.structure);
        let inputs = self.inputs(&table, steps, dt)?;
        let statistics_request = statistics_request(vehicles.count, channels, wheelsets, &clearance, &cascades, block)?;
        let work = |cancel: &AtomicBool| batch::score(&vehicles, &inputs, &statistics_request, cancel);
        let scores = without_gil(py, jobs, vehicles.count * inputs.step_count(), work)?;
        let flat = |x: Vec<Vec<f64>>| PyArray1::from_vec(py, x.concat());
        Ok((
            PyArray1::from_vec(py, scores.displacement.iter().flatten().flatten().copied().collect()),
            flat(scores.rms),
            flat(scores.blocks),
            scores.diverged.into_iter().map(|k| k.map_or(-1, |k| k as i64)).collect(),
        ))
    }

    /// The form that the rate of change takes, on a track without cross-level or with it.
    fn form(&self, batch: Batch<'_>, level: bool) -> PyResult<&'static str> {
        let rows = batch.rows()?;
        railui_core::batch::form(&rows.of(&self.structure), level).map_err(to_py_error)
    }

    /// The file of `rust_core/structures` by which the rows of these vehicles are compiled; None for a bogie and in the general form.
    fn structure_file(&self, batch: Batch<'_>) -> PyResult<Option<String>> {
        let rows = batch.rows()?;
        railui_core::batch::structure_file(&rows.of(&self.structure)).map_err(to_py_error)
    }

    /// RK4 steps per sample that each vehicle needs between two speeds, damped modes up to this abs(lambda) h.
    fn steps(
        &self,
        py: Python<'_>,
        batch: Batch<'_>,
        speeds: [f64; 2],
        dt: f64,
        damped: f64,
        limit: usize,
    ) -> PyResult<Vec<usize>> {
        let rows = batch.rows()?;
        let (structure, vehicles) = (&self.structure, rows.of(&self.structure));
        let each = |i| structure.steps(&vehicles.single(i), speeds, dt, damped, limit);
        let found: railui_core::error::Result<_> = py.detach(|| (0..vehicles.count).map(each).collect());
        found.map_err(to_py_error)
    }

    /// Eigenvalues (real, imaginary) of each linear vehicle, without its effects but with the coach's body, at a speed
    /// times its share.
    fn eigenvalues(&self, py: Python<'_>, batch: Batch<'_>, speed: f64) -> PyResult<Vec<Vec<(f64, f64)>>> {
        let rows = batch.rows()?;
        let (structure, vehicles) = (&self.structure, rows.of(&self.structure));
        let each = |i| {
            let one = vehicles.single(i);
            Ok(structure.assemble(&one)?.eigenvalues(speed * one.speed_scale))
        };
        let found: railui_core::error::Result<_> = py.detach(|| (0..vehicles.count).map(each).collect());
        found.map_err(to_py_error)
    }

    /// State matrix [vehicle, states, states] of each linear vehicle at a speed, row after row.
    fn state_matrix<'py>(&self, py: Python<'py>, batch: Batch<'_>, speed: f64) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let rows = batch.rows()?;
        let vehicles = rows.of(&self.structure);
        let mut all = Vec::new();
        for i in 0..vehicles.count {
            // column by column in memory: its transpose is row by row
            all.extend(
                self.structure
                    .assemble(&vehicles.single(i))
                    .map_err(to_py_error)?
                    .state_matrix(speed, &[])
                    .transpose()
                    .iter(),
            );
        }
        Ok(PyArray1::from_vec(py, all))
    }

    /// Derivatives [vehicle, state, state] of `rates` at rest.
    fn jacobians<'py>(
        &self,
        py: Python<'py>,
        batch: Batch<'_>,
        row: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let rows = batch.rows()?;
        let matrices = batch::jacobians(&rows.of(&self.structure), row.as_slice()?).map_err(to_py_error)?;
        Ok(PyArray1::from_vec(py, matrices))
    }

    /// Rate of change [vehicle, state] of each vehicle in its own state under one row of the input table.
    fn rates<'py>(
        &self,
        py: Python<'py>,
        batch: Batch<'_>,
        row: PyReadonlyArray1<'py, f64>,
        states: Matrix<'py>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let rows = batch.rows()?;
        let vehicles = rows.of(&self.structure);
        Ok(PyArray1::from_vec(py, batch::rates(&vehicles, row.as_slice()?, states.as_slice()?).map_err(to_py_error)?))
    }

    /// Names of the degrees of freedom: the first so many states, their rates the next.
    fn freedoms(&self, batch: Batch<'_>) -> PyResult<Vec<String>> {
        let vehicle = self.structure.assemble(&batch.rows()?.of(&self.structure).single(0)).map_err(to_py_error)?;
        Ok(vehicle.dofs.into_iter().map(Into::into).collect())
    }

    /// Names of the channels that the vehicle has.
    fn channels(&self, batch: Batch<'_>) -> PyResult<Vec<String>> {
        let vehicle = self.structure.assemble(&batch.rows()?.of(&self.structure).single(0)).map_err(to_py_error)?;
        Ok(vehicle.channel_names())
    }

    /// Linear spring and damper, (stiffness, damping), at every port of the first vehicle: {(place, wheelset): ...}.
    fn sites(&self, batch: Batch<'_>) -> PyResult<HashMap<(String, u8), (f64, f64)>> {
        let rows = batch.rows()?;
        let vehicle = self.structure.assemble(&rows.of(&self.structure).single(0)).map_err(to_py_error)?;
        Ok(vehicle.ports.iter().map(|p| ((p.at.to_string(), p.wheelset), (p.site.stiffness, p.site.damping))).collect())
    }

    /// Equilibrium of vehicles in a curve at the states of `batch.initial`: (forces on the degrees of freedom and rates of
    /// the effects' own states, results of the wheelsets).
    #[allow(clippy::type_complexity)]
    fn statics<'py>(
        &self,
        py: Python<'py>,
        batch: Batch<'py>,
        table: Matrix<'py>,
        curvature: PyReadonlyArray1<'py, f64>,
    ) -> PyResult<(Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<f64>>)> {
        let rows = batch.rows()?;
        let (forces, results) =
            batch::statics(&rows.of(&self.structure), table.as_slice()?, curvature.as_slice()?).map_err(to_py_error)?;
        Ok((PyArray1::from_vec(py, forces), PyArray1::from_vec(py, results)))
    }

    /// Distances [m] of the positions of each vehicle behind its first wheelset, the middle last, on a line with curves.
    fn positions(&self, batch: Batch<'_>) -> PyResult<Vec<Vec<f64>>> {
        let rows = batch.rows()?;
        let vehicles = rows.of(&self.structure);
        let each = |i| Ok(self.structure.assemble(&vehicles.single(i))?.positions);
        (0..vehicles.count).map(each).collect::<railui_core::error::Result<_>>().map_err(to_py_error)
    }

    /// Number of columns of the input table.
    fn columns(&self) -> usize {
        self.structure.columns()
    }

    /// Names and masses of the degrees of freedom of the first vehicle.
    fn bodies(&self, batch: Batch<'_>) -> PyResult<Vec<(String, f64)>> {
        let rows = batch.rows()?;
        let vehicle = self.structure.assemble(&rows.of(&self.structure).single(0)).map_err(to_py_error)?;
        Ok(vehicle.dofs.iter().map(|name| name.to_string()).zip(vehicle.mass.iter().copied()).collect())
    }

    /// Number of states of the vehicle, those of its effects last.
    fn states(&self, batch: Batch<'_>) -> PyResult<usize> {
        let rows = batch.rows()?;
        Ok(self.structure.group(&[rows.of(&self.structure).single(0)], &[]).map_err(to_py_error)?.states)
    }
}

#[pymodule]
fn _core(m: &Bound<'_, PyModule>) -> PyResult<()> {
    m.add("NoResultError", m.py().get_type::<NoResultError>())?;
    m.add_class::<Vehicle>()?;
    m.add_class::<series::Spline>()?;
    m.add_function(wrap_pyfunction!(series::passed, m)?)?;
    m.add_function(wrap_pyfunction!(catalogue, m)?)?;
    m.add_function(wrap_pyfunction!(creep_forces, m)?)?;
    m.add_function(wrap_pyfunction!(parameters, m)?)?;
    m.add_function(wrap_pyfunction!(simd, m)?)?;
    m.add_function(wrap_pyfunction!(chains, m)?)?;
    m.add_function(wrap_pyfunction!(sources, m)?)?;
    m.add("LINKAGE", LINKAGE)?;
    m.add("LANES", railui_core::simd::LANES)
}
