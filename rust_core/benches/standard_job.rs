//! The standard job and its pieces without Python around them: `cargo bench --bench standard_job [piece]`.
//! An item is one design and step, or one sample of one channel and vehicle where channels are filtered.
use divan::Bencher;
use divan::counter::ItemsCount;
use railui_core::batch::{StatisticsRequest, VehicleBatch, rates, score};
use railui_core::effects::Law;
use railui_core::integrate::comparison::{Filter, filtered};
use railui_core::integrate::recorder::Series;
use railui_core::rate::input_table::InputTable;
use railui_core::simd::{LANES, level};
use railui_core::vehicle::kinds::VehicleKind;
use railui_core::vehicle::structure::{Placed, Structure};
use std::sync::atomic::AtomicBool;

const DESIGNS: usize = 16;
const SAMPLES: usize = 20_000;

/// A pseudo-track of a few waves: the arithmetic does not care which.
fn table(roll: f64) -> Vec<f64> {
    let mut table = Vec::with_capacity((2 * SAMPLES - 1) * 14);
    for i in 0..2 * SAMPLES - 1 {
        let s = 0.05 * i as f64;
        let wave = |s: f64| {
            let (mut y, mut dy) = (0.0, 0.0);
            for (k, a) in [(0.06, 3e-3), (0.21, 1e-3), (0.7, 3e-4)] {
                y += a * (k * s).sin();
                dy += a * k * (k * s).cos();
            }
            (y, dy)
        };
        let (lead, trail) = (wave(s), wave(s - 2.56));
        let row =
            [lead.0, lead.1, roll * lead.0, roll * lead.1, 0.0, trail.0, trail.1, roll * trail.0, roll * trail.1, 0.0];
        table.extend([s, 40.0]);
        table.extend(row);
        table.extend([0.0, 0.0]);
    }
    table
}

fn bogies(reduced: bool) -> Vec<f64> {
    let mut p = vec![2900.0, 3300.0, 1850.0, 1050.0, 120.0, 1.28, 0.75, 1.0, 0.46, 55e3, 3e6, 8e6, 0.0, 0.0, 3e4, 3e4];
    let (angle, roll, spin) = if reduced { (0.0, 0.0, 0.0) } else { (0.05, 0.05, 0.25) };
    for _ in 0..2 {
        p.extend([0.18, 130.0, 120.0, 8.0, angle, roll]);
    }
    p.extend([spin, 7e-3]);
    (0..DESIGNS)
        .flat_map(|d| {
            p.iter()
                .enumerate()
                .map(move |(i, x)| if i > 9 { x * (1.0 + 0.1 * ((d * 31 + i * 17) as f64).sin()) } else { *x })
                .collect::<Vec<_>>()
        })
        .collect()
}

/// Channels, effects and table of a ride of the standard job.
struct Job {
    reduced: bool,
    effects: &'static [(Law, &'static str, &'static [f64])],
    channels: &'static [&'static str],
    comfort: bool,
}

const SATURATION: (Law, &str, &[f64]) = (Law::CreepSaturation, "contact", &[0.35]);
const FLANGE: (Law, &str, &[f64]) = (Law::FlangeContact, "contact", &[7e-3, 14.6e6]);

fn job(name: &str) -> Job {
    let full = Job { reduced: false, effects: &[SATURATION, FLANGE], channels: &["e1", "e2", "ayf"], comfort: true };
    match name {
        "full" => full,
        "without comfort" => Job { channels: &["e1", "e2"], comfort: false, ..full },
        "without flanges" => Job { effects: &[SATURATION], ..full },
        "linear" => Job { effects: &[], channels: &["e1", "e2"], comfort: false, ..full },
        "reduced" => Job { reduced: true, effects: &[], channels: &["e1"], comfort: false },
        _ => unreachable!("{name} is no job"),
    }
}

/// The vehicles of a job, and what they need to live as long as they.
struct Vehicles {
    structure: Structure,
    numbers: Vec<f64>,
    effects: Vec<f64>,
    amounts: Vec<f64>,
}

