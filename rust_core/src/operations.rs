//! Operations of a step of a plain bogie, counted by running its rate and sums on a lane that counts. Compiled for tests
//! only: they hold the table `railui/bench/operations.csv`, from which `railui bench` computes the share of the peak.
use crate::batch::{StatisticsRequest, VehicleBatch};
use crate::effects::Law;
use crate::integrate::ride_statistics::RideSums;
use crate::integrate::sample::RideAccumulator;
use crate::rate::input_table::InputTable;
use crate::simd::{Counted, Counts, Dual, Lanes, Part, STATES, counting};
use crate::vehicle::group::Group;
use crate::vehicle::kinds::VehicleKind;
use crate::vehicle::plain_bogie::PlainBogie;
use crate::vehicle::structure::{Placed, Structure};

/// RK4 per degree of freedom: six products that join a sum on the way to the states of the slopes, three at the end, and
/// four sums of slopes there.
const RK4: Counts = Counts { fused: 9, sums: 4, ..Counts::NONE };

/// Rows of the input table at which the slopes of a step are evaluated.
const SLOPES: [usize; 4] = [0, 1, 1, 2];

/// Operations of a step and its sample per lane, at the beginning of an input table, from rest, where no wheel slides.
/// None for vehicles whose rate is not that of a plain bogie.
fn count_step(group: &Group, inputs: &InputTable<'_>, sums: &RideSums) -> Option<Counts> {
    let bogie = group.fully_plain()?;
    let counts = match (bogie.laws, bogie.spin || !inputs.level) {
        (true, true) => rates_and_sample::<true, true>(bogie, group, inputs, sums),
        (false, true) => rates_and_sample::<false, true>(bogie, group, inputs, sums),
        (_, false) => rates_and_sample::<true, false>(bogie, group, inputs, sums),
    };
    Some(counts.and(group.dofs as u64, RK4))
}

/// Operations of the four rates of a step and of the sample at its beginning.
fn rates_and_sample<const LAWS: bool, const SPIN: bool>(
    bogie: &PlainBogie<Lanes>,
    group: &Group,
    inputs: &InputTable<'_>,
    sums: &RideSums,
) -> Counts {
    let part = bogie.part::<Counted, SPIN>(0);
    let mut at = part.at_speed(inputs.row(0)[1]);
    let mut growing = RideAccumulator::new(sums, group, 0);
    let (x, mut dx) = ([Counted::zero(); STATES], [Counted::zero(); STATES]);
    part.rate::<LAWS, true, SPIN>(0, inputs.row(0), &mut at, &x, &mut dx); // the previous step has prepared its row
    counting(|| {
        for index in SLOPES {
            part.rate::<LAWS, true, SPIN>(index, inputs.row(index), &mut at, &x, &mut dx);
        }
        growing.sample(inputs.row(0), &x, &dx);
    })
}

/// Operations of the four rates of a step on parts of a kind.
fn rates_on<P: Part>(bogie: &PlainBogie<Lanes>, inputs: &InputTable<'_>) -> Counts {
    let part = bogie.part::<P, true>(0);
    let mut at = part.at_speed(inputs.row(0)[1]);
    let (x, mut dx) = ([P::zero(); STATES], [P::zero(); STATES]);
    counting(|| {
        for index in SLOPES {
            part.rate::<true, true, true>(index, inputs.row(index), &mut at, &x, &mut dx);
        }
    })
}

/// Operations of a step of a job of `railui bench`.
fn count_job(effects: &[(Law, &[f64])], reduced: bool, channels: &[&str], comfort: bool) -> Counts {
    in_job(effects, reduced, channels, comfort, count_step).expect("a plain bogie")
}

