//! The fused bogie and the fused vehicle of bodies and elements are the general ones, lane by lane.
use railui_core::effects::Law;
use railui_core::integrate::recorder::{Recorder, Series};
use railui_core::integrate::run::run;
use railui_core::rate::forms::Choice;
use railui_core::rate::input_table::InputTable;
use railui_core::simd::{LANES, Level, level};
use railui_core::vehicle::bodies::{Acts, Body, Joint, Layout, Number, Point, Way, Wheels};
use railui_core::vehicle::group::Group;
use railui_core::vehicle::kinds::VehicleKind;
use railui_core::vehicle::structure::{Placed, Single, Structure};
use std::sync::atomic::AtomicBool;

const SAMPLES: usize = 1500;

/// Distances of the wheelsets of a bogie and of a coach behind the first [m].
const BOGIE: [f64; 2] = [0.0, 2.56];
const COACH: [f64; 4] = [0.0, 2.56, 19.0, 21.56];

/// A wavy line with cross-level, passed at a speed that varies between samples by wheelsets so far behind the first [m].
fn table(behind: &[f64], varying: f64, roll: f64) -> Vec<f64> {
    let mut table = Vec::new();
    for i in 0..2 * SAMPLES - 1 {
        let s = 0.05 * i as f64;
        let speed = 40.0 + varying * (0.03 * s).sin();
        let wave = |s: f64| [4e-3 * (0.5 * s).sin(), 2e-3 * (0.5 * s).cos(), roll * s.cos(), -roll * s.sin(), 0.0];
        table.extend([s, speed]);
        behind.iter().for_each(|behind| table.extend(wave(s - behind)));
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

/// Amounts of every effect, lane by lane: 1, or from 0 to 1 where lanes differ.
fn amounts(effects: usize, scale: f64) -> Vec<Vec<f64>> {
    let amount = |lane: usize| if scale == 0.0 { 1.0 } else { lane as f64 / (LANES - 1) as f64 };
    (0..LANES).map(|lane| vec![amount(lane); effects]).collect()
}

/// Largest difference of each channel over its largest value, fused against general.
fn differences(placed: Vec<Placed>, effects: &[f64], varying: f64, scale: f64, reduced: bool) -> Vec<f64> {
    let amounts = amounts(placed.len(), scale);
    let structure = Structure { kind: VehicleKind::Bogie, measured: Vec::new(), placed, line: false };
    let numbers: Vec<_> = (0..LANES).map(|lane| bogie(lane, reduced)).collect();
    let singles: Vec<_> = (0..LANES)
        .map(|l| Single { numbers: &numbers[l], effects, amounts: &amounts[l], speed_scale: 1.0 - scale * l as f64 })
        .collect();
    let channels = ["e1", "psi2", "ay1", "ayf", "rf"].map(String::from);
    let fused = structure.group(&singles, &channels).expect("a group");
    assert!(fused.suspension.is_some() || fused.contacts.is_some(), "nothing was fused");
    let mut general = fused.clone();
    (general.plain, general.suspension, general.contacts) = (None, None, None);
    apart(&fused, &general, &table(&BOGIE, varying, if reduced { 0.0 } else { 2e-3 }))
}

/// Largest difference of each channel over its largest value, along a table.
fn apart(fused: &Group, general: &Group, table: &[f64]) -> Vec<f64> {
    let inputs = InputTable::new(table, fused.columns, 1, 0.0025);
    let channels = &fused.readings;
    let [one, other] = [fused, general].map(|group| {
        let mut series = Series::new(channels.len(), SAMPLES, LANES);
        let diverged_at =
            run(group, &inputs, &[], LANES, Recorder::Series(&mut series), &AtomicBool::new(false)).expect("a run");
        assert!(diverged_at.iter().all(Option::is_none), "{diverged_at:?}");
        series
    });
    let largest = |lanes: &mut dyn Iterator<Item = f64>| lanes.fold(0.0, f64::max);
    (0..channels.len())
        .map(|c| {
            let [one, other] = [&one, &other].map(|series| series.channels().nth(c).expect("a channel"));
            let size = largest(&mut other.iter().map(|x| x.abs()));
            assert!(size > 0.0);
            largest(&mut one.iter().zip(other).map(|(a, b)| (a - b).abs())) / size
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
    let any =
        || vec![placed(Law::Polach, 1, 5), placed(Law::NonlinearConicity, 2, 1), at("frame", Law::SteadyForce, 1)];
    let cases: [Case; 12] = [
        ("a body above the frame", vec![at("secondary_lateral", Law::CoachMode, 3)], &[1.5e4, 2e5, 3e4], 5.0, 0.01),
        ("any laws at the contacts", any(), &[0.3, 0.8, 0.4, 0.4, 0.6, 2e4, 500.0], 5.0, 0.01),
        ("a rail that yields", vec![at("track", Law::RailFlexibility, 2)], &[2e7, 2e5], 5.0, 0.0),
        ("friction in a linear bogie", vec![at("secondary_lateral", Law::DryFriction, 2)], &[3e3, 5e-3], 5.0, 0.0),
        ("play and hysteresis", suspended(), &[0.2, 3e-3, 14.6e6, 3e-4, 2e6, 1e3], 5.0, 0.01),
        ("linear", vec![], &[], 0.0, 0.0),
        ("saturation and flange", both(), &[0.35, 3e-3, 14.6e6], 0.0, 0.0),
        ("full sliding", both(), &[0.04, 5e-3, 14.6e6], 0.0, 0.0),
        ("one wheelset each", vec![placed(creep, 1, 1), placed(flange, 2, 2)], &[0.2, 3e-3, 14.6e6], 0.0, 0.0),
        ("varying speed", both(), &[0.2, 3e-3, 14.6e6], 10.0, 0.0),
        ("lanes that slide by a share", both(), &[0.04, 5e-3, 14.6e6], 5.0, 0.01),
        ("lanes of their own speed and share", both(), &[0.2, 3e-3, 14.6e6], 5.0, 0.01),
    ];
    for (name, placed, effects, varying, scale) in cases {
        for reduced in [false, true] {
            let found = differences(placed.clone(), effects, varying, scale, reduced);
            assert!(found.iter().all(|d| *d < 1e-12), "{name}, reduced {reduced}: {found:?}");
        }
    }
}

/// A body on one bogie that rolls, with primary dampers, a stop and a damper behind a spring; lanes differ by 10 %.
fn built(lane: usize) -> (Layout, Vec<f64>) {
    let mut numbers = Vec::new();
    let mut next = |x: f64| -> Number {
        numbers.push(x * (1.0 + 0.1 * ((lane * 31 + numbers.len() * 17) as f64).sin()));
        vec![(1.0, numbers.len() - 1)]
    };
    let mut layout = Layout::default();
    let mut body = |name: &str, number, [mass, yaw, roll, x, height]: [f64; 5], wheels: Option<Wheels>| {
        let (mass, yaw_inertia) = (next(mass), Some(next(yaw)));
        let roll_inertia = wheels.is_none().then(|| next(roll));
        let (x, height, family) = (next(x), next(height), name.into());
        let name = format!("{name}_{number}");
        layout.bodies.push(Body { name, family, number, mass, yaw_inertia, roll_inertia, x, height, wheels });
    };
    body("body", 0, [16e3, 5e5, 28e3, 0.1, 1.8], None);
    body("frame", 0, [2615.0, 3067.0, 1722.0, 0.05, 0.6], None);
    // both wheelsets have the same numbers: those at the end
    let at = |k: usize| -> Number { vec![(1.0, 100 + k)] };
    let wheels = || Wheels {
        spin_inertia: at(0),
        half_gauge: at(1),
        rolling_radius: at(2),
        wheel_load: at(3),
        contact: [4, 5, 6, 7, 8, 9].map(at),
        spin_creep: at(10),
        roller_radius: Vec::new(),
    };
    body("wheelset", 1, [1813.0, 1120.0, 0.0, 1.28, 0.46], Some(wheels()));
    body("wheelset", 2, [1813.0, 1120.0, 0.0, -1.28, 0.46], Some(wheels()));
    for (number, bodies) in [(1, [2, 1]), (2, [3, 1]), (0, [1, 0])] {
        let x = [0.0, 1.28, -1.28][number as usize];
        let points: [Point; 2] =
            [0, 1].map(|_| [vec![], vec![], vec![]]).map(|_: Point| [next(x), next(1.0), next(0.7)]);
        let stiff = if number > 0 { 3e6 } else { 2e5 };
        let mut terms = vec![
            (Way::Lateral, Acts::Spring(next(stiff))),
            (Way::Longitudinal, Acts::Spring(next(2.0 * stiff))),
            (Way::Vertical, Acts::Spring(next(stiff))),
            (Way::Vertical, Acts::Damper(next(1e4))),
        ];
        if number == 0 {
            terms.push((Way::Lateral, Acts::Stop([next(2e-3), next(1e6)])));
            terms.push((Way::Lateral, Acts::Series([next(4e6), next(3e4), vec![]])));
        }
        let (name, static_load) = (if number > 0 { "primary" } else { "secondary" }.into(), next(4e4));
        let bodies = bodies.map(Some);
        layout.joints.push(Joint { name, number, bodies, points, mirrored: true, terms, static_load });
    }
    let contact = [112.0, 0.75, 0.46, 54e3, 0.18, 130.0, 120.0, 8.0, 0.05, 0.05, 0.25];
    assert!(numbers.len() < 100);
    numbers.resize(100, 1.0);
    numbers.extend(contact.iter().enumerate().map(|(i, x)| x * (1.0 + 0.1 * ((lane * 13 + i * 7) as f64).sin())));
    layout.numbers = numbers.len();
    (layout, numbers)
}

/// A body on two bogies with anti-roll bars, dampers and stops; lanes differ by 10 %, the second secondary spring from the
/// first by `unlike`, and the primary suspension damps laterally if asked.
fn carried(lane: usize, unlike: f64, damped: bool) -> (Layout, Vec<f64>) {
    let mut numbers = Vec::new();
    let mut next = |x: f64| -> Number {
        numbers.push(x * (1.0 + 0.1 * ((lane * 31 + numbers.len() * 17) as f64).sin()));
        vec![(1.0, numbers.len() - 1)]
    };
    let mut layout = Layout::default();
    let [centres, base] = [9.5, 1.28].map(&mut next);
    let sides = |a: f64, b: f64| -> Number { vec![(a, centres[0].1), (b, base[0].1)] };
    let contact = [0.18, 130.0, 120.0, 8.0, 0.05, 0.05].map(&mut next);
    let [spin_inertia, half_gauge, rolling_radius, wheel_load, spin_creep] =
        [112.0, 0.75, 0.46, 54e3, 0.25].map(&mut next);
    let wheels =
        Wheels { spin_inertia, half_gauge, rolling_radius, wheel_load, contact, spin_creep, roller_radius: Vec::new() };
    let mut family = |name: &str, places: &[[f64; 2]], [mass, yaw, roll, height]: [f64; 4], wheels: Option<&Wheels>| {
        let (mass, yaw_inertia, roll, height) = (next(mass), Some(next(yaw)), next(roll), next(height));
        for (i, [a, b]) in places.iter().enumerate() {
            let (name, family, number) = (format!("{name}_{}", i + 1), name.into(), i as u8 + 1);
            let (mass, yaw_inertia, height) = (mass.clone(), yaw_inertia.clone(), height.clone());
            let (x, wheels, roll_inertia) = (sides(*a, *b), wheels.cloned(), wheels.is_none().then(|| roll.clone()));
            layout.bodies.push(Body { name, family, number, mass, yaw_inertia, roll_inertia, x, height, wheels });
        }
    };
    family("body", &[[0.0, 0.0]], [32e3, 1.97e6, 56.8e3, 1.8], None);
    family("frame", &[[1.0, 0.0], [-1.0, 0.0]], [2615.0, 3067.0, 1722.0, 0.6], None);
    let axles = [[1.0, 1.0], [1.0, -1.0], [-1.0, 1.0], [-1.0, -1.0]];
    family("wheelset", &axles, [1813.0, 1120.0, 0.0, 0.46], Some(&wheels));
    let [y, low, high, load] = [1.0, 0.46, 0.83, 4e4].map(&mut next);
    let [across, along, upright, damping, rolling, gap, stop] = [3e6, 8e6, 1e6, 1e4, 9e5, 2e-3, 1e6].map(&mut next);
    let (soft, softer) = (next(2e5), next(2e5));
    for (i, [a, b]) in axles.into_iter().chain([[1.0, 0.0], [-1.0, 0.0]]).enumerate() {
        let (bodies, number) = if i < 4 { ([3 + i, 1 + i / 2], i + 1) } else { ([i - 3, 0], i - 3) };
        let height = if i < 4 { &low } else { &high };
        let points = [0, 1].map(|_| [sides(a, b), y.clone(), height.clone()]);
        let mut terms = vec![(Way::Vertical, Acts::Damper(damping.clone()))];
        if i < 4 {
            terms.push((Way::Lateral, Acts::Spring(across.clone())));
            terms.push((Way::Longitudinal, Acts::Spring(along.clone())));
            terms.push((Way::Vertical, Acts::Spring(upright.clone())));
            if damped {
                terms.push((Way::Lateral, Acts::Damper(damping.clone())));
            }
        } else {
            let more = if i == 5 { (unlike, softer[0].1) } else { (0.0, softer[0].1) };
            terms.push((Way::Lateral, Acts::Spring(vec![soft[0], more])));
            terms.push((Way::Lateral, Acts::Damper(damping.clone())));
            terms.push((Way::Longitudinal, Acts::Damper(damping.clone())));
            terms.push((Way::Roll, Acts::Spring(rolling.clone())));
            terms.push((Way::Lateral, Acts::Stop([gap.clone(), stop.clone()])));
        }
        let (name, number) = (if i < 4 { "primary" } else { "secondary" }.into(), number as u8);
        let (bodies, static_load) = (bodies.map(Some), load.clone());
        layout.joints.push(Joint { name, number, bodies, points, mirrored: true, terms, static_load });
    }
    layout.numbers = numbers.len();
    (layout, numbers)
}

/// Sixteen vehicles of bodies whose contacts are fused, lanes that differ in speed by `scale` and in their share of the
/// effects, and the same in the general form.
fn fused_and_general(
    structure: &Structure,
    numbers: &[Vec<f64>],
    effects: &[f64],
    channels: &[&str],
    scale: f64,
) -> [Group; 2] {
    let amounts = amounts(structure.placed.len(), scale);
    let singles: Vec<_> = (0..LANES)
        .map(|l| Single { numbers: &numbers[l], effects, amounts: &amounts[l], speed_scale: 1.0 - scale * l as f64 })
        .collect();
    let channels: Vec<_> = channels.iter().copied().map(String::from).collect();
    let fused = structure.group(&singles, &channels).expect("a group");
    assert!(fused.contacts.is_some(), "nothing was fused");
    let mut general = fused.clone();
    general.contacts = None;
    [fused, general]
}

#[test]
fn a_coach_is_the_general_vehicle_lane_by_lane_with_bogies_alike_or_not() {
    let both = || vec![placed(Law::CreepSaturation, 0, 1), placed(Law::FlangeContact, 0, 2)];
    let standard = &[0.2, 3e-3, 14.6e6];
    for (unlike, damped, some, effects, scale) in [
        (0.0, false, vec![], &[][..], 0.01),
        (0.0, false, both(), standard, 0.0),
        (0.0, false, both(), standard, 0.01),
        (0.5, false, both(), standard, 0.01),
        (0.0, true, both(), standard, 0.01),
    ] {
        let kind = VehicleKind::Bodies(carried(0, unlike, damped).0);
        let numbers: Vec<_> = (0..LANES).map(|lane| carried(lane, unlike, damped).1).collect();
        let structure = Structure { kind, measured: vec![], placed: some, line: false };
        let channels = ["e1", "e4", "psi3", "ay2", "y.body_1", "psi.body_1", "phi.frame_2"];
        let [fused, general] = fused_and_general(&structure, &numbers, effects, &channels, scale);
        // known structures are compiled for saturations that act in full, not by a share
        let is_known = unlike == 0.0 && !damped && (effects.is_empty() || scale == 0.0);
        let form = match (level(), is_known) {
            (Level::Portable, _) => "general",
            (_, true) => "coach",
            (_, false) => "bodies",
        };
        assert_eq!(Choice::of(&fused, false).name(), form, "{unlike} {damped} {scale}");
        let found = apart(&fused, &general, &table(&COACH, 8.0, 2e-3));
        assert!(found.iter().all(|d| *d < 1e-12), "{unlike} {damped} {effects:?} {scale}: {found:?}");
    }
}

#[test]
fn the_fused_vehicle_of_bodies_is_the_general_one_lane_by_lane() {
    let (layout, _) = built(0);
    let numbers: Vec<_> = (0..LANES).map(|lane| built(lane).1).collect();
    let both = vec![placed(Law::CreepSaturation, 0, 1), placed(Law::FlangeContact, 0, 2)];
    let plain: (Vec<Placed>, &[f64]) = (Vec::new(), &[]);
    for (some, effects) in [plain, (both.clone(), &[0.35, 3e-3, 14.6e6]), (both, &[0.04, 5e-3, 14.6e6])] {
        let kind = VehicleKind::Bodies(layout.clone());
        let structure = Structure { kind, measured: vec![], placed: some, line: false };
        let channels = ["e1", "e2", "psi2", "ay1", "ayf", "y.body_0", "phi.frame_0"];
        let [fused, general] = fused_and_general(&structure, &numbers, effects, &channels, 0.01);
        let found = apart(&fused, &general, &table(&BOGIE, 8.0, 2e-3));
        assert!(found.iter().all(|d| *d < 1e-12), "{effects:?}: {found:?}");
    }
}
