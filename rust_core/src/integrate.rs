//! RK4 steps of a group along an input table.
use crate::error::{Error, Result, expect_len};
use crate::fused::FusedVehicle;
use crate::lanes::{Job, LANES, Lanes, Level, Part, dispatch, level};
use crate::plain::{BOGIE_COLUMNS, BogieAtSpeed, CROSS_LEVEL, PlainBogie};
use crate::ride::{Growing, Sums};
use crate::vehicle::{Group, STATES, Signal};
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
const APART: usize = 16;

/// x and the states x_2, x_3 at which the next slopes are taken, x_4 in the room of x_2; all four slopes k_1 .. k_4.
#[repr(C)]
struct Room<P> {
    states: [([P; STATES], [P; APART]); 3],
    slopes: [([P; STATES], [P; APART]); 4],
}

impl<P: Part> Room<P> {
    #[inline(always)]
    fn new() -> Self {
        let all = ([P::zero(); STATES], [P::zero(); APART]);
        Room { states: [all; 3], slopes: [all; 4] }
    }
}

/// Which parts of the lanes step in turns: none, where the first cache has no room for more; whole ones; or those of one
/// register, where a rate has more numbers at hand than there are registers.
enum Turns {
    None,
    Parts,
    Singles,
}

/// A form of the rate of change that is compiled on its own, with its own step loop.
trait Form {
    /// Only forms that every machine needs are compiled for those without AVX2: these are slow anyhow.
    const PORTABLE: bool;
    const TURNS: Turns = Turns::None;
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
    const TURNS: Turns = if SPIN { Turns::Singles } else { Turns::Parts };

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
    fn rate(&mut self, index: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        self.bogie.rate::<LAWS, SPIN>(index, row, &mut self.at_speed, x, dx);
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
    fn run<P: Part>(self) {
        match F::TURNS {
            Turns::None => self.0.abreast::<P, F>(P::WIDTH),
            Turns::Parts => self.0.abreast::<P, F>(LANES),
            Turns::Singles => self.0.abreast::<P::Single, F>(P::WIDTH),
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

    /// So many lanes abreast, in parts of one register each.
    #[inline(always)]
    fn abreast<P: Part, F: Form>(mut self, lanes: usize) {
        for from in (0..self.live).step_by(lanes) {
            let ats = (from..(from + lanes).min(self.live)).step_by(P::WIDTH);
            let part = |at: usize| Stepping::new(&self, at, F::part::<P>(self.group, self.course, at));
            let mut parts: Vec<_> = ats.map(part).collect();
            self.along(&mut parts);
        }
    }

    /// RK4 along the course for some parts of the lanes in turns: while one waits for its square roots, the next goes on.
    #[inline(always)]
    fn along<P: Part, M: Moving<P>>(&mut self, parts: &mut [Stepping<'_, P, M>]) {
        let (group, course) = (self.group, self.course);
        let (samples, steps) = (course.samples(), course.steps);
        let mut h = Lanes::from_fn(|l| course.dt / steps as f64 * group.inv_speed_scale.0[l]);
        // one call of rate() in all: its code stays in the cache of decoded instructions
        for k in 0..samples {
            let last = k + 1 == samples;
            if k % LOOK == 0 || last {
                if self.cancel.load(Ordering::Relaxed) {
                    return;
                }
                for part in &mut *parts {
                    look(
                        group,
                        part.at,
                        k,
                        course.row(2 * steps * k),
                        &mut part.room.states[0].0,
                        &mut h,
                        self.diverged,
                    );
                    part.pace(P::load(&h, part.at));
                }
            }
            for step in 0..if last { 1 } else { steps } {
                let begin = 2 * (steps * k + step);
                for turn in 0..if last { 1 } else { 4_usize } {
                    let index = begin + turn.div_ceil(2);
                    let row = course.row(index);
                    for part in &mut *parts {
                        part.rate(turn, index, row);
                        match turn {
                            0 => part.ahead::<0>(turn),
                            1 => part.ahead::<1>(turn),
                            2 => part.ahead::<2>(turn),
                            _ => part.step(turn),
                        }
                        if turn == 0 && step == 0 {
                            part.sample(k, row, self.watch);
                        }
                        if turn == 3 {
                            group.settle(part.at, &mut part.room.states[0].0);
                        }
                    }
                }
            }
        }
        for part in parts {
            if let (Watch::Sums(sums), Watching::Sums(growing)) = (&mut *self.watch, &part.watching) {
                growing.store(sums, part.at);
            }
        }
    }
}

/// A part of the lanes on its way.
struct Stepping<'a, P, M> {
    at: usize,
    moving: M,
    /// How far the states k_2, k_3, k_4 are ahead, and h/6, h^2/6.
    ahead: [P; 3],
    sixth: [P; 2],
    room: Room<P>,
    watching: Watching<'a, P>,
}

/// What watches a part of the lanes.
enum Watching<'a, P> {
    /// Every channel.
    Series(Vec<Signal<'a, P>>),
    Sums(Growing<'a, P>),
}

impl<'a, P: Part, M: Moving<P>> Stepping<'a, P, M> {
    #[inline(always)]
    fn new(run: &Run<'a, '_>, at: usize, moving: M) -> Self {
        let mut room = Room::new();
        for (x, start) in room.states[0].0.iter_mut().zip(run.initial) {
            *x = P::load(start, at);
        }
        let watching = match &run.watch {
            Watch::Sums(sums) => Watching::Sums(Growing::new(sums, run.group, at)),
            Watch::Series(_) => Watching::Series(run.group.readings.iter().map(|reading| reading.part(at)).collect()),
        };
        Stepping { at, moving, ahead: [P::zero(); 3], sixth: [P::zero(); 2], room, watching }
    }

    #[inline(always)]
    fn pace(&mut self, h: P) {
        let half = h * P::splat(0.5);
        let sixth = h * P::splat(1.0 / 6.0);
        (self.ahead, self.sixth) = ([half, half, h], [sixth, sixth * h]);
    }

    #[inline(always)]
    fn rate(&mut self, turn: usize, index: usize, row: &[f64]) {
        let Room { states, slopes } = &mut self.room;
        let state = if turn == 3 { 1 } else { turn };
        self.moving.rate(index, row, &states[state].0, &mut slopes[turn].0);
    }

    #[inline(always)]
    fn sample(&mut self, k: usize, row: &[f64], watch: &mut Watch<'_>) {
        let (x, dx) = (&self.room.states[0].0, &self.room.slopes[0].0);
        match (&mut self.watching, watch) {
            (Watching::Sums(growing), _) => growing.sample(row, x, dx),
            (Watching::Series(signals), Watch::Series(series)) => {
                for (c, signal) in signals.iter().enumerate() {
                    signal.read(row, x, dx).store(&mut series.lanes[c * series.samples + k], self.at);
                }
            }
            (Watching::Series(_), Watch::Sums(_)) => {}
        }
    }

    /// To the velocities and own states where the next slope is taken, and to the positions where that after it is taken.
    #[inline(always)]
    fn ahead<const TURN: usize>(&mut self, turn: usize) {
        let (n, states) = self.moving.size();
        let (n, states) = (n.min(STATES / 2), states.min(STATES));
        let (to, slopes) = (self.ahead[TURN], &self.room.slopes[turn].0);
        let [(x, _), (second, _), (third, _)] = &mut self.room.states;
        // slices of one length: their indices are not checked
        let (q, v, k) = (&x[..n], &x[n..2 * n], &slopes[n..2 * n]);
        if TURN == 0 {
            let next_q = &mut second[..n];
            for i in 0..n {
                next_q[i] = to.mul_add(v[i], q[i]);
            }
        }
        let (here, beyond) = if TURN == 1 { (third, second) } else { (second, third) };
        let (next_v, next_own) = here[n..states].split_at_mut(n);
        if TURN < 2 {
            let (after, next_q) = (self.ahead[(TURN + 1) % 3], &mut beyond[..n]);
            for i in 0..n {
                next_v[i] = to.mul_add(k[i], v[i]);
                next_q[i] = after.mul_add(next_v[i], q[i]);
            }
        } else {
            for i in 0..n {
                next_v[i] = to.mul_add(k[i], v[i]);
            }
        }
        let (own, k) = (&x[2 * n..states], &slopes[2 * n..states]);
        for i in 0..states - 2 * n {
            next_own[i] = to.mul_add(k[i], own[i]);
        }
    }

    /// x + h/6 (k_1 + 2 k_2 + 2 k_3 + k_4), and of positions q + h v + h^2/6 (k_1 + k_2 + k_3) with the slopes of v.
    #[inline(always)]
    fn step(&mut self, turn: usize) {
        let (n, states) = self.moving.size();
        let (n, states) = (n.min(STATES / 2), states.min(STATES));
        let ([sixth, square], h) = (self.sixth, self.ahead[2]);
        let Room { states: [(x, _), ..], slopes } = &mut self.room;
        let (moving, own) = x[..states].split_at_mut(2 * n);
        let (q, v) = moving.split_at_mut(n);
        let (k_1, own_1) = slopes[0].0[n..states].split_at(n);
        let (k_2, own_2) = slopes[1].0[n..states].split_at(n);
        let (k_3, own_3) = slopes[2].0[n..states].split_at(n);
        let (k_4, own_4) = slopes[turn & 3].0[n..states].split_at(n);
        for i in 0..n {
            let middle = k_2[i] + k_3[i];
            let sum = k_1[i] + middle;
            q[i] = square.mul_add(sum, h.mul_add(v[i], q[i]));
            v[i] = sixth.mul_add(sum + (middle + k_4[i]), v[i]);
        }
        for i in 0..states - 2 * n {
            let middle = own_2[i] + own_3[i];
            own[i] = sixth.mul_add((own_1[i] + middle) + (middle + own_4[i]), own[i]);
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