/// Use the vehicle of a job of `railui bench`, its input table and its sums.
fn in_job<T>(
    effects: &[(Law, &[f64])],
    reduced: bool,
    channels: &[&str],
    comfort: bool,
    using: impl FnOnce(&Group, &InputTable<'_>, &RideSums) -> T,
) -> T {
    let mut numbers =
        vec![2900.0, 3300.0, 1850.0, 1050.0, 120.0, 1.28, 0.75, 1.0, 0.46, 55e3, 3e6, 8e6, 0.2e6, 0.2e6, 3e4, 3e4];
    let (angle, roll, spin) = if reduced { (0.0, 0.0, 0.0) } else { (0.05, 0.05, 0.25) };
    numbers[4] = if reduced { 0.0 } else { 120.0 };
    for _ in 0..2 {
        numbers.extend([0.18, 130.0, 120.0, 8.0, angle, roll]);
    }
    numbers.extend([spin, 7e-3]);
    let placed = |(law, n): &(Law, &[f64])| Placed { law: *law, at: "contact".into(), wheelset: 0, count: n.len() };
    let structure = Structure {
        kind: VehicleKind::Bogie,
        measured: Vec::new(),
        placed: effects.iter().map(placed).collect(),
        line: false,
    };
    let values: Vec<f64> = effects.iter().flat_map(|(_, n)| n.iter().copied()).collect();
    let amounts = vec![1.0; effects.len()];
    let vehicles = VehicleBatch {
        structure: &structure,
        count: 1,
        numbers: &numbers,
        effects: &values,
        amounts: &amounts,
        speed_scale: &[],
        initial: &[],
    };
    let section = [0.2, 0.3, 0.1, 1.0, -0.5, 0.2];
    let cascades: Vec<Vec<f64>> = [4, 4, 3].iter().map(|n| section.repeat(*n)).collect();
    let statistics_request = StatisticsRequest {
        channels: channels.iter().map(|c| c.to_string()).collect(),
        wheelsets: if reduced { 1 } else { 2 },
        clearance: &[7e-3],
        cascades: if comfort { cascades.iter().map(Vec::as_slice).collect() } else { Vec::new() },
        block: if comfort { 2000 } else { 0 },
    };
    let cross_level = if reduced { 0.0 } else { 1e-3 };
    let row =
        [0.0, 40.0, 1e-3, 1e-3, cross_level, cross_level, 0.0, 1e-3, 1e-3, cross_level, cross_level, 0.0, 0.0, 0.0];
    let table = row.repeat(5);
    let inputs = InputTable::new(&table, 14, 1, 0.0025);
    let (group, sums) = vehicles.first_group(&statistics_request, inputs.samples()).expect("a group");
    using(&group, &inputs, &sums)
}

const SATURATION: (Law, &[f64]) = (Law::CreepSaturation, &[0.35]);
const FLANGE: (Law, &[f64]) = (Law::FlangeContact, &[7e-3, 14.6e6]);

/// A Jacobian of p parameters takes 1 + p vehicles by differences, and p vehicles of dual numbers, which cost more each.
#[test]
fn a_vehicle_of_dual_numbers_takes_more_than_twice_the_operations_of_another() {
    let (one, dual) = in_job(&[SATURATION, FLANGE], false, &["e1", "e2"], false, |group, inputs, _| {
        let bogie = group.fully_plain().expect("a plain bogie");
        (rates_on::<Counted>(bogie, inputs).all(), rates_on::<Dual<Counted>>(bogie, inputs).all())
    });
    assert!(dual > 2 * one, "{dual} and {one}");
    println!("dual numbers: {dual} operations, {:.2} times {one}", dual as f64 / one as f64);
}

#[test]
fn the_table_of_operations_is_that_of_the_kernel() {
    let jobs = [
        ("full", count_job(&[SATURATION, FLANGE], false, &["e1", "e2", "ayf"], true)),
        ("without comfort", count_job(&[SATURATION, FLANGE], false, &["e1", "e2"], false)),
        ("reduced", count_job(&[SATURATION, FLANGE], true, &["e1"], false)),
    ];
    let mut counted = String::from("job,fused,products,sums,choices,roots,quotients\n");
    for (name, c) in jobs {
        let columns = [c.fused, c.products, c.sums, c.choices, c.roots, c.quotients].map(|n| n.to_string());
        counted += &format!("{name},{}\n", columns.join(","));
    }
    assert_eq!(include_str!("../../railui/bench/operations.csv"), counted);
}
