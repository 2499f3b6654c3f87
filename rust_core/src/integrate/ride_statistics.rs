//! Weights and sums that stream with the steps: what a riding quality is made of.
use crate::error::{Error, Result};
use crate::simd::{LANES, Lanes, Part};
use crate::vehicle::channels::Signal;
use crate::vehicle::group::{Group, STATES};

/// A cascade of second-order sections [b1, b2, a1, a2] with b0 = 1, and the gain that was taken out of them.
pub struct Cascade {
    gain: Lanes,
    sections: Vec<[Lanes; 4]>,
}

/// Sums of the displacements and of the weighted accelerations: the first readings are e_1, e_2, ..., the others
/// accelerations, each behind every cascade.
pub struct RideSums {
    pub samples: usize,
    clearance: Lanes,
    wheelsets: usize,
    cascades: Vec<Cascade>,
    /// Samples per block of the block rms, 0: none.
    block: usize,
    /// Per wheelset: sum, sum of squares, samples with abs(e) at the clearance or beyond.
    pub e: Vec<[Lanes; 3]>,
    /// Per acceleration, per cascade: sum of squares, but for the gain.
    pub squares: Vec<Lanes>,
    /// Per acceleration, per block: mean square of cascade 0.
    pub blocks: Vec<Lanes>,
}

impl RideSums {
    /// `points`: number of accelerations after the displacements of the wheelsets.
    pub fn new(
        samples: usize,
        clearance: Lanes,
        [wheelsets, points]: [usize; 2],
        cascades: Vec<Cascade>,
        block: usize,
    ) -> Self {
        let blocks = samples.checked_div(block).unwrap_or(0);
        RideSums {
            samples,
            clearance,
            wheelsets,
            squares: vec![Lanes::ZERO; points * cascades.len()],
            cascades,
            block,
            e: vec![[Lanes::ZERO; 3]; wheelsets],
            blocks: vec![Lanes::ZERO; points * blocks],
        }
    }

    /// Means, standard deviations and shares of flange contact of one lane.
    pub fn displacement(&self, lane: usize) -> Vec<[f64; 3]> {
        let n = self.samples as f64;
        let of = |[sum, squares, touching]: &[Lanes; 3]| {
            let mean = sum.0[lane] / n;
            let variance = (squares.0[lane] / n - mean * mean).max(0.0);
            [mean, variance.sqrt(), touching.0[lane] / n]
        };
        self.e.iter().map(of).collect()
    }

    /// Per acceleration, per cascade.
    pub fn rms(&self, i: usize, lane: usize) -> f64 {
        let gain = self.cascades[i % self.cascades.len()].gain.0[lane].abs();
        gain * (self.squares[i].0[lane] / self.samples as f64).sqrt()
    }
}

/// Running sums of a part of the lanes, contiguous in memory for each sample.
pub struct RideAccumulator<'a, P> {
    clearance: P,
    displacements: Vec<(Signal<'a, P>, [P; 3])>,
    /// Accelerations, and behind them per cascade what each of them is weighted by.
    points: Vec<(Signal<'a, P>, P)>,
    cascades: Vec<Weighting<P>>,
    block: usize,
    /// The square of the gain of cascade 0 over the samples of a block.
    share: P,
    /// Samples until the block is full.
    left: usize,
    /// Block after block, per acceleration the mean square of cascade 0; their sums of squares where the block began.
    blocks: Vec<P>,
    block_start: Vec<P>,
}

/// A cascade: its sections, once for all accelerations, and behind it per acceleration the memories and the sum of squares.
struct Weighting<P> {
    sections: Vec<Section<P>>,
    behind: Vec<(Vec<[P; 2]>, P)>,
}

/// A second-order section with b0 = 1.
struct Section<P> {
    b: [P; 2],
    a: [P; 2],
}

impl<P: Part> Section<P> {
    /// Transposed direct form II.
    #[inline(always)]
    fn pass(&self, memory: &mut [P; 2], w: P) -> P {
        let Section { b, a } = self;
        let y = w + memory[0];
        memory[0] = a[0].neg_mul_add(y, b[0].mul_add(w, memory[1]));
        memory[1] = a[1].neg_mul_add(y, b[1] * w);
        y
    }
}

impl<'a, P: Part> RideAccumulator<'a, P> {
    /// The lanes of a group from `at` on.
    #[inline(always)]
    pub fn new(sums: &RideSums, group: &'a Group, at: usize) -> Self {
        let mut signals: Vec<_> = group.readings.iter().map(|reading| reading.part::<P>(at)).collect();
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

    /// A sample: the input row, the state and its rate.
    #[inline(always)]
    pub fn sample(&mut self, row: &[f64], x: &[P; STATES], dx: &[P; STATES]) {
        for (signal, [sum, squares, touching]) in &mut self.displacements {
            let e = signal.read(row, x, dx);
            *sum = *sum + e;
            *squares = e.mul_add(e, *squares);
            *touching = *touching + e.abs().if_less(self.clearance, P::zero(), P::splat(1.0));
        }
        for (signal, acceleration) in &mut self.points {
            *acceleration = signal.read(row, x, dx);
        }
        for Weighting { sections, behind } in &mut self.cascades {
            for ((_, acceleration), (memories, squares)) in self.points.iter().zip(behind) {
                let mut w = *acceleration;
                for (section, memory) in sections.iter().zip(memories) {
                    w = section.pass(memory, w);
                }
                *squares = w.mul_add(w, *squares);
            }
        }
        if self.left == 1 {
            self.close();
        }
        self.left = self.left.saturating_sub(1);
    }

    /// The sum of squares of an acceleration behind a cascade.
    #[inline(always)]
    fn squares(&self, point: usize, cascade: usize) -> P {
        self.cascades.get(cascade).map_or(P::zero(), |weighting| weighting.behind[point].1)
    }

    /// The block is full.
    #[inline(always)]
    fn close(&mut self) {
        self.left = self.block + 1;
        for point in 0..self.points.len() {
            let squares = self.squares(point, 0);
            self.blocks.push((squares - self.block_start[point]) * self.share);
            self.block_start[point] = squares;
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

/// Lanes of a cascade from per-lane sections [lane][section][b0, b1, b2, a0, a1, a2] as scipy writes them.
pub fn cascade(sections: &[&[f64]]) -> Result<Cascade> {
    let count = sections[0].len() / 6;
    let of = |lane: usize| sections[if lane < sections.len() { lane } else { 0 }];
    let mut cascade = Cascade { gain: Lanes::splat(1.0), sections: vec![[Lanes::ZERO; 4]; count] };
    for lane in 0..LANES {
        for (section, to) in of(lane).as_chunks::<6>().0.iter().zip(&mut cascade.sections) {
            let [b0, b1, b2, a0, a1, a2] = *section;
            if b0 == 0.0 {
                return Err(Error::Value { what: "b0 of a section".into(), value: b0, rule: "other than zero" });
            }
            cascade.gain.0[lane] *= b0 / a0;
            for (to, number) in to.iter_mut().zip([b1 / b0, b2 / b0, a1 / a0, a2 / a0]) {
                to.0[lane] = number;
            }
        }
    }
    Ok(cascade)
}
