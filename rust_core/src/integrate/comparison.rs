//! From simulated series to what is compared with a measurement: sensor laws, band-pass, cut, weight.
use crate::effects::effect::Alteration;
use crate::error::{Error, Result, expect_len};
use crate::integrate::recorder::Series;
use crate::simd::{Job, LANES, Part, dispatch, level};
use crate::vehicle::group::Group;

/// Zero-phase band-pass as `scipy.signal.sosfiltfilt`, then `cut` samples off both ends, then a weight per channel.
#[derive(Clone, Debug)]
pub struct Filter {
    /// Sections [b0, b1, b2, a0, a1, a2]; none: only the mean is removed.
    pub sos: Vec<[f64; 6]>,
    /// Steady state of each section for a unit input, `scipy.signal.sosfilt_zi`.
    pub zi: Vec<[f64; 2]>,
    /// Samples of odd extension at both ends.
    pub pad: usize,
    pub cut: usize,
    /// One per channel.
    pub weights: Vec<f64>,
    /// Keep every n-th sample.
    pub every: usize,
}

impl Filter {
    /// Samples of a channel that are left of so many.
    pub fn kept_samples(&self, samples: usize) -> usize {
        samples.saturating_sub(2 * self.cut).div_ceil(self.every)
    }

    /// Does the filter fit so many channels of so many samples?
    pub fn check(&self, channels: usize, samples: usize) -> Result<()> {
        expect_len("weights", self.weights.len(), channels)?;
        expect_len("initial states of the filter", self.zi.len(), self.sos.len())?;
        if self.every == 0 {
            return Err(Error::Value {
                what: "samples from one retained sample to the next".into(),
                value: 0.0,
                rule: "positive",
            });
        }
        if samples <= self.pad || samples <= 2 * self.cut {
            let what = "samples of a segment".to_string();
            return Err(Error::Shape { what, got: samples, expected: self.pad.max(2 * self.cut) + 1 });
        }
        Ok(())
    }
}

/// Sensor laws on the simulated channels: x(t) -> gain x(t - delay) + offset.
pub fn apply_sensors(group: &Group, series: &mut Series, live: usize, dt: f64) {
    let width = series.width;
    // in the order of the formula, however they are listed
    for alteration in Alteration::ALL {
        for (_, channel, number) in group.sensors.iter().filter(|(other, ..)| *other == alteration) {
            let Some(c) = group.readings.iter().position(|r| r.name == *channel) else { continue };
            let x = series.channel_mut(c);
            for l in 0..live {
                let lane = x.iter_mut().skip(l).step_by(width);
                match alteration {
                    Alteration::Gain => lane.for_each(|x| *x *= number.0[l]),
                    Alteration::Offset => lane.for_each(|x| *x += number.0[l]),
                    Alteration::Delay => delay(lane.collect(), number.0[l] / dt),
                }
            }
        }
    }
}

/// x(k) -> x(k - by), eight-point Lagrange interpolation, constant beyond the ends.
fn delay(x: Vec<&mut f64>, by: f64) {
    if by == 0.0 {
        return;
    }
    let whole_samples = by.floor();
    let part = by - whole_samples;
    // nodes at -3 .. 4 from the sample before k - by, which lies 1 - part behind it
    let weights: [f64; 8] = std::array::from_fn(|i| {
        (0..8).filter(|j| *j != i).map(|j| ((1.0 - part) - (j as f64 - 3.0)) / (i as f64 - j as f64)).product()
    });
    let last = x.len() as i64 - 1;
    let old: Vec<f64> = x.iter().map(|x| **x).collect();
    for (k, x) in x.into_iter().enumerate() {
        let base = k as i64 - whole_samples as i64 - 1;
        *x = (0..8).map(|i| weights[i] * old[(base + i as i64 - 3).clamp(0, last) as usize]).sum();
    }
}

/// Write the series of the first `live` vehicles as rows: [vehicle][channel][sample].
pub fn as_rows(series: &Series, live: usize, out: &mut [f64]) {
    let (samples, width) = (series.samples, series.width);
    let row = out.len() / live;
    for (c, x) in series.channels().enumerate() {
        for (block, begin) in x.chunks(BLOCK * width).zip((0..samples).step_by(BLOCK)) {
            scatter(block, width, live, &mut out[c * samples + begin..], row);
        }
    }
}

/// Samples that are written to the rows of all lanes at once: they stay in the first cache.
const BLOCK: usize = 64;

/// A block [sample][lane] of a series to the rows of its vehicles.
fn scatter(block: &[f64], width: usize, live: usize, out: &mut [f64], row: usize) {
    let n = block.len() / width;
    for lane in 0..live {
        for (to, from) in out[lane * row..lane * row + n].iter_mut().zip(block[lane..].iter().step_by(width)) {
            *to = *from;
        }
    }
}

/// Write the filtered, cut and weighted series of the first `live` vehicles as rows: [vehicle][channel][kept sample].
pub fn filtered(series: &Series, live: usize, filter: &Filter, out: &mut [f64]) {
    dispatch(level().filled(live), FiltFilt { series, live, filter, out });
}

