//! Output of a run: every channel at every sample, or sums.
use crate::integrate::ride_statistics::RideSums;
use crate::simd::Lanes;
use crate::vehicle::group::Group;

/// Samples between two checks of divergence and cancellation.
pub const CHECK_INTERVAL: usize = 64;

/// No channel of a vehicle reaches this.
const OVERFLOW_LIMIT: f64 = 1e12;

/// Receiver of the steps. Not a type parameter, so that the step loop is compiled once for both.
pub enum Recorder<'a> {
    Series(&'a mut Series),
    RideSums(&'a mut RideSums),
}

impl Recorder<'_> {
    /// Discard the output of a diverged lane since the last check.
    pub fn diverged_at(&mut self, lane: usize, k: usize) {
        if let Recorder::Series(series) = self {
            series.diverged_at(lane, k);
        }
    }
}

/// Keeps every channel at every sample.
pub struct Series {
    pub samples: usize,
    /// Channel after channel, each with its samples.
    pub lanes: Vec<Lanes>,
}

impl Series {
    pub fn new(group: &Group, samples: usize) -> Self {
        Series { samples, lanes: vec![Lanes::ZERO; group.readings.len() * samples] }
    }

    /// Zero from where the lane's channels leave every scale: what overflows here would be NaN behind a filter.
    fn diverged_at(&mut self, lane: usize, k: usize) {
        let channels = self.lanes.len() / self.samples;
        let mut gone = false;
        for k in k.saturating_sub(CHECK_INTERVAL)..=k {
            let at = |c: usize| c * self.samples + k;
            gone |= (0..channels).any(|c| self.lanes[at(c)].0[lane].abs().total_cmp(&OVERFLOW_LIMIT).is_gt());
            for c in 0..if gone { channels } else { 0 } {
                let at = at(c);
                self.lanes[at].0[lane] = 0.0;
            }
        }
    }
}
