//! Every SIMD level gives the same ride: this processor's best against the same test run again without vectors.
use railui_core::batch::{StatisticsRequest, VehicleBatch, score};
use railui_core::effects::Law;
use railui_core::rate::input_table::InputTable;
use railui_core::simd::level;
use railui_core::vehicle::kinds::VehicleKind;
use railui_core::vehicle::structure::{Placed, Structure};
use std::process::Command;
use std::sync::atomic::AtomicBool;

const SAMPLES: usize = 2000;
/// Sixteen side by side, and three that ride in narrower registers.
const DESIGNS: usize = 19;
const ALONE: &str = "RAILUI_LEVELS_ALONE";
const DIGITS: &str = "digits:";

/// A line of three waves with cross-level, half steps apart; the trailing wheelset follows 2.56 m behind.
fn table() -> Vec<f64> {
    let wave = |s: f64| {
        let waves = [(0.06, 6e-3), (0.21, 2e-3), (0.7, 6e-4)];
        let y: f64 = waves.iter().map(|(k, a)| a * (k * s).sin()).sum();
        let slope: f64 = waves.iter().map(|(k, a)| a * k * (k * s).cos()).sum();
        [y, slope, 0.3 * y, 0.3 * slope, 0.0]
    };
    (0..2 * SAMPLES - 1)
        .map(|i| 0.05 * i as f64)
        .flat_map(|s| [vec![s, 40.0], wave(s).to_vec(), wave(s - 2.56).to_vec(), vec![0.0, 0.0]].concat())
        .collect()
}

fn bogie(design: usize) -> Vec<f64> {
    let mut p = vec![2900.0, 3300.0, 1850.0, 1050.0, 120.0, 1.28, 0.75, 1.0, 0.46, 55e3, 3e6, 8e6, 0.0, 0.0, 3e4, 3e4];
    p.extend([0.18, 130.0, 120.0, 8.0, 0.05, 0.05].repeat(2));
    p.extend([0.25, 7e-3]);
    p.iter().enumerate().map(|(i, x)| x * (1.0 + 0.05 * ((design * 31 + i * 17) as f64).sin())).collect()
}

/// All sums of a ride with sliding wheels and flange contact, weighted accelerations and their blocks among them.
fn digits() -> Vec<f64> {
    let placed = |law, count| Placed { law, at: "contact".into(), wheelset: 0, count };
    let structure = Structure {
        kind: VehicleKind::Bogie,
        measured: Vec::new(),
        placed: vec![placed(Law::CreepSaturation, 1), placed(Law::FlangeContact, 2)],
        line: false,
    };
    let numbers: Vec<f64> = (0..DESIGNS).flat_map(bogie).collect();
    let (effects, amounts) = ([0.2, 3e-3, 14.6e6].repeat(DESIGNS), [1.0; 2 * DESIGNS]);
    let vehicles = VehicleBatch {
        structure: &structure,
        count: DESIGNS,
        numbers: &numbers,
        effects: &effects,
        amounts: &amounts,
        speed_scale: &[],
        initial: &[],
    };
    let table = table();
    let sections = [0.2, 0.3, 0.1, 1.0, -0.5, 0.2].repeat(3 * DESIGNS);
    let statistics_request = StatisticsRequest {
        channels: ["e1", "e2", "ayf"].map(String::from).to_vec(),
        wheelsets: 2,
        clearance: &[3e-3; DESIGNS],
        cascades: vec![&sections],
        block: 500,
    };
    let inputs = InputTable::new(&table, 14, 1, 0.0025);
    let found = score(&vehicles, &inputs, &statistics_request, &AtomicBool::new(false)).expect("a ride");
    assert!(found.diverged.iter().all(Option::is_none));
    let sums = found.displacement.concat().concat();
    [sums, found.rms.concat(), found.blocks.concat()].concat()
}

#[test]
fn the_best_level_rides_as_without_vectors() {
    let here = digits();
    if std::env::var_os(ALONE).is_some() {
        println!("\n{DIGITS}{here:?}");
        return;
    }
    let done = Command::new(std::env::current_exe().expect("this test"))
        .args(["--nocapture", "--exact", "the_best_level_rides_as_without_vectors"])
        .envs([("RAILUI_SIMD", "portable"), (ALONE, "1")])
        .output()
        .expect("the test once more");
    let results = String::from_utf8(done.stdout).expect("text");
    let line = results.lines().find_map(|line| line.strip_prefix(DIGITS)).expect("its digits");
    let there: Vec<f64> = line.trim_matches(['[', ']']).split(", ").map(|x| x.parse().expect("a number")).collect();
    assert_eq!(here.len(), there.len());
    for (a, b) in here.iter().zip(&there) {
        assert!((a - b).abs() <= 1e-9 * b.abs().max(1e-6), "{}: {a:e} against {b:e}", level().name());
    }
    assert!(here.iter().any(|x| *x > 0.0));
    println!("{} as portable", level().name());
}
