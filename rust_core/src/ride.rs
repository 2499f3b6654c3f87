//! Weights and sums that stream with the steps: what a riding quality is made of.
use crate::lanes::{LANES, Lanes, Part};
use crate::vehicle::{Group, STATES};

/// A cascade of second-order sections [b0, b1, b2, a1, a2] per lane.
pub type Cascade = Vec<[Lanes; 5]>;

/// Sums of the displacements and of the weighted accelerations: the first readings are e_1, e_2, ..., the others
/// accelerations, each behind every cascade.
pub struct Sums {
    pub samples: usize,
    clearance: Lanes,
    wheelsets: usize,
    cascades: Vec<Cascade>,
    /// Samples per block of the block rms, 0: none.
    block: usize,
    memory: Vec<[Lanes; 2]>,
    pub count: usize,
    /// Per wheelset: sum, sum of squares, samples with abs(e) at the clearance or beyond.
    pub e: Vec<[Lanes; 3]>,
    /// Per acceleration, per cascade: sum of squares.
    pub squares: Vec<Lanes>,
    /// Per acceleration, per block: mean square of cascade 0.
    pub blocks: Vec<Lanes>,
}

impl Sums {
    /// `points`: how many accelerations there are beside the displacements of the wheelsets.
    pub fn new(
        samples: usize,
        clearance: Lanes,
        [wheelsets, points]: [usize; 2],
        cascades: Vec<Cascade>,
        block: usize,
    ) -> Self {
        let sections: usize = cascades.iter().map(Vec::len).sum();
        let blocks = samples.checked_div(block).unwrap_or(0);
        Sums {
            samples,
            clearance,
            wheelsets,
            squares: vec![Lanes::ZERO; points * cascades.len()],
            cascades,
            block,
            memory: vec![[Lanes::ZERO; 2]; points * sections],
            count: 0,
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
        (self.squares[i].0[lane] / self.samples as f64).sqrt()
    }
}

#[inline(always)]
fn add<P: Part>(to: &mut Lanes, at: usize, value: P) {
    (P::load(to, at) + value).store(to, at);
}

impl Sums {
    #[inline(always)]
    pub(crate) fn sample<P: Part>(
        &mut self,
        group: &Group,
        at: usize,
        k: usize,
        row: &[f64],
        x: &[P; STATES],
        dx: &[P; STATES],
    ) {
        let clearance = P::load(&self.clearance, at);
        for (reading, [sum, squares, touching]) in group.readings.iter().zip(&mut self.e) {
            let e = reading.read(at, row, x, dx);
            add(sum, at, e);
            P::load(squares, at).mul_add(P::splat(1.0), e * e).store(squares, at);
            add(touching, at, e.abs().if_less(clearance, P::zero(), P::splat(1.0)));
        }
        let blocks = self.samples.checked_div(self.block).unwrap_or(0);
        let mut memory = self.memory.iter_mut();
        for (point, reading) in group.readings.iter().skip(self.wheelsets).enumerate() {
            let acceleration = reading.read(at, row, x, dx);
            for (c, cascade) in self.cascades.iter().enumerate() {
                let mut w = acceleration;
                for section in cascade {
                    let [m0, m1] = memory.next().expect("a memory per section");
                    let get = |i: usize| P::load(&section[i], at);
                    // transposed direct form II
                    let y = get(0).mul_add(w, P::load(m0, at));
                    get(3).neg_mul_add(y, get(1).mul_add(w, P::load(m1, at))).store(m0, at);
                    get(4).neg_mul_add(y, get(2) * w).store(m1, at);
                    w = y;
                }
                let square = w * w;
                add(&mut self.squares[point * self.cascades.len() + c], at, square);
                if c == 0 && self.block > 0 && k / self.block < blocks {
                    add(
                        &mut self.blocks[point * blocks + k / self.block],
                        at,
                        square * P::splat(1.0 / self.block as f64),
                    );
                }
            }
        }
    }
}

/// Lanes of a cascade from per-lane sections [lane][section][b0, b1, b2, a0, a1, a2] as scipy writes them.
pub fn cascade(sections: &[&[f64]]) -> Cascade {
    let count = sections[0].len() / 6;
    let of = |lane: usize| sections[if lane < sections.len() { lane } else { 0 }];
    (0..count)
        .map(|s| {
            [0, 1, 2, 4, 5].map(|i| {
                let mut lanes = [0.0; LANES];
                for (l, value) in lanes.iter_mut().enumerate() {
                    *value = of(l)[6 * s + i] / of(l)[6 * s + 3];
                }
                Lanes(lanes)
            })
        })
        .collect()
}
