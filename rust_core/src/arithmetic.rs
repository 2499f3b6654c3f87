//! The arithmetic of a step of a plain bogie, counted by the very rate and the very sums that the lanes run.
use crate::integrate::ride_statistics::{Growing, Sums};
use crate::rate::input_table::Course;
use crate::simd::{Counted, Counts, Lanes, Part, counting};
use crate::vehicle::group::{Group, STATES};
use crate::vehicle::plain_bogie::PlainBogie;

/// RK4 per degree of freedom: six products that join a sum on the way to the states of the slopes, three at the end, and
/// four sums of slopes there.
const RK4: Counts = Counts { fused: 9, sums: 4, ..Counts::NONE };

/// Rows of the input table that the slopes of a step are taken at.
const SLOPES: [usize; 4] = [0, 1, 1, 2];

/// What a step and its sample ask of every lane at the begin of a course, from rest, where no wheel slides; None of
/// vehicles whose rate is not that of a plain bogie.
pub fn of_a_step(group: &Group, course: &Course<'_>, sums: &Sums) -> Option<Counts> {
    let bogie = group.bare()?;
    let counts = match (bogie.laws, bogie.spin || !course.level) {
        (true, true) => rates_and_sample::<true, true>(bogie, group, course, sums),
        (false, true) => rates_and_sample::<false, true>(bogie, group, course, sums),
        (_, false) => rates_and_sample::<true, false>(bogie, group, course, sums),
    };
    Some(counts.and(group.dofs as u64, RK4))
}

/// Of the four rates of a step, and of the sample at its begin.
fn rates_and_sample<const LAWS: bool, const SPIN: bool>(
    bogie: &PlainBogie<Lanes>,
    group: &Group,
    course: &Course<'_>,
    sums: &Sums,
) -> Counts {
    let part = bogie.part::<Counted, SPIN>(0);
    let mut at = part.at_speed(course.row(0)[1]);
    let mut growing = Growing::new(sums, group, 0);
    let (x, mut dx) = ([Counted::zero(); STATES], [Counted::zero(); STATES]);
    part.rate::<LAWS, true, SPIN>(0, course.row(0), &mut at, &x, &mut dx); // the step before has laid its row
    counting(|| {
        for index in SLOPES {
            part.rate::<LAWS, true, SPIN>(index, course.row(index), &mut at, &x, &mut dx);
        }
        growing.sample(course.row(0), &x, &dx);
    })
}
