//! The steps of a run: RK4 along the input table, and lanes that leave the rails.
use crate::integrate::recorder::{CHECK_INTERVAL, Recorder};
use crate::integrate::rk4::{Rk4Part, Rk4Stages};
use crate::rate::Rate;
use crate::rate::forms::{Form, Interleave};
use crate::rate::input_table::InputTable;
use crate::simd::{LANES, Lanes, Part, STATES};
use crate::vehicle::group::Group;
use std::sync::atomic::{AtomicBool, Ordering};

/// A run of sixteen vehicles, the first `live` of which count.
pub struct Run<'a, 'w> {
    pub group: &'a Group,
    pub inputs: &'a InputTable<'a>,
    pub initial: &'a [Lanes],
    pub live: usize,
    pub recorder: &'a mut Recorder<'w>,
    pub cancel: &'a AtomicBool,
    pub diverged: &'a mut [Option<usize>; LANES],
}

impl Run<'_, '_> {
    /// RK4 along the course for some parts of the lanes, in turns: while one waits for its square roots, the next goes on.
    #[inline(always)]
    pub fn along<P: Part, M: Rate<P>, F: Form>(&mut self, parts: &mut [Rk4Part<'_, P, M>]) {
        let (group, inputs) = (self.group, self.inputs);
        let (samples, steps) = (inputs.samples(), inputs.steps);
        let mut h = Lanes::from_fn(|l| inputs.dt / steps as f64 * group.inv_speed_scale.0[l]);
        for k in 0..samples {
            let last = k + 1 == samples;
            if k % CHECK_INTERVAL == 0 || last {
                if self.cancel.load(Ordering::Relaxed) {
                    return;
                }
                for part in &mut *parts {
                    let (at, x) = part.state();
                    check_divergence(group, at, k, inputs.row(2 * steps * k), x, &mut h, self.diverged);
                    part.set_step(&h);
                }
            }
            for step in 0..if last { 1 } else { steps } {
                let begin = 2 * (steps * k + step);
                if let Interleave::Straight = F::INTERLEAVE {
                    self.straight(parts, begin, last, (step == 0).then_some(k));
                    continue;
                }
                // one call of rate() in all: its code stays in the cache of decoded instructions
                for turn in 0..if last { 1 } else { 4_usize } {
                    let index = begin + turn.div_ceil(2);
                    let row = inputs.row(index);
                    for part in &mut *parts {
                        part.rate(turn, index, row);
                        match turn {
                            0 => part.ahead::<0>(turn),
                            1 => part.ahead::<1>(turn),
                            2 => part.ahead::<2>(turn),
                            _ => part.step(turn),
                        }
                        if turn == 0 && step == 0 {
                            part.sample(k, row, self.recorder);
                        }
                        if turn == 3 {
                            part.clamp_own_states(group);
                        }
                    }
                }
            }
        }
        for part in parts {
            part.store(self.recorder);
        }
    }

    /// A step as straight code, of a part or of two in turns; beyond the last row of the input table nothing is asked of it.
    #[inline(always)]
    fn straight<P: Part, M: Rate<P>>(
        &mut self,
        parts: &mut [Rk4Part<'_, P, M>],
        begin: usize,
        last: bool,
        sample: Option<usize>,
    ) {
        let rows = [0, 1, 2].map(|half| begin + if last { 0 } else { half }).map(|i| (i, self.inputs.row(i)));
        let Some((one, others)) = parts.split_first_mut() else { return };
        let mut stages = Rk4Stages::empty();
        if let Some(other) = others.first_mut() {
            let mut others = Rk4Stages::empty();
            one.first(rows[0], &mut stages, sample, self.recorder);
            other.first(rows[0], &mut others, sample, self.recorder);
            one.next::<1>(rows[1], &mut stages);
            other.next::<1>(rows[1], &mut others);
            one.next::<2>(rows[1], &mut stages);
            other.next::<2>(rows[1], &mut others);
            one.last(rows[2], &mut stages);
            other.last(rows[2], &mut others);
        } else {
            one.first(rows[0], &mut stages, sample, self.recorder);
            one.next::<1>(rows[1], &mut stages);
            one.next::<2>(rows[1], &mut stages);
            one.last(rows[2], &mut stages);
        }
    }
}

impl InputTable<'_> {
    #[inline(always)]
    pub fn row(&self, i: usize) -> &[f64] {
        &self.table[i * self.columns..(i + 1) * self.columns]
    }
}

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
