//! Output of a run: every channel at every sample, or sums.
use crate::integrate::ride_statistics::RideSums;
use crate::simd::level;

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
    /// Discard the series of a diverged lane since the last check; its sums are void.
    pub fn diverged_at(&mut self, lane: usize, k: usize) {
        if let Recorder::Series(series) = self {
            series.diverged_at(lane, k);
        }
    }
}

/// Every channel of a group at every sample.
pub struct Series {
    pub samples: usize,
    /// Vehicles side by side: as few as the widest part takes at once, so that the series stay in the cache.
    pub width: usize,
    /// [channel][sample][lane]
    pub(super) values: Vec<f64>,
}

impl Series {
    pub fn new(channels: usize, samples: usize, live: usize) -> Self {
        Series::in_memory(Vec::new(), channels, samples, live)
    }

    /// In memory that held another series: fresh pages cost more than the steps that fill them.
    pub fn in_memory(mut values: Vec<f64>, channels: usize, samples: usize, live: usize) -> Self {
        let width = live.next_multiple_of(level().filled(live).widest());
        values.resize(channels * samples * width, 0.0);
        Series { samples, width, values }
    }

    pub fn into_memory(self) -> Vec<f64> {
        self.values
    }

    pub fn channels(&self) -> impl Iterator<Item = &[f64]> {
        self.values.chunks_exact((self.samples * self.width).max(1))
    }

    pub fn channel_mut(&mut self, channel: usize) -> &mut [f64] {
        let size = self.samples * self.width;
        &mut self.values[channel * size..(channel + 1) * size]
    }

    pub fn value(&self, channel: usize, k: usize, lane: usize) -> f64 {
        self.values[(channel * self.samples + k) * self.width + lane]
    }

    /// Zero from where the lane's channels leave every scale: what overflows here would be NaN behind a filter.
    fn diverged_at(&mut self, lane: usize, k: usize) {
        let channels = self.channels().count();
        let mut gone = false;
        for k in k.saturating_sub(CHECK_INTERVAL)..=k {
            gone |= (0..channels).any(|c| self.value(c, k, lane).abs().total_cmp(&OVERFLOW_LIMIT).is_gt());
            for c in 0..if gone { channels } else { 0 } {
                self.lanes_mut(c, k, lane)[0] = 0.0;
            }
        }
    }
}
