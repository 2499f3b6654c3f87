//! Cubic splines through samples, not-a-knot: the first two and the last two intervals share a cubic each.
use crate::error::{Error, Result, expect_len};

/// Distance before the first place [m] that is rounding of place - behind, and decides nothing.
const ROUNDING: f64 = 1e-9;

/// Columns over increasing places x; beyond the ends the first and the last cubic go on.
#[derive(Clone, Debug)]
pub struct Spline {
    x: Vec<f64>,
    columns: usize,
    /// [interval][column] factors of the powers of the distance from the interval's beginning, highest first.
    factors: Vec<[f64; 4]>,
}

impl Spline {
    /// The fewest samples that a not-a-knot spline passes through.
    pub const FEWEST: usize = 4;

    /// Through y [sample][column] at the places x. Source: de Boor, A Practical Guide to Splines, chapter IV.
    pub fn new(x: &[f64], y: &[f64], columns: usize) -> Result<Self> {
        let n = x.len();
        if n < Self::FEWEST || columns == 0 {
            return Err(Error::Shape { what: "samples of a spline".into(), got: n, expected: Self::FEWEST });
        }
        expect_len("values of a spline", y.len(), n * columns)?;
        if let Some(i) = (1..n).find(|&i| !(x[i] - x[i - 1] > 0.0 && x[i].is_finite())) {
            let what = format!("the step to place {i} of a spline");
            return Err(Error::Value { what, value: x[i] - x[i - 1], rule: "positive" });
        }
        let h: Vec<f64> = x.windows(2).map(|x| x[1] - x[0]).collect();
        let mut factors = vec![[0.0; 4]; (n - 1) * columns];
        for column in 0..columns {
            let value = |i: usize| y[i * columns + column];
            let slope: Vec<f64> = (0..n - 1).map(|i| (value(i + 1) - value(i)) / h[i]).collect();
            let rate = rates(x, &h, &slope);
            for i in 0..n - 1 {
                let bend = (rate[i] + rate[i + 1] - 2.0 * slope[i]) / h[i];
                factors[i * columns + column] = [bend / h[i], (slope[i] - rate[i]) / h[i] - bend, rate[i], value(i)];
            }
        }
        Ok(Spline { x: x.to_vec(), columns, factors })
    }

    /// Values, first or second derivatives at places [place][column]; quickest where the places increase.
    pub fn at(&self, places: &[f64], derivative: usize) -> Vec<f64> {
        let mut found = Vec::with_capacity(places.len() * self.columns);
        let mut i = 0;
        for &place in places {
            i = self.interval(place, i);
            let d = place - self.x[i];
            for factors in &self.factors[i * self.columns..(i + 1) * self.columns] {
                found.push(match derivative {
                    0 => cubic(factors, d),
                    1 => cubic_slope(factors, d),
                    _ => factors[1] * 2.0 + factors[0] * d * 6.0,
                });
            }
        }
        found
    }

    /// Add values, and first derivatives where they have a column, along the places in the first column of a table, each
    /// so far `behind` its row. Before its first place such a column has the first value and no slope.
    pub fn add_behind(&self, table: &mut [f64], width: usize, behind: f64, into: &[(usize, Option<usize>)]) {
        let mut i = 0;
        for row in table.chunks_exact_mut(width) {
            let place = row[0] - behind;
            let waits = behind > 0.0 && place < self.x[0] - ROUNDING;
            let place = if behind > 0.0 { place.max(self.x[0]) } else { place };
            i = self.interval(place, i);
            let d = place - self.x[i];
            for (factors, (value, slope)) in self.factors[i * self.columns..].iter().zip(into) {
                row[*value] += cubic(factors, d);
                if let (Some(slope), false) = (slope, waits) {
                    row[*slope] += cubic_slope(factors, d);
                }
            }
        }
    }

    /// Factors [interval][column], see there.
    pub fn factors(&self) -> &[[f64; 4]] {
        &self.factors
    }

    /// The interval of x, searched for from that of the previous call.
    fn interval(&self, place: f64, near: usize) -> usize {
        let last = self.x.len() - 2;
        let within = |i: usize| (i == 0 || self.x[i] <= place) && (i == last || place < self.x[i + 1]);
        (near..=last.min(near + 2))
            .find(|&i| within(i))
            .unwrap_or_else(|| self.x.partition_point(|x| *x <= place).saturating_sub(1).min(last))
    }
}

