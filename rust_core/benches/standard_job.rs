//! The standard job without Python around it: nanoseconds per design and step, full and plain.
use railui_core::effects::Law;
use railui_core::integrate::Course;
use railui_core::lanes;
use railui_core::many::{Many, Weighing, score};
use railui_core::vehicle::{Placed, Structure};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

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

fn main() {
    let placed = vec![
        Placed { law: Law::CreepSaturation, at: "contact".into(), wheelset: 0, count: 1 },
        Placed { law: Law::FlangeContact, at: "contact".into(), wheelset: 0, count: 2 },
    ];
    let tables = [table(0.3), table(0.0)];
    let cancel = AtomicBool::new(false);
    let section = [0.2, 0.3, 0.1, 1.0, -0.5, 0.2];
    let cascades: Vec<Vec<f64>> = [4, 4, 3].iter().map(|n| section.repeat(n * DESIGNS)).collect();
    let clearance = vec![7e-3; DESIGNS];
    let jobs = [
        ("full", true, true, false),
        ("full, no comfort", true, false, false),
        ("linear", false, false, false),
        ("reduced", true, false, true),
    ];
    for (name, effects, comfort, reduced) in jobs {
        let course = Course::new(&tables[usize::from(reduced)], 14, 1, 0.0025);
        let structure = Structure {
            kind: "bogie".into(),
            measured: Vec::new(),
            layout: None,
            placed: if effects { placed.clone() } else { Vec::new() },
        };
        let numbers = bogies(reduced);
        let effect_numbers = if effects { [0.35, 7e-3, 14.6e6].repeat(DESIGNS) } else { Vec::new() };
        let amounts = vec![1.0; if effects { 2 * DESIGNS } else { 0 }];
        let many = Many {
            structure: &structure,
            count: DESIGNS,
            numbers: &numbers,
            effects: &effect_numbers,
            amounts: &amounts,
            speed_scale: &[],
            initial: &[],
        };
        let channels = ["e1", "e2", "ayf"];
        let channels = &channels[..if comfort {
            3
        } else if reduced {
            1
        } else {
            2
        }];
        let weighing = Weighing {
            wheelsets: 2,
            channels: channels.iter().map(|c| c.to_string()).collect(),
            clearance: &clearance,
            cascades: if comfort { cascades.iter().map(Vec::as_slice).collect() } else { Vec::new() },
            block: if comfort { 2000 } else { 0 },
        };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
        let best = (0..60)
            .map(|_| {
                let began = Instant::now();
                pool.install(|| score(&many, &course, &weighing, &cancel)).expect("a ride");
                began.elapsed().as_secs_f64()
            })
            .fold(f64::INFINITY, f64::min);
        println!("{} {name}: {:.1} ns per design-step", lanes::level().name(), best / (DESIGNS * SAMPLES) as f64 * 1e9);
    }
}
