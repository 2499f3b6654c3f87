//! A sample of a part of the lanes: its channels, and the weights and sums that stream with the steps.
use crate::integrate::recorder::Series;
use crate::simd::{Part, STATES};
use crate::wheel_rail::guiding::Guiding;

/// A reading of a part of the lanes.
pub enum Signal<'a, P> {
    /// Of a wheelset relative to the rails, such as every score has: as its terms, without loops over them; the next likewise.
    Displacement {
        state: (usize, P),
        inputs: [(usize, P); 2],
    },
    /// Of a point of a body that yaws and rolls, with what its lean feels of gravity.
    Felt {
        state: (usize, P),
        rate: [(usize, P); 3],
    },
    Terms(Sum<P>),
    Guiding(&'a Guiding, usize, Sum<P>),
}

/// The terms of a reading.
pub struct Sum<P> {
    pub(super) state: Vec<(usize, P)>,
    pub(super) rate: Vec<(usize, P)>,
    pub(super) inputs: Vec<(usize, P)>,
    pub(super) rates: Vec<(usize, P)>,
}

impl<P: Part> Sum<P> {
    #[inline(always)]
    fn read(&self, row: &[f64], x: &[P; STATES], dx: &[P; STATES]) -> P {
        let mut value = P::zero();
        for (i, a) in &self.state {
            value = a.mul_add(x[i % STATES], value);
        }
        for (i, a) in &self.rate {
            value = a.mul_add(dx[i % STATES], value);
        }
        for (column, a) in &self.inputs {
            value = a.mul_add(P::splat(row[*column]), value);
        }
        for (column, a) in &self.rates {
            value = a.mul_add(P::splat(row[1] * row[*column]), value);
        }
        value
    }
}

impl<P: Part> Signal<'_, P> {
    #[inline(always)]
    pub fn read(&self, row: &[f64], x: &[P; STATES], dx: &[P; STATES]) -> P {
        match self {
            Signal::Displacement { state: (i, a), inputs: [(line, b), (level, c)] } => {
                c.mul_add(P::splat(row[*level]), b.mul_add(P::splat(row[*line]), *a * x[i % STATES]))
            }
            Signal::Felt { state: (i, g), rate: [(j, a), (k, b), (l, c)] } => {
                let turned = b.mul_add(dx[k % STATES], a.mul_add(dx[j % STATES], *g * x[i % STATES]));
                c.mul_add(dx[l % STATES], turned)
            }
            Signal::Terms(sum) => sum.read(row, x, dx),
            Signal::Guiding(guiding, at, sum) => guiding.add(*at, row, x, sum.read(row, x, dx)),
        }
    }
}

impl Series {
    /// The lanes of a channel from `at` on at a sample.
    #[inline(always)]
    pub fn lanes_mut(&mut self, channel: usize, k: usize, at: usize) -> &mut [f64] {
        &mut self.values[(channel * self.samples + k) * self.width + at..]
    }
}

/// Running sums of a part of the lanes, contiguous in memory for each sample.
pub struct RideAccumulator<'a, P> {
    pub(super) clearance: P,
    pub(super) displacements: Vec<(Signal<'a, P>, [P; 3])>,
    /// Accelerations, and behind them per cascade what each of them is weighted by.
    pub(super) points: Vec<(Signal<'a, P>, P)>,
    pub(super) cascades: Vec<Weighting<P>>,
    pub(super) block: usize,
    /// The square of the gain of cascade 0 over the samples of a block.
    pub(super) share: P,
    /// Samples until the block is full.
    pub(super) left: usize,
    /// Block after block, per acceleration the mean square of cascade 0; their sums of squares where the block began.
    pub(super) blocks: Vec<P>,
    pub(super) block_start: Vec<P>,
}

/// A cascade: its sections, once for all accelerations, and behind it per acceleration the memories and the sum of squares.
pub(super) struct Weighting<P> {
    pub(super) sections: Vec<Section<P>>,
    pub(super) behind: Vec<(Vec<[P; 2]>, P)>,
}

/// A second-order section with b0 = 1.
pub(super) struct Section<P> {
    pub(super) b: [P; 2],
    pub(super) a: [P; 2],
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

impl<P: Part> RideAccumulator<'_, P> {
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
    pub(super) fn squares(&self, point: usize, cascade: usize) -> P {
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
}