/// Value of a cubic at a distance from the beginning of its interval.
fn cubic([c3, c2, c1, c0]: &[f64; 4], d: f64) -> f64 {
    c0 + c1 * d + c2 * (d * d) + c3 * (d * d * d)
}

/// First derivative of a cubic there.
fn cubic_slope([c3, c2, c1, _]: &[f64; 4], d: f64) -> f64 {
    c1 + c2 * d * 2.0 + c3 * (d * d) * 3.0
}

/// First derivatives at the places: the second derivative is continuous, the third too behind the first and before
/// the last interval. A tridiagonal system, whose pivots stay positive in the order of its rows.
fn rates(x: &[f64], h: &[f64], slope: &[f64]) -> Vec<f64> {
    let n = x.len();
    let (first, last) = (x[2] - x[0], x[n - 1] - x[n - 3]);
    let mut pivot = vec![h[1]; n];
    let mut rate = vec![0.0; n];
    let upper = |i: usize| if i == 0 { first } else { h[i - 1] };
    rate[0] = ((h[0] + 2.0 * first) * h[1] * slope[0] + h[0] * h[0] * slope[1]) / first;
    for i in 1..n {
        let (lower, middle, right) = if i < n - 1 {
            (h[i], 2.0 * (h[i - 1] + h[i]), 3.0 * (h[i] * slope[i - 1] + h[i - 1] * slope[i]))
        } else {
            let (a, b) = (h[n - 3], h[n - 2]);
            (last, a, (b * b * slope[n - 3] + (2.0 * last + b) * a * slope[n - 2]) / last)
        };
        let share = lower / pivot[i - 1];
        pivot[i] = middle - share * upper(i - 1);
        rate[i] = right - share * rate[i - 1];
    }
    rate[n - 1] /= pivot[n - 1];
    for i in (0..n - 1).rev() {
        rate[i] = (rate[i] - upper(i) * rate[i + 1]) / pivot[i];
    }
    rate
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_cubic_is_its_own_spline_and_goes_on_beyond_the_ends() {
        let f = |x: f64| 2.0 - x + 0.5 * x * x - 0.25 * x * x * x;
        let df = |x: f64| -1.0 + x - 0.75 * x * x;
        let ddf = |x: f64| 1.0 - 1.5 * x;
        let x = [0.0, 0.3, 1.0, 1.2, 2.5, 2.6];
        let y: Vec<f64> = x.iter().map(|x| f(*x)).collect();
        let spline = Spline::new(&x, &y, 1).unwrap();
        let places = [2.55, -0.5, 0.3, 0.7, 2.6, 4.0];
        for (derivative, wanted) in [&f as &dyn Fn(f64) -> f64, &df, &ddf].into_iter().enumerate() {
            for (found, place) in spline.at(&places, derivative).iter().zip(places) {
                let wanted = wanted(place);
                assert!((found - wanted).abs() < 1e-13 * wanted.abs().max(1.0), "{found} at {place}");
            }
        }
    }

    #[test]
    fn before_its_first_place_a_column_behind_has_the_first_value_and_no_slope() {
        let spline = Spline::new(&[1.0, 2.0, 3.0, 4.0], &[2.0, 4.0, 6.0, 8.0], 1).unwrap();
        let into = [(2, Some(3))];
        let mut table = [0.0, 9.0, 0.5, 0.0, 2.0, 9.0, 0.5, 0.0, 3.5, 9.0, 0.5, 0.0];
        spline.add_behind(&mut table, 4, 1.5, &into);
        assert_eq!(table, [0.0, 9.0, 2.5, 0.0, 2.0, 9.0, 2.5, 0.0, 3.5, 9.0, 4.5, 2.0]);
        let mut ahead = [0.0, 9.0, 0.5, 0.0];
        spline.add_behind(&mut ahead, 4, 0.0, &into);
        assert_eq!(ahead, [0.0, 9.0, 0.5, 2.0]);
    }

    #[test]
    fn places_that_stand_still_and_too_few_are_refused() {
        assert!(Spline::new(&[0.0, 1.0, 1.0, 2.0], &[0.0; 4], 1).is_err());
        assert!(Spline::new(&[0.0, 1.0, 2.0], &[0.0; 3], 1).is_err());
    }
}
