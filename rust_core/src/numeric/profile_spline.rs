//! Splines of profiles in the intervals of their tables, and their steepest slope.
use crate::numeric::profile_table::{Interval, ShapeLanes};
use crate::simd::Lanes;

/// Numbers of a shape: how many places, the first, the step; S, dS/dg and T there, one after the other.
struct Shape<'a> {
    count: usize,
    first: f64,
    step: f64,
    values: &'a [f64],
}

impl<'a> Shape<'a> {
    fn of(raw: &'a [f64]) -> Self {
        let [count, first, step, values @ ..] = raw else { panic!("counted by the effect") };
        Shape { count: *count as usize, first: *first, step: *step, values }
    }

    /// The natural splines through the values of a function, interval by interval.
    fn spline(&self, function: usize) -> Vec<[f64; 4]> {
        natural_spline(&self.values[function * self.count..(function + 1) * self.count], self.step)
    }
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
            first: Lanes::from_fn(|l| Shape::of(raw[l]).first),
            step: Lanes::from_fn(|l| Shape::of(raw[l]).step),
            per_step: Lanes::from_fn(|l| 1.0 / Shape::of(raw[l]).step),
            tables: distinct.into_iter().map(table).collect(),
            of,
        }
    }
}

fn cubic(c: &[f64], x: f64) -> f64 {
    c[0] + x * (c[1] + x * (c[2] + x * c[3]))
}

/// Coefficients per interval of n - 1, and before and behind them the straight lines beyond the ends.
fn table(raw: &[f64]) -> Vec<Interval> {
    let shape = Shape::of(raw);
    let (n, h) = (shape.count, shape.step);
    let splines = [0, 1, 2].map(|function| shape.spline(function));
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
    let shape = Shape::of(raw);
    let (splines, h) = (shape.spline(2), shape.step);
    // within an interval the slope is a parabola: it is steepest at an end or at its vertex
    let slope = |[_, c_1, c_2, c_3]: &[f64; 4], x: f64| c_1 + x * (2.0 * c_2 + 3.0 * x * c_3);
    let vertex = |[_, _, c_2, c_3]: &[f64; 4]| (-c_2 / (3.0 * c_3)).clamp(0.0, h);
    splines.iter().flat_map(|c| [0.0, vertex(c), h].map(|x| slope(c, x))).fold(0.0, f64::max)
}
