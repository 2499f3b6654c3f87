//! The track that the leading wheelset has met, for the wheelsets behind it.
use std::collections::VecDeque;

/// Irregularities of the track: lateral deviation, cross-level, gauge.
const IRREGULARITIES: usize = 3;

/// Rounding of a distance [m] that decides nothing: a wheelset at the first sample is on the track.
const START_TOLERANCE: f64 = 1e-9;

/// Values and slopes along the track of yw, phiw and gauge at one place.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TrackSample {
    pub s: f64,
    pub value: [f64; IRREGULARITIES],
    pub slope: [f64; IRREGULARITIES],
}

impl TrackSample {
    /// The entries of a wheelset in a row of the input table: yw, dyw/ds, phiw, dphiw/ds, gauge.
    pub fn columns(&self) -> [f64; 5] {
        let ([yw, phiw, gauge], [dyw, dphiw, _]) = (self.value, self.slope);
        [yw, dyw, phiw, dphiw, gauge]
    }

    /// The track at s between this sample and the next: the cubic with the values and slopes of both.
    fn between(&self, next: &TrackSample, s: f64) -> TrackSample {
        let h = next.s - self.s;
        let x = (s - self.s) / h;
        let mut found = TrackSample { s, ..TrackSample::default() };
        for i in 0..IRREGULARITIES {
            let (rise, first, last) = (next.value[i] - self.value[i], h * self.slope[i], h * next.slope[i]);
            // y_0 + x (m_0 + x (3 d - 2 m_0 - m_1 + x (m_0 + m_1 - 2 d))), d = y_1 - y_0, m = h y'
            let (square, cube) = (3.0 * rise - 2.0 * first - last, first + last - 2.0 * rise);
            found.value[i] = self.value[i] + x * (first + x * (square + x * cube));
            found.slope[i] = (first + x * (2.0 * square + x * 3.0 * cube)) / h;
        }
        found
    }
}

/// Samples in the order of s, as far back as the last wheelset needs them.
#[derive(Clone, Debug, Default)]
pub struct History {
    samples: VecDeque<TrackSample>,
    first: TrackSample,
}

impl History {
    /// Append a sample; forget those more than `reach` behind it, but one.
    pub fn push(&mut self, sample: TrackSample, reach: f64) {
        if self.samples.is_empty() {
            self.first = sample;
        }
        self.samples.push_back(sample);
        while self.samples.len() > 3 && self.samples[2].s < sample.s - reach {
            self.samples.pop_front();
        }
    }

    /// The last two samples.
    pub fn last_interval(&self) -> Option<[TrackSample; 2]> {
        let n = self.samples.len();
        (n > 1).then(|| [self.samples[n - 2], self.samples[n - 1]])
    }

    /// The track at s; before the first sample its first value, without a slope.
    pub fn at(&self, s: f64) -> TrackSample {
        let end = self.samples.len() - 1;
        if s <= self.first.s || end == 0 {
            let slope = if s < self.first.s - START_TOLERANCE { Default::default() } else { self.first.slope };
            return TrackSample { s, slope, ..self.first };
        }
        let next = self.samples.partition_point(|sample| sample.s < s).clamp(1, end);
        let [here, there] = [&self.samples[next - 1], &self.samples[next]];
        if s == there.s { *there } else { here.between(there, s) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cubic(s: f64) -> TrackSample {
        let value = [s * s * s - s, 2.0 * s * s, 0.5 * s];
        TrackSample { s, value, slope: [3.0 * s * s - 1.0, 4.0 * s, 0.5] }
    }

    #[test]
    fn a_cubic_is_met_exactly_between_its_samples() {
        let mut history = History::default();
        (0..40).for_each(|k| history.push(cubic(0.1 * k as f64), 2.5));
        for s in [1.42, 2.5, 3.333, 3.9] {
            let (found, expected) = (history.at(s), cubic(s));
            for i in 0..IRREGULARITIES {
                assert!((found.value[i] - expected.value[i]).abs() < 1e-13, "{found:?}");
                assert!((found.slope[i] - expected.slope[i]).abs() < 1e-12, "{found:?}");
            }
        }
        assert!(history.samples.len() < 30);
    }

    #[test]
    fn before_the_first_sample_the_track_has_its_value_and_no_slope() {
        let mut history = History::default();
        (0..3).for_each(|k| history.push(cubic(1.0 + k as f64), 9.0));
        assert_eq!(history.at(0.0).columns(), [0.0, 0.0, 2.0, 0.0, 0.5]);
        assert_eq!(history.at(1.0), cubic(1.0));
    }
}
