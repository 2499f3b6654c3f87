//! RK4 steps of a group along an input table.
use crate::error::{Error, Result, expect_len};
use crate::fused::FusedVehicle;
use crate::lanes::{Job, LANES, Lanes, Level, Part, dispatch, level};
use crate::plain::{BOGIE_COLUMNS, BogieAtSpeed, CROSS_LEVEL, PlainBogie};
use crate::ride::Sums;
use crate::vehicle::{Group, STATES};
use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, Ordering};

/// One row per half step, so that RK4 finds t, t + h/2 and t + h; see `input_table` of the track.
#[derive(Clone, Copy, Debug)]
pub struct Course<'a> {
    pub table: &'a [f64],
    pub columns: usize,
    /// RK4 steps per sample.
    pub steps: usize,
    /// Time between samples [s] at speed scale 1.
    pub dt: f64,
    /// Is there no cross-level anywhere?
    pub level: bool,
}

impl<'a> Course<'a> {
    /// A table of a bogie is searched for cross-level; of other vehicles nobody asks.
    pub fn new(table: &'a [f64], columns: usize, steps: usize, dt: f64) -> Self {
        let level = |row: &[f64]| CROSS_LEVEL.iter().all(|i| row[*i] == 0.0);
        let level = columns == BOGIE_COLUMNS && table.chunks_exact(columns).all(level);
        Course { table, columns, steps, dt, level }
    }

    pub fn samples(&self) -> usize {
        (self.table.len() / self.columns - 1) / (2 * self.steps) + 1
    }

    #[inline(always)]
    fn row(&self, i: usize) -> &[f64] {
        &self.table[i * self.columns..(i + 1) * self.columns]
    }

    pub fn check(&self, columns: usize) -> Result<()> {
        expect_len("columns of the input table", self.columns, columns)?;
        let rows = self.table.len() / self.columns.max(1);
        if rows == 0 || self.steps == 0 || !(rows - 1).is_multiple_of(2 * self.steps) {
            let expected = 2 * self.steps * (rows.saturating_sub(1) / (2 * self.steps).max(1)) + 1;
            return Err(Error::Shape { what: "rows of the input table".into(), got: rows, expected });
        }
        Ok(())
    }
}

/// What watches the steps. Not a type parameter: so the step loop is compiled once for both.
pub enum Watch<'a> {
    Series(&'a mut Series),
    Sums(&'a mut Sums),
}

impl Watch<'_> {
    /// Called at every sample with the state, its rate and the input row.
    #[inline(always)]
    fn sample<P: Part>(&mut self, group: &Group, at: usize, k: usize, row: &[f64], x: &[P; STATES], dx: &[P; STATES]) {
        match self {
            Watch::Series(series) => series.sample(group, at, k, row, x, dx),
            Watch::Sums(sums) => sums.sample(group, at, k, row, x, dx),
        }
    }

    /// A lane was found off the rails at a sample; what it did since the last look is not worth keeping.
    fn lost(&mut self, lane: usize, k: usize) {
        if let Watch::Series(series) = self {
            series.lost(lane, k);
        }
    }
}

/// Samples between two looks at divergence and cancellation.
const LOOK: usize = 64;

/// No channel of a vehicle reaches this.
const WILD: f64 = 1e12;

/// Run sixteen vehicles (the first `live` count) from `initial` (one entry per state; none: at rest).
/// Returns per lane the sample at which it was found diverged; its state is zero from there on.
pub fn run(
    group: &Group,
    course: &Course<'_>,
    initial: &[Lanes],
    live: usize,
    mut watch: Watch<'_>,
    cancel: &AtomicBool,
) -> Result<[Option<usize>; LANES]> {
    course.check(group.columns)?;
    let mut diverged = [None; LANES];
    Run { group, course, initial, live, watch: &mut watch, cancel, diverged: &mut diverged }.begin();
    for (lane, k) in diverged.iter().enumerate() {
        if let Some(k) = k {
            watch.lost(lane, *k);
        }
    }
    if cancel.load(Ordering::Relaxed) { Err(Error::Interrupted) } else { Ok(diverged) }
}

