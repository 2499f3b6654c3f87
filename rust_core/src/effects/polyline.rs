//! A curve through points: linear between them, constant beyond its ends.
use super::effect::Numbers;
use crate::simd::Part;

/// Do numbers describe a curve: the count n, n places that rise, n values?
pub fn counts(p: &[f64]) -> bool {
    let [count, points @ ..] = p else { return false };
    let is_paired = points.len() > 1 && points.len() == 2 * *count as usize;
    is_paired && points[..points.len() / 2].windows(2).all(|x| x[0] < x[1])
}

/// The places and the values.
pub fn points(p: &[f64]) -> (&[f64], &[f64]) {
    let [count, points @ ..] = p else { return (&[], &[]) };
    points.split_at(*count as usize)
}

/// The first value, then per interval where it begins, its width and its slope; the whole curve further on by `shift`.
pub fn prepare(p: &[f64], shift: f64) -> Vec<f64> {
    let (x, y) = points(p);
    let mut out = vec![y[0]];
    for i in 1..x.len() {
        let (begins, ends) = (x[i - 1] + shift, x[i] + shift);
        out.extend([begins, ends - begins, (y[i] - y[i - 1]) / (ends - begins)]);
    }
    out
}

/// Its value at x, from the numbers of `prepare`.
#[inline(always)]
pub fn at<P: Part>(p: Numbers<'_>, x: P) -> P {
    let [mut y]: [P; 1] = p.first();
    for piece in 0..(p.lanes.len() - 1) / 3 {
        let [begins, length, slope]: [P; 3] = p.from(1 + 3 * piece);
        let inside = (x - begins).max(P::zero()).min(length);
        y = inside.mul_add(slope, y);
    }
    y
}
