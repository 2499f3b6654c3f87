//! RK4 steps of a group along an input table.
use crate::error::{Error, Result};
use crate::integrate::recorder::{CHECK_INTERVAL, Recorder};
use crate::integrate::rk4::{Rk4Part, Rk4Stages};
use crate::rate::forms::{Bogie, BogieOfAnyContact, Choice, Form, Fused, General, Interleave, Rate};
use crate::rate::input_table::InputTable;
use crate::simd::{Job, LANES, Lanes, Part, dispatch, level};
use crate::vehicle::group::Group;
use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, Ordering};

/// Run sixteen vehicles (the first `live` count) from `initial` (one entry per state; none: at rest).
/// Returns per lane the sample at which it was found diverged; its state is zero from there on.
pub fn run(
    group: &Group,
    inputs: &InputTable<'_>,
    initial: &[Lanes],
    live: usize,
    mut recorder: Recorder<'_>,
    cancel: &AtomicBool,
) -> Result<[Option<usize>; LANES]> {
    inputs.check(group.columns)?;
    if initial.len() > group.states {
        return Err(Error::Shape { what: "initial states".into(), got: initial.len(), expected: group.states });
    }
    let mut diverged = [None; LANES];
    Run { group, inputs, initial, live, recorder: &mut recorder, cancel, diverged: &mut diverged }.begin();
    for (lane, k) in diverged.iter().enumerate() {
        if let Some(k) = k {
            recorder.diverged_at(lane, *k);
        }
    }
    if cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(diverged) }
}

struct Run<'a, 'w> {
    group: &'a Group,
    inputs: &'a InputTable<'a>,
    initial: &'a [Lanes],
    live: usize,
    recorder: &'a mut Recorder<'w>,
    cancel: &'a AtomicBool,
    diverged: &'a mut [Option<usize>; LANES],
}

/// A run in one form.
struct Along<'a, 'w, F>(Run<'a, 'w>, PhantomData<F>);

impl<F: Form> Job for Along<'_, '_, F> {
    type Output = ();
    const PORTABLE: bool = F::PORTABLE;

    #[inline(always)]
    fn run<P: Part>(self) {
        match F::INTERLEAVE {
            Interleave::None => self.0.lane_groups::<P, F>(P::WIDTH),
            Interleave::Eights if P::WIDTH == LANES => self.0.lane_groups::<P::Single, F>(LANES / 2),
            Interleave::Eights => self.0.lane_groups::<P, F>(LANES / 2),
            Interleave::Singles => self.0.lane_groups::<P::Single, F>(P::WIDTH),
            // AVX-512 has registers enough for two of each number: both are worked on in the same lines
            Interleave::Straight if P::WIDTH == LANES && self.0.live > P::Single::WIDTH => {
                self.0.lane_groups::<P, F>(LANES)
            }
            Interleave::Straight => self.0.lane_groups::<P::Single, F>(P::WIDTH),
        }
    }
}

impl Run<'_, '_> {
    /// In the form that fits the group.
    fn begin(self) {
        match Choice::of(self.group, self.inputs.level) {
            Choice::General => self.within::<General>(),
            Choice::Bogie { laws: true, ports: true, .. } => self.within::<Bogie<true, true, true>>(),
            Choice::Bogie { laws: false, ports: true, .. } => self.within::<Bogie<false, true, true>>(),
            Choice::Bogie { spin: false, .. } => self.within::<Bogie<true, false, false>>(),
            Choice::Bogie { laws: true, .. } => self.within::<Bogie<true, true, false>>(),
            Choice::Bogie { laws: false, .. } => self.within::<Bogie<false, true, false>>(),
            Choice::BogieOfAnyContact => self.within::<BogieOfAnyContact>(),
            Choice::Fused { laws: true, coach: true } => self.within::<Fused<true, true>>(),
            Choice::Fused { laws: true, coach: false } => self.within::<Fused<true, false>>(),
            Choice::Fused { laws: false, coach: true } => self.within::<Fused<false, true>>(),
            Choice::Fused { laws: false, coach: false } => self.within::<Fused<false, false>>(),
        }
    }

    fn within<F: Form>(self) {
        dispatch(level().filled(self.live), Along::<F>(self, PhantomData));
    }

    /// Step this many lanes at a time, in parts of one register each.
    #[inline(always)]
    fn lane_groups<P: Part, F: Form>(mut self, lanes: usize) {
        for from in (0..self.live).step_by(lanes) {
            let ats = (from..(from + lanes).min(self.live)).step_by(P::WIDTH);
            let part = |at: usize| {
                let moving = F::part::<P>(self.group, self.inputs, at);
                Rk4Part::new(self.group, self.initial, self.recorder, at, moving)
            };
            let mut parts: Vec<_> = ats.map(part).collect();
            self.along::<P, _, F>(&mut parts);
        }
    }

    /// RK4 along the course for some parts of the lanes, in turns: while one waits for its square roots, the next goes on.
    #[inline(always)]
    fn along<P: Part, M: Rate<P>, F: Form>(&mut self, parts: &mut [Rk4Part<'_, P, M>]) {
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
                    part.check_divergence(group, k, inputs.row(2 * steps * k), &mut h, self.diverged);
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
        // there is never another of eight lanes: then all are in one
        if P::WIDTH < LANES / 2
            && let Some(other) = others.first_mut()
        {
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