/// The states of a step, set apart: at distances of 4096 bytes loads and stores would take each other for the same, and
/// all would want the same few lines of the first cache.
const APART: usize = 37;

#[repr(C)]
struct Room<P> {
    x: [P; STATES],
    apart: [P; APART],
    stages: [([P; STATES], [P; APART]); 3],
    dx: [P; STATES],
}

impl<P: Part> Room<P> {
    #[inline(always)]
    fn new() -> Self {
        let (all, apart) = ([P::zero(); STATES], [P::zero(); APART]);
        Room { x: all, apart, stages: [(all, apart); 3], dx: all }
    }
}

/// A form of the rate of change that is compiled on its own, with its own step loop.
trait Form {
    /// Only forms that every machine needs are compiled for those without AVX2: these are slow anyhow.
    const PORTABLE: bool;
    /// The lanes of a group from `at` on.
    fn part<'a, P: Part>(group: &'a Group, course: &Course<'_>, at: usize) -> impl Moving<P> + 'a;
}

/// A group as the step loop sees it: its size, known when compiled or not, and its rate of change.
trait Moving<P: Part> {
    /// Degrees of freedom and states.
    fn size(&self) -> (usize, usize);
    /// At a row of the input table, which stands at this index.
    fn rate(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]);
}

/// Any structure.
struct General;

impl Form for General {
    const PORTABLE: bool = true;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &Course<'_>, at: usize) -> impl Moving<P> + 'a {
        GeneralPart { group, at }
    }
}

struct GeneralPart<'a> {
    group: &'a Group,
    at: usize,
}

impl<P: Part> Moving<P> for GeneralPart<'_> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.group.dofs, self.group.states)
    }

    #[inline(always)]
    fn rate(&mut self, _: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        self.group.rate(self.at, row, x, dx);
    }
}

/// The bogie whose rate is fused, with or without laws at the contact, with or without spin and cross-level, with or
/// without laws at its suspensions.
struct Bogie<const LAWS: bool, const SPIN: bool, const PORTS: bool>;

impl<const LAWS: bool, const SPIN: bool, const PORTS: bool> Form for Bogie<LAWS, SPIN, PORTS> {
    const PORTABLE: bool = false;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, course: &Course<'_>, at: usize) -> impl Moving<P> + 'a {
        let bogie: PlainBogie<P> = group.plain.as_ref().expect("a plain bogie").part(at);
        let at_speed = bogie.at_speed(course.row(0)[1]);
        BogiePart::<P, LAWS, SPIN, PORTS> { group, bogie, at, at_speed }
    }
}

struct BogiePart<'a, P, const LAWS: bool, const SPIN: bool, const PORTS: bool> {
    group: &'a Group,
    bogie: PlainBogie<P>,
    at: usize,
    at_speed: BogieAtSpeed<P>,
}

impl<P: Part, const LAWS: bool, const SPIN: bool, const PORTS: bool> Moving<P> for BogiePart<'_, P, LAWS, SPIN, PORTS> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (6, if PORTS { self.group.states } else { 12 })
    }

    #[inline(always)]
    fn rate(&mut self, _: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        self.bogie.rate::<LAWS, SPIN>(row, &mut self.at_speed, x, dx);
        if PORTS {
            self.group.act::<P, true>(self.at, row, x, dx);
        }
    }
}

/// Another vehicle whose contacts are fused, with or without laws there.
struct Fused<const LAWS: bool>;

impl<const LAWS: bool> Form for Fused<LAWS> {
    const PORTABLE: bool = false;

    #[inline(always)]
    fn part<'a, P: Part>(group: &'a Group, _: &Course<'_>, at: usize) -> impl Moving<P> + 'a {
        let contacts = group.contacts.as_ref().expect("fused contacts");
        FusedPart::<P, LAWS>(FusedVehicle::new(group, contacts, at), group)
    }
}