impl Vehicles {
    fn new(job: &Job) -> Self {
        let placed = job.effects.iter().map(|(law, at, numbers)| Placed {
            law: *law,
            at: (*at).into(),
            wheelset: 0,
            count: numbers.len(),
        });
        let structure =
            Structure { kind: VehicleKind::Bogie, measured: Vec::new(), placed: placed.collect(), line: false };
        let effects: Vec<f64> = job.effects.iter().flat_map(|(_, _, numbers)| numbers.iter().copied()).collect();
        Self {
            structure,
            numbers: bogies(job.reduced),
            effects: effects.repeat(DESIGNS),
            amounts: vec![1.0; job.effects.len() * DESIGNS],
        }
    }

    fn vehicles(&self) -> VehicleBatch<'_> {
        VehicleBatch {
            structure: &self.structure,
            count: DESIGNS,
            numbers: &self.numbers,
            effects: &self.effects,
            amounts: &self.amounts,
            speed_scale: &[],
            initial: &[],
        }
    }
}

#[divan::bench(args = ["full", "without comfort", "without flanges", "linear", "reduced"])]
fn ride(bencher: Bencher<'_, '_>, name: &str) {
    let job = job(name);
    let vehicles = Vehicles::new(&job);
    let table = table(if job.reduced { 0.0 } else { 0.3 });
    let section = [0.2, 0.3, 0.1, 1.0, -0.5, 0.2];
    let cascades: Vec<Vec<f64>> = [4, 4, 3].iter().map(|n| section.repeat(n * DESIGNS)).collect();
    let clearance = vec![7e-3; DESIGNS];
    let statistics_request = StatisticsRequest {
        wheelsets: 2,
        channels: job.channels.iter().map(|c| c.to_string()).collect(),
        clearance: &clearance,
        cascades: if job.comfort { cascades.iter().map(Vec::as_slice).collect() } else { Vec::new() },
        block: if job.comfort { 2000 } else { 0 },
    };
    let inputs = InputTable::new(&table, 14, 1, 0.0025);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    let cancel = AtomicBool::new(false);
    bencher
        .counter(ItemsCount::new(DESIGNS * SAMPLES))
        .bench(|| pool.install(|| score(&vehicles.vehicles(), &inputs, &statistics_request, &cancel)).expect("a ride"));
}

/// The rates of all designs at one moment, with group and coefficients built anew: the cost of a single evaluation.
#[divan::bench]
fn rates_once(bencher: Bencher<'_, '_>) {
    let vehicles = Vehicles::new(&job("full"));
    let states = vec![1e-3; 12 * DESIGNS];
    let row = table(0.3)[..14].to_vec();
    bencher.counter(ItemsCount::new(DESIGNS)).bench(|| rates(&vehicles.vehicles(), &row, &states).expect("rates"));
}

/// Channels of a comparison: forwards and backwards through four sections, every fourth sample used.
#[divan::bench]
fn filter(bencher: Bencher<'_, '_>) {
    let mut series = Series::new(1, SAMPLES, LANES);
    for (i, sample) in series.channel_mut(0).chunks_exact_mut(LANES).enumerate() {
        for (l, x) in sample.iter_mut().enumerate() {
            *x = (0.01 * (i * (l + 1)) as f64).sin();
        }
    }
    let mut out = vec![0.0; LANES * SAMPLES.div_ceil(4)];
    let filter = Filter {
        sos: vec![[0.2, 0.3, 0.1, 1.0, -0.5, 0.2]; 4],
        zi: vec![[0.1, 0.05]; 4],
        pad: 300,
        cut: 0,
        weights: vec![1.0],
        every: 4,
    };
    bencher.counter(ItemsCount::new(LANES * SAMPLES)).bench_local(|| filtered(&series, LANES, &filter, &mut out));
}

fn main() {
    println!("SIMD level {}", level().name());
    divan::main();
}
