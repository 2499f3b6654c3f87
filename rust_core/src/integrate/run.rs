//! Runs of a group along an input table, in the form that suits it.
use crate::error::{Error, Result};
use crate::integrate::recorder::Recorder;
use crate::integrate::rk4::Rk4Part;
use crate::integrate::steps::Run;
use crate::rate::forms::{Bogie, BogieOfAnyContact, Choice, Form, Fused, General, Interleave};
use crate::rate::fused::Structure;
use crate::rate::input_table::InputTable;
use crate::rate::structures::{ForStructure, for_structure};
use crate::simd::{Job, LANES, Lanes, Part, dispatch, level};
use crate::vehicle::group::Group;
use std::marker::PhantomData;
use std::ops::Range;
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
    let run = Run { group, inputs, initial, live, recorder: &mut recorder, cancel, diverged: &mut diverged };
    InForm(run, &Choice::of(group, inputs.level)).begin();
    for (lane, k) in diverged.iter().enumerate() {
        if let Some(k) = k {
            recorder.diverged_at(lane, *k);
        }
    }
    if cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(diverged) }
}

/// A run in one form.
struct Along<'a, 'w, 'c, F> {
    run: Run<'a, 'w>,
    choice: &'c Choice<'a>,
    form: PhantomData<F>,
}

impl<F: Form> Job for Along<'_, '_, '_, F> {
    type Output = ();
    const PORTABLE: bool = F::PORTABLE;

    #[inline(always)]
    fn run<P: Part>(self) {
        match F::INTERLEAVE {
            Interleave::None => self.widest_first::<P>(),
            Interleave::Eights if P::WIDTH == LANES => self.step_in_groups::<P::Single>(LANES / 2),
            Interleave::Eights => self.step_in_groups::<P>(LANES / 2),
            Interleave::Straight => self.step_in_groups::<P::Single>(P::WIDTH),
        }
    }
}

impl<F: Form> Along<'_, '_, '_, F> {
    /// Step the lanes of one part after another, what is left over in a single register where it has room.
    #[inline(always)]
    fn widest_first<P: Part>(self) {
        let Along { mut run, choice, .. } = self;
        let live = run.live;
        for from in (0..live).step_by(P::WIDTH) {
            if live - from > P::Single::WIDTH {
                Self::step_lanes::<P>(&mut run, choice, from..(from + P::WIDTH).min(live));
            } else {
                Self::step_lanes::<P::Single>(&mut run, choice, from..live);
            }
        }
    }

    /// Step this many lanes at a time, in parts of one register each.
    #[inline(always)]
    fn step_in_groups<P: Part>(self, lanes: usize) {
        let Along { mut run, choice, .. } = self;
        let live = run.live;
        for from in (0..live).step_by(lanes) {
            Self::step_lanes::<P>(&mut run, choice, from..(from + lanes).min(live));
        }
    }

    /// Step a range of lanes together.
    #[inline(always)]
    fn step_lanes<P: Part>(run: &mut Run<'_, '_>, choice: &Choice<'_>, lanes: Range<usize>) {
        // a plain loop: each adapter of the library would get a copy of all that makes a part
        let mut parts = Vec::new();
        for at in lanes.step_by(P::WIDTH) {
            let moving = F::part::<P>(run.group, choice, run.inputs, at);
            parts.push(Rk4Part::new(run.group, run.initial, run.recorder, at, moving));
        }
        run.along::<P, _, F>(&mut parts);
    }
}

/// A run in the form of a choice.
struct InForm<'a, 'w, 'c>(Run<'a, 'w>, &'c Choice<'a>);

impl InForm<'_, '_, '_> {
    fn begin(self) {
        match self.1 {
            Choice::General => self.within::<General>(),
            Choice::Bogie { laws: true, ports: true, .. } => self.within::<Bogie<true, true, true>>(),
            Choice::Bogie { laws: false, ports: true, .. } => self.within::<Bogie<false, true, true>>(),
            Choice::Bogie { spin: false, .. } => self.within::<Bogie<true, false, false>>(),
            Choice::Bogie { laws: true, .. } => self.within::<Bogie<true, true, false>>(),
            Choice::Bogie { laws: false, .. } => self.within::<Bogie<false, true, false>>(),
            Choice::BogieOfAnyContact => self.within::<BogieOfAnyContact>(),
            Choice::Fused { accelerations, .. } => for_structure(accelerations.known, self),
        }
    }

    fn within<F: Form>(self) {
        let InForm(run, choice) = self;
        dispatch(level().filled(run.live), Along::<F> { run, choice, form: PhantomData });
    }
}

impl ForStructure for InForm<'_, '_, '_> {
    fn run<S: Structure + 'static>(self) {
        match self.1 {
            Choice::Fused { laws: true, .. } => self.within::<Fused<true, S>>(),
            _ => self.within::<Fused<false, S>>(),
        }
    }
}
