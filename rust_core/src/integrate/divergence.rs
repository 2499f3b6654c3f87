//! Divergence of lanes: a vehicle off the rails, or a state that is not finite.
use crate::simd::{LANES, Lanes, Part};
use crate::vehicle::group::{Group, STATES};

/// Check the lanes of a part: abs(e_i) and abs(psi_i) within the limit, everything finite. A diverged lane is set to
/// zero from this sample `k` on, and its step `h` too.
#[inline(always)]
pub fn check_divergence<P: Part>(
    group: &Group,
    at: usize,
    k: usize,
    row: &[f64],
    x: &mut [P; STATES],
    h: &mut Lanes,
    diverged: &mut [Option<usize>; LANES],
) {
    let mut values = [Lanes::ZERO; STATES];
    for i in 0..group.states {
        x[i].store(&mut values[i], at);
    }
    let mut any = false;
    for (lane, diverged_at) in diverged.iter_mut().enumerate().skip(at).take(P::WIDTH) {
        let of = |i: usize| values[i].0[lane];
        let on_rails = if group.wheelsets.is_empty() {
            (0..group.dofs).all(|i| of(i).abs() <= group.limit)
        } else {
            group.wheelsets.iter().all(|w| {
                let e = of(w.y) - row[w.column] - w.r.0[lane] * row[w.column + 2];
                e.abs() <= group.limit && of(w.psi).abs() <= group.limit
            })
        };
        if diverged_at.is_none() && (!on_rails || (0..group.states).any(|i| !of(i).is_finite())) {
            *diverged_at = Some(k);
            h.0[lane] = 0.0;
            for value in values[..group.states].iter_mut() {
                value.0[lane] = 0.0;
            }
            any = true;
        }
    }
    if any {
        for i in 0..group.states {
            x[i] = P::load(&values[i], at);
        }
    }
}
