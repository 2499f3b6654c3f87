//! Weights and sums of a ride: what a riding quality is made of.
use crate::error::{Error, Result};
use crate::simd::{LANES, Lanes};

/// A cascade of second-order sections [b1, b2, a1, a2] with b0 = 1, and the gain that was taken out of them.
pub struct Cascade {
    pub(super) gain: Lanes,
    pub(super) sections: Vec<[Lanes; 4]>,
}

/// Sums of the displacements and of the weighted accelerations: the first readings are e_1, e_2, ..., the others
/// accelerations, each behind every cascade.
pub struct RideSums {
    pub samples: usize,
    pub(super) clearance: Lanes,
    pub(super) wheelsets: usize,
    pub(super) cascades: Vec<Cascade>,
    /// Samples per block of the block rms, 0: none.
    pub(super) block: usize,
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
