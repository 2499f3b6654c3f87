//! Splines of the profiles of sixteen vehicles: rolling radii and contact angles against the displacement.
use crate::simd::{LANES, Lanes, Part};

/// Per interval: coefficients of S, dS/dg and T in the distance from its beginning, lowest first.
type Interval = [f64; 12];

/// (r_1 - r_2)/2 = lambda S(e, g) and gamma_1 - gamma_2 = 2 epsilon T(e)/b, S and T in the place of e.
#[derive(Clone, Debug)]
pub struct ShapeLanes {
    alpha: Lanes,
    first: Lanes,
    step: Lanes,
    per_step: Lanes,
    tables: Vec<Vec<Interval>>,
    /// Which of the tables a lane reads.
    of: [usize; LANES],
}

impl ShapeLanes {
    /// From the numbers of each lane (see `effects::profile_shape`); lanes of equal numbers share a table.
    pub fn new(raw: &[&[f64]], alpha: Lanes) -> Self {
        let mut distinct: Vec<&[f64]> = Vec::new();
        let of = std::array::from_fn(|l| {
            distinct.iter().position(|table| *table == raw[l]).unwrap_or_else(|| {
                distinct.push(raw[l]);
                distinct.len() - 1
            })
        });
        ShapeLanes {
            alpha,
            first: Lanes::from_fn(|l| raw[l][1]),
            step: Lanes::from_fn(|l| raw[l][2]),
            per_step: Lanes::from_fn(|l| 1.0 / raw[l][2]),
            tables: distinct.into_iter().map(table).collect(),
            of,
        }
    }

    /// Quantities that replace d in the rolling radii, at a gauge deviation, and e in the contact angles.
    #[inline(always)]
    pub fn at<P: Part>(&self, part: usize, d: P, gauge: P, e: P) -> (P, P) {
        let (mut displaced, mut across) = (Lanes::ZERO, Lanes::ZERO);
        d.store(&mut displaced, part);
        e.store(&mut across, part);
        let (mut begins, mut factors) = ([Lanes::ZERO; 2], [Lanes::ZERO; 12]);
        for l in part..part + P::WIDTH {
            let table = &self.tables[self.of[l]];
            for (begin, place, which) in [(0, displaced.0[l], 0..8), (1, across.0[l], 8..12)] {
                let interval;
                (begins[begin].0[l], interval) = self.interval(table, l, place);
                for i in which {
                    factors[i].0[l] = interval[i];
                }
            }
        }
        let g = |l: &Lanes| P::load(l, part);
        let cubic = |first: usize, x: P| {
            let [c_0, c_1, c_2, c_3] = [0, 1, 2, 3].map(|i| g(&factors[first + i]));
            c_3.mul_add(x, c_2).mul_add(x, c_1).mul_add(x, c_0)
        };
        let (into, along) = (d - g(&begins[0]), e - g(&begins[1]));
        let (s, t, alpha) = (cubic(4, into).mul_add(gauge, cubic(0, into)), cubic(8, along), g(&self.alpha));
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

#[inline(always)]
fn cubic(c: &[f64], x: f64) -> f64 {
    c[0] + x * (c[1] + x * (c[2] + x * c[3]))
}

/// Coefficients per interval of n - 1, and before and behind them the straight lines beyond the ends.
fn table(raw: &[f64]) -> Vec<Interval> {
    let (n, h) = (raw[0] as usize, raw[2]);
    let splines: Vec<_> = (0..3).map(|i| natural_spline(&raw[3 + i * n..3 + (i + 1) * n], h)).collect();
    let joined = |k: usize| std::array::from_fn(|i| splines[i / 4][k][i % 4]);
    let middle: Vec<Interval> = (0..n - 1).map(joined).collect();
    let first: Interval = std::array::from_fn(|i| {
        let c = &splines[i / 4][0];
        [c[0] - c[1] * h, c[1], 0.0, 0.0][i % 4]
    });
    let last: Interval = std::array::from_fn(|i| {
        let c = &splines[i / 4][n - 2];
        [cubic(c, h), c[1] + h * (2.0 * c[2] + 3.0 * h * c[3]), 0.0, 0.0][i % 4]
    });
    [vec![first], middle, vec![last]].concat()
}

/// Natural cubic spline through equally spaced values: coefficients per interval.
fn natural_spline(y: &[f64], h: f64) -> Vec<[f64; 4]> {
    let n = y.len();
    // second derivatives m: m[i-1] + 4 m[i] + m[i+1] = 6 (y[i-1] - 2 y[i] + y[i+1])/h^2, none at the ends
    let mut m = vec![0.0; n];
    let mut upper = vec![0.0; n];
    for i in 1..n - 1 {
        let pivot = 4.0 - upper[i - 1];
        upper[i] = 1.0 / pivot;
        m[i] = (6.0 * (y[i - 1] - 2.0 * y[i] + y[i + 1]) / (h * h) - m[i - 1]) / pivot;
    }
    for i in (1..n - 1).rev() {
        m[i] -= upper[i] * m[i + 1];
    }
    let slope = |i: usize| (y[i + 1] - y[i]) / h - h * (2.0 * m[i] + m[i + 1]) / 6.0;
    (0..n - 1).map(|i| [y[i], slope(i), 0.5 * m[i], (m[i + 1] - m[i]) / (6.0 * h)]).collect()
}

/// Steepest slope of T, for the step size.
pub fn steepest_angle(raw: &[f64]) -> f64 {
    let (n, h) = (raw[0] as usize, raw[2]);
    let splines = natural_spline(&raw[3 + 2 * n..], h);
    // within an interval the slope is a parabola: it is steepest at an end or at its vertex
    let slope = |[_, c_1, c_2, c_3]: &[f64; 4], x: f64| c_1 + x * (2.0 * c_2 + 3.0 * x * c_3);
    let vertex = |[_, _, c_2, c_3]: &[f64; 4]| (-c_2 / (3.0 * c_3)).clamp(0.0, h);
    splines.iter().flat_map(|c| [0.0, vertex(c), h].map(|x| slope(c, x))).fold(0.0, f64::max)
}
