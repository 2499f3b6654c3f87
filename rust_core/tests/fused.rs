//! The fused bogie is the general one, lane by lane.
use railui_core::effects::Law;
use railui_core::integrate::{Course, Series, run};
use railui_core::lanes::LANES;
use railui_core::vehicle::{Placed, Single, Structure};
use std::sync::atomic::AtomicBool;

const SAMPLES: usize = 1500;

/// A wavy line with cross-level, passed at a speed that varies between samples.
fn table(varying: f64, roll: f64) -> Vec<f64> {
    let mut table = Vec::new();
    for i in 0..2 * SAMPLES - 1 {
        let s = 0.05 * i as f64;
        let speed = 40.0 + varying * (0.03 * s).sin();
        let wave = |s: f64| [4e-3 * (0.5 * s).sin(), 2e-3 * (0.5 * s).cos(), roll * s.cos(), -roll * s.sin(), 0.0];
        table.extend([s, speed]);
        table.extend(wave(s));
        table.extend(wave(s - 2.56));
        table.extend([0.0, 0.0]);
    }
    table
}

/// Reduced: without contact angle, roll and spin creep.
fn bogie(lane: usize, reduced: bool) -> Vec<f64> {
    let mut p = vec![2900.0, 3300.0, 1850.0, 1050.0, 120.0, 1.28, 0.75, 1.0, 0.46, 55e3, 3e6, 8e6, 2e5, 2e5, 3e4, 3e4];
    for _ in 0..2 {
        let angle = if reduced { 0.0 } else { 0.05 };
        p.extend([0.18, 130.0, 120.0, 8.0, angle, angle]);
    }
    p.extend([if reduced { 0.0 } else { 0.25 }, 7e-3]);
    p.iter().enumerate().map(|(i, x)| x * (1.0 + 0.1 * ((lane * 31 + i * 17) as f64).sin())).collect()
}

/// Largest difference of each channel over its largest value, fused against general.
fn differences(placed: Vec<Placed>, effects: &[f64], varying: f64, scale: f64, reduced: bool) -> Vec<f64> {
    let structure = Structure { kind: "bogie".into(), measured: Vec::new(), placed, layout: None };
    let numbers: Vec<_> = (0..LANES).map(|lane| bogie(lane, reduced)).collect();
    let amounts = vec![1.0; structure.placed.len()];
    let singles: Vec<_> = (0..LANES)
        .map(|l| Single { numbers: &numbers[l], effects, amounts: &amounts, speed_scale: 1.0 - scale * l as f64 })
        .collect();
    let channels = ["e1", "psi2", "ay1", "ayf", "rf"].map(String::from);
    let fused = structure.group(&singles, &channels).expect("a group");
    assert!(fused.plain.is_some(), "nothing was fused");
    let mut general = fused.clone();
    general.plain = None;
    let table = table(varying, if reduced { 0.0 } else { 2e-3 });
    let course = Course::new(&table, 14, 1, 0.0025);
    let [one, other] = [&fused, &general].map(|group| {
        let mut series = Series::new(group, SAMPLES);
        let lost = run(group, &course, &[], LANES, &mut series, &AtomicBool::new(false)).expect("a run");
        assert!(lost.iter().all(Option::is_none), "{lost:?}");
        series.lanes
    });
    let part = |c: usize| c * SAMPLES..(c + 1) * SAMPLES;
    let largest = |lanes: &mut dyn Iterator<Item = f64>| lanes.fold(0.0, f64::max);
    (0..channels.len())
        .map(|c| {
            let size = largest(&mut other[part(c)].iter().flat_map(|x| x.0.map(f64::abs)));
            let pairs = one[part(c)].iter().zip(&other[part(c)]);
            assert!(size > 0.0);
            largest(&mut pairs.flat_map(|(a, b)| (0..LANES).map(move |l| (a.0[l] - b.0[l]).abs()))) / size
        })
        .collect()
}

fn placed(law: Law, wheelset: u8, count: usize) -> Placed {
    Placed { law, at: "contact".into(), wheelset, count }
}

fn at(at: &str, law: Law, count: usize) -> Placed {
    Placed { law, at: at.into(), wheelset: 0, count }
}

#[test]
fn the_fused_bogie_is_the_general_one_lane_by_lane() {
    let (creep, flange) = (Law::CreepSaturation, Law::FlangeContact);
    let both = || vec![placed(creep, 0, 1), placed(flange, 0, 2)];
    type Case = (&'static str, Vec<Placed>, &'static [f64], f64, f64);
    let suspended = || {
        let mut some = both();
        some.push(at("primary_lateral", Law::FreePlay, 1));
        some.push(at("secondary_yaw", Law::Hysteresis, 2));
        some
    };
    let cases: [Case; 8] = [
        ("friction in a linear bogie", vec![at("secondary_lateral", Law::DryFriction, 2)], &[3e3, 5e-3], 5.0, 0.0),
        ("play and hysteresis", suspended(), &[0.2, 3e-3, 14.6e6, 3e-4, 2e6, 1e3], 5.0, 0.01),
        ("linear", vec![], &[], 0.0, 0.0),
        ("saturation and flange", both(), &[0.35, 3e-3, 14.6e6], 0.0, 0.0),
        ("full sliding", both(), &[0.04, 5e-3, 14.6e6], 0.0, 0.0),
        ("one wheelset each", vec![placed(creep, 1, 1), placed(flange, 2, 2)], &[0.2, 3e-3, 14.6e6], 0.0, 0.0),
        ("varying speed", both(), &[0.2, 3e-3, 14.6e6], 10.0, 0.0),
        ("lanes of their own speed", both(), &[0.2, 3e-3, 14.6e6], 5.0, 0.01),
    ];
    for (name, placed, effects, varying, scale) in cases {
        for reduced in [false, true] {
            let found = differences(placed.clone(), effects, varying, scale, reduced);
            assert!(found.iter().all(|d| *d < 1e-12), "{name}, reduced {reduced}: {found:?}");
        }
    }
}
