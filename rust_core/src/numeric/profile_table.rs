//! Splines of the profiles of sixteen vehicles: rolling radii and contact angles against the displacement.
use crate::simd::{LANES, Lanes, Part};

/// Per interval: coefficients of S, dS/dg and T in the distance from its beginning, lowest first.
pub(super) type Interval = [f64; 12];

/// (r_1 - r_2)/2 = lambda S(e, g) and gamma_1 - gamma_2 = 2 epsilon T(e)/b, S and T in the place of e.
#[derive(Clone, Debug)]
pub struct ShapeLanes {
    pub(super) alpha: Lanes,
    pub(super) first: Lanes,
    pub(super) step: Lanes,
    pub(super) per_step: Lanes,
    pub(super) tables: Vec<Vec<Interval>>,
    /// Which of the tables a lane reads.
    pub(super) of: [usize; LANES],
}

impl ShapeLanes {
    /// Quantities that replace d in the rolling radii, at a gauge deviation, and e in the contact angles.
    #[inline(always)]
    pub fn at<P: Part>(&self, part: usize, d: P, gauge: P, e: P) -> (P, P) {
        let (mut displaced, mut across) = (Lanes::ZERO, Lanes::ZERO);
        d.store(&mut displaced, part);
        e.store(&mut across, part);
        // of the lanes of this part, from the first on: by the displacement, by e
        let (mut begins, mut intervals) = ([[0.0; LANES]; 2], [[&EMPTY; LANES]; 2]);
        for l in 0..P::WIDTH {
            let table = &self.tables[self.of[part + l]];
            for (i, place) in [displaced.0[part + l], across.0[part + l]].into_iter().enumerate() {
                (begins[i][l], intervals[i][l]) = self.interval(table, part + l, place);
            }
        }
        let (by_place, by_e) = (&intervals[0], &intervals[1]);
        let (into, along) = (d - P::read(&begins[0]), e - P::read(&begins[1]));
        let (s, t, alpha) = (
            cubic_of(by_place, 4, into).mul_add(gauge, cubic_of(by_place, 0, into)),
            cubic_of(by_e, 8, along),
            P::load(&self.alpha, part),
        );
        (alpha.mul_add(s - d, d), alpha.mul_add(t - e, e))
    }

    /// Interval of x: where it begins, and its coefficients.
    #[inline(always)]
    fn interval<'a>(&self, table: &'a [Interval], l: usize, x: f64) -> (f64, &'a Interval) {
        let from = x - self.first.0[l];
        // the first and the last are the straight lines beyond the ends; a cast of NaN is 0
        let k = ((from * self.per_step.0[l] + 1.0) as isize).clamp(0, table.len() as isize - 1) as usize;
        (self.first.0[l] + (k as f64 - 1.0) * self.step.0[l], &table[k])
    }
}

const EMPTY: Interval = [0.0; 12];

/// A coefficient of the intervals that the lanes of a part are in.
#[inline(always)]
fn gathered<P: Part>(intervals: &[&Interval; LANES], i: usize) -> P {
    let mut coefficients = [0.0; LANES];
    for l in 0..P::WIDTH {
        coefficients[l] = intervals[l][i];
    }
    P::read(&coefficients)
}

/// The cubic of coefficients from one on, in the distance x from the beginning of the interval.
#[inline(always)]
fn cubic_of<P: Part>(intervals: &[&Interval; LANES], first: usize, x: P) -> P {
    let mut sum: P = gathered(intervals, first + 3);
    for i in [2, 1, 0] {
        sum = sum.mul_add(x, gathered(intervals, first + i));
    }
    sum
}