struct FusedPart<'a, P, const LAWS: bool>(FusedVehicle<'a, P>, &'a Group);

impl<P: Part, const LAWS: bool> Moving<P> for FusedPart<'_, P, LAWS> {
    #[inline(always)]
    fn size(&self) -> (usize, usize) {
        (self.1.dofs, self.1.states)
    }

    #[inline(always)]
    fn rate(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        self.0.rate::<LAWS>(index, row, x, dx);
    }
}

struct Run<'a, 'w> {
    group: &'a Group,
    course: &'a Course<'a>,
    initial: &'a [Lanes],
    live: usize,
    watch: &'a mut Watch<'w>,
    cancel: &'a AtomicBool,
    diverged: &'a mut [Option<usize>; LANES],
}

/// A run in one form.
struct Along<'a, 'w, F>(Run<'a, 'w>, PhantomData<F>);

impl<F: Form> Job for Along<'_, '_, F> {
    type Output = ();
    const PORTABLE: bool = F::PORTABLE;

    #[inline(always)]
    fn run<P: Part>(mut self) {
        let Run { group, course, live, cancel, .. } = self.0;
        for at in (0..LANES).step_by(P::WIDTH) {
            if at >= live || cancel.load(Ordering::Relaxed) {
                break;
            }
            self.0.along::<P>(at, F::part::<P>(group, course, at));
        }
    }
}

impl Run<'_, '_> {
    /// In the form that fits the group.
    fn begin(self) {
        let group = self.group;
        let ports = !group.forces.is_empty();
        if level() == Level::Portable {
            return self.within::<General>();
        }
        if let Some(bogie) = &group.plain {
            return match (bogie.laws, bogie.spin || !self.course.level, ports) {
                (true, _, true) => self.within::<Bogie<true, true, true>>(),
                (false, _, true) => self.within::<Bogie<false, true, true>>(),
                (true, true, false) => self.within::<Bogie<true, true, false>>(),
                (false, true, false) => self.within::<Bogie<false, true, false>>(),
                (_, false, false) => self.within::<Bogie<true, false, false>>(),
            };
        }
        match (&group.contacts, group.touches()) {
            (Some(_), true) => self.within::<Fused<true>>(),
            (Some(_), false) => self.within::<Fused<false>>(),
            (None, _) => self.within::<General>(),
        }
    }

    fn within<F: Form>(self) {
        dispatch(level(), Along::<F>(self, PhantomData));
    }

    /// RK4 along the course for one part of the lanes: with x_2, x_3, x_4 the states at which the slopes k_2, k_3, k_4
    /// are taken, x + h/6 (k_1 + 2 k_2 + 2 k_3 + k_4) = (x_2 + 2 x_3 + x_4 - x)/3 + h/6 k_4, which needs no sums.
    #[inline(always)]
    fn along<P: Part>(&mut self, at: usize, mut moving: impl Moving<P>) {
        let (group, course) = (self.group, self.course);
        let (samples, steps, (n, states)) = (course.samples(), course.steps, moving.size());
        let mut room = Room::new();
        let Room { x, stages, dx, .. } = &mut room;
        for (i, x) in x.iter_mut().enumerate() {
            *x = if i < self.initial.len() { P::load(&self.initial[i], at) } else { P::zero() };
        }
        let mut h = Lanes::from_fn(|l| course.dt / steps as f64 * group.inv_speed_scale.0[l]);
        let (two, third) = (P::splat(2.0), P::splat(1.0 / 3.0));
        // one call of rate() in all: its code stays in the cache of decoded instructions
        for k in 0..samples {
            if k % LOOK == 0 || k + 1 == samples {
                if self.cancel.load(Ordering::Relaxed) {
                    return;
                }
                look(group, at, k, course.row(2 * steps * k), x, &mut h, self.diverged);
            }
            let h = P::load(&h, at);
            let half = h * P::splat(0.5);
            let sixth = h * P::splat(1.0 / 6.0);
            for step in 0..steps {
                let begin = 2 * (steps * k + step);
                for turn in 0..4_usize {
                    let index = begin + turn.div_ceil(2);
                    let row = course.row(index);
                    let here: &[P; STATES] = if turn == 0 { x } else { &stages[turn - 1].0 };
                    moving.rate(index, row, here, dx);
                    if turn == 0 && step == 0 {
                        self.watch.sample(group, at, k, row, x, dx);
                        if k + 1 == samples {
                            return;
                        }
                    }
                    // the positions' slopes are the velocities
                    if turn < 3 {
                        let ahead = if turn == 2 { h } else { half };
                        for i in 0..n {
                            let slope = if turn == 0 { x[(n + i) & 63] } else { stages[turn - 1].0[(n + i) & 63] };
                            stages[turn].0[i & 63] = ahead.mul_add(slope, x[i & 63]);
                        }
                        for i in n..states {
                            stages[turn].0[i & 63] = ahead.mul_add(dx[i & 63], x[i & 63]);
                        }
                    }
                }
                let [(x_2, _), (x_3, _), (x_4, _)] = &*stages;
                for i in 0..states {
                    let slope = if i < n { x_4[(n + i) & 63] } else { dx[i & 63] };
                    let sum = two.mul_add(x_3[i & 63], x_2[i & 63] + x_4[i & 63]) - x[i & 63];
                    x[i & 63] = third.mul_add(sum, sixth * slope);
                }
                group.settle(at, x);
            }
        }
    }
}

