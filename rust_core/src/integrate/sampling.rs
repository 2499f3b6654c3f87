//! What a sample is made of, made ready for a part of the lanes, and sums handed over at the end.
use crate::integrate::ride_statistics::{Cascade, RideSums};
use crate::integrate::sample::{RideAccumulator, Section, Signal, Sum, Weighting};
use crate::simd::{Lanes, Part};
use crate::vehicle::channels::Reading;
use crate::vehicle::group::Group;

impl<'a, P: Part> Signal<'a, P> {
    /// A reading of the lanes from `at` on.
    #[inline(always)]
    pub fn of(reading: &'a Reading, at: usize) -> Self {
        let part = |terms: &[(usize, Lanes)]| terms.iter().map(|(i, a)| (*i, P::load(a, at))).collect::<Vec<_>>();
        let [state, rate, inputs, rates] =
            [&reading.state, &reading.rate, &reading.inputs, &reading.rates].map(|terms| part(terms));
        match (&reading.guiding, &state[..], &rate[..], &inputs[..], &rates[..]) {
            (Some(guiding), ..) => Signal::Guiding(guiding, at, Sum { state, rate, inputs, rates }),
            (None, &[state], &[], &[line, level], &[]) => Signal::Displacement { state, inputs: [line, level] },
            (None, &[state], &[a, b, c], &[], &[]) => Signal::Felt { state, rate: [a, b, c] },
            _ => Signal::Terms(Sum { state, rate, inputs, rates }),
        }
    }
}

impl<'a, P: Part> RideAccumulator<'a, P> {
    /// The lanes of a group from `at` on.
    #[inline(always)]
    pub fn new(sums: &RideSums, group: &'a Group, at: usize) -> Self {
        let mut signals: Vec<_> = group.readings.iter().map(|reading| Signal::of(reading, at)).collect();
        let points = signals.split_off(sums.wheelsets);
        let section = |[b1, b2, a1, a2]: &[Lanes; 4]| {
            let part = |a| P::load(a, at);
            Section { b: [part(b1), part(b2)], a: [part(a1), part(a2)] }
        };
        let weighting = |Cascade { sections, .. }: &Cascade| Weighting {
            sections: sections.iter().map(section).collect(),
            behind: vec![(vec![[P::zero(); 2]; sections.len()], P::zero()); points.len()],
        };
        let gain = sums.cascades.first().map_or(P::zero(), |cascade| P::load(&cascade.gain, at));
        RideAccumulator {
            clearance: P::load(&sums.clearance, at),
            displacements: signals.into_iter().map(|signal| (signal, [P::zero(); 3])).collect(),
            block_start: vec![P::zero(); points.len()],
            cascades: sums.cascades.iter().map(weighting).collect(),
            points: points.into_iter().map(|signal| (signal, P::zero())).collect(),
            block: sums.block,
            share: gain * gain * P::splat(1.0 / sums.block.max(1) as f64),
            left: sums.block,
            blocks: Vec::new(),
        }
    }

    /// Add the sums to their lanes.
    #[inline(always)]
    pub fn store(&self, sums: &mut RideSums, at: usize) {
        for ((_, grown), e) in self.displacements.iter().zip(&mut sums.e) {
            for (grown, sum) in grown.iter().zip(e) {
                grown.store(sum, at);
            }
        }
        for (i, sum) in sums.squares.iter_mut().enumerate() {
            self.squares(i / self.cascades.len(), i % self.cascades.len()).store(sum, at);
        }
        let (points, blocks) = (self.points.len(), sums.blocks.len() / self.points.len().max(1));
        for (i, mean) in self.blocks.iter().enumerate() {
            mean.store(&mut sums.blocks[i % points * blocks + i / points], at);
        }
    }
}