struct FiltFilt<'a> {
    series: &'a Series,
    live: usize,
    filter: &'a Filter,
    out: &'a mut [f64],
}

impl Job for FiltFilt<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Part>(self) {
        if self.live <= P::Single::WIDTH { self.parts::<P::Single>() } else { self.parts::<P>() }
    }
}

impl FiltFilt<'_> {
    /// A part of the vehicles after the other, each channel in a buffer of its own that stays in the cache.
    #[inline(always)]
    fn parts<P: Part>(self) {
        let FiltFilt { series, live, filter, out } = self;
        let samples = series.samples;
        let (row, kept_samples) = (out.len() / live, filter.kept_samples(samples));
        let pad = if filter.sos.is_empty() { 0 } else { filter.pad };
        let mut work = vec![P::zero(); samples + 2 * pad];
        let mut block = [0.0; BLOCK * LANES];
        for (c, x) in series.channels().enumerate() {
            for at in (0..live).step_by(P::WIDTH) {
                extend(&x[at..], series.width, &mut work, pad);
                if filter.sos.is_empty() {
                    centre(&mut work);
                } else {
                    pass(&sections(filter, work[0]), &mut work, false);
                    pass(&sections(filter, work[work.len() - 1]), &mut work, true);
                }
                let weight = P::splat(filter.weights[c]);
                for begin in (0..kept_samples).step_by(BLOCK) {
                    let n = BLOCK.min(kept_samples - begin);
                    for (k, to) in block[..n * P::WIDTH].chunks_exact_mut(P::WIDTH).enumerate() {
                        (work[pad + filter.cut + (begin + k) * filter.every] * weight).write(to);
                    }
                    let rows = &mut out[at * row + c * kept_samples + begin..];
                    scatter(&block[..n * P::WIDTH], P::WIDTH, (live - at).min(P::WIDTH), rows, row);
                }
            }
        }
    }
}

/// Odd extension at both ends of a series with so many lanes: 2 x_0 - x_k.
#[inline(always)]
fn extend<P: Part>(x: &[f64], width: usize, work: &mut [P], pad: usize) {
    let n = work.len() - 2 * pad;
    let sample = |k: usize| P::read(&x[k * width..]);
    let (first, last) = (sample(0), sample(n - 1));
    let two = P::splat(2.0);
    for k in 0..pad {
        work[k] = two * first - sample(pad - k);
        work[pad + n + k] = two * last - sample(n - 2 - k);
    }
    for (k, to) in work[pad..pad + n].iter_mut().enumerate() {
        *to = sample(k);
    }
}

#[inline(always)]
fn centre<P: Part>(work: &mut [P]) {
    let mut sum = P::zero();
    for x in work.iter() {
        sum = sum + *x;
    }
    let mean = sum * P::splat(1.0 / work.len() as f64);
    for x in work.iter_mut() {
        *x = *x - mean;
    }
}

/// A section of second order in the transposed form II, with what it remembers.
#[derive(Clone, Copy)]
struct Section<P> {
    b: [P; 3],
    a: [P; 2],
    memory: [P; 2],
}

impl<P: Part> Section<P> {
    #[inline(always)]
    fn step(&mut self, x: P) -> P {
        let ([b0, b1, b2], [a1, a2], [m0, m1]) = (self.b, self.a, self.memory);
        let y = b0.mul_add(x, m0);
        self.memory = [a1.neg_mul_add(y, b1.mul_add(x, m1)), a2.neg_mul_add(y, b2 * x)];
        y
    }
}

/// All sections in the steady state of a first value; zi of a later section holds the gain of those before it.
#[inline(always)]
fn sections<P: Part>(filter: &Filter, first: P) -> Vec<Section<P>> {
    let mut found = Vec::with_capacity(filter.sos.len());
    for ([b0, b1, b2, a0, a1, a2], zi) in filter.sos.iter().zip(&filter.zi) {
        let get = |b: &f64| P::splat(b / a0);
        let (b, a) = ([get(b0), get(b1), get(b2)], [get(a1), get(a2)]);
        found.push(Section { b, a, memory: [P::splat(zi[0]) * first, P::splat(zi[1]) * first] });
    }
    found
}

/// Sections that a sample passes at once: while one waits for its last result the others have work.
const AT_ONCE: usize = 4;

/// All sections over the whole work, forwards or backwards.
#[inline(always)]
fn pass<P: Part>(sections: &[Section<P>], work: &mut [P], backwards: bool) {
    for some in sections.chunks(AT_ONCE) {
        match <[Section<P>; AT_ONCE]>::try_from(some) {
            Ok(all) => along(all, work, backwards),
            Err(_) => some.iter().for_each(|one| along([*one], work, backwards)),
        }
    }
}

#[inline(always)]
fn along<P: Part, const N: usize>(mut sections: [Section<P>; N], work: &mut [P], backwards: bool) {
    let n = work.len();
    for k in 0..n {
        let here = &mut work[if backwards { n - 1 - k } else { k }];
        for section in &mut sections {
            *here = section.step(*here);
        }
    }
}
