//! A curve through points: linear between them, held beyond its ends.
use super::effect::Numbers;
use crate::lanes::Part;

/// The first value, then per interval where it begins, its width and its slope.
pub fn prepare(x: &[f64], y: &[f64]) -> Vec<f64> {
    let mut out = vec![y[0]];
    for i in 1..x.len() {
        out.extend([x[i - 1], x[i] - x[i - 1], (y[i] - y[i - 1]) / (x[i] - x[i - 1])]);
    }
    out
}

/// Its value at x, from the numbers of `prepare` that begin at `first`.
#[inline(always)]
pub fn at<P: Part>(p: Numbers<'_>, first: usize, x: P) -> P {
    let mut y: P = p.get(first);
    for i in (first + 1..p.lanes.len()).step_by(3) {
        let inside = (x - p.get(i)).max(P::zero()).min(p.get(i + 1));
        y = inside.mul_add(p.get(i + 2), y);
    }
    y
}