/// Is a lane still on the rails? abs(e_i) and abs(psi_i) within the limit, everything finite; else it is put to rest.
#[inline(always)]
fn look<P: Part>(
    group: &Group,
    at: usize,
    k: usize,
    row: &[f64],
    x: &mut [P; STATES],
    h: &mut Lanes,
    diverged: &mut [Option<usize>; LANES],
) {
    let mut values = [Lanes::ZERO; STATES];
    for i in 0..group.states {
        x[i].store(&mut values[i], at);
    }
    let mut lost = false;
    for (lane, lost_at) in diverged.iter_mut().enumerate().skip(at).take(P::WIDTH) {
        let of = |i: usize| values[i].0[lane];
        let on_rails = if group.wheelsets.is_empty() {
            (0..group.dofs).all(|i| of(i).abs() <= group.limit)
        } else {
            group.wheelsets.iter().all(|w| {
                let e = of(w.y) - row[w.column] - w.r.0[lane] * row[w.column + 2];
                e.abs() <= group.limit && of(w.psi).abs() <= group.limit
            })
        };
        if lost_at.is_none() && (!on_rails || (0..group.states).any(|i| !of(i).is_finite())) {
            *lost_at = Some(k);
            h.0[lane] = 0.0;
            for value in values[..group.states].iter_mut() {
                value.0[lane] = 0.0;
            }
            lost = true;
        }
    }
    if lost {
        for i in 0..group.states {
            x[i] = P::load(&values[i], at);
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
}

impl Series {
    #[inline(always)]
    fn sample<P: Part>(&mut self, group: &Group, at: usize, k: usize, row: &[f64], x: &[P; STATES], dx: &[P; STATES]) {
        for (c, reading) in group.readings.iter().enumerate() {
            reading.read(at, row, x, dx).store(&mut self.lanes[c * self.samples + k], at);
        }
    }

    /// Zero from where the lane's channels leave every scale: what overflows here would be NaN behind a filter.
    fn lost(&mut self, lane: usize, k: usize) {
        let channels = self.lanes.len() / self.samples;
        let mut gone = false;
        for k in k.saturating_sub(LOOK)..=k {
            let at = |c: usize| c * self.samples + k;
            gone |= (0..channels).any(|c| self.lanes[at(c)].0[lane].abs().total_cmp(&WILD).is_gt());
            for c in 0..if gone { channels } else { 0 } {
                let at = at(c);
                self.lanes[at].0[lane] = 0.0;
            }
        }
    }
}
