//! A part of the lanes on its way: the states and slopes of a step of RK4, and what watches them.
use crate::integrate::recorder::Recorder;
use crate::integrate::sample::{RideAccumulator, Signal};
use crate::rate::Rate;
use crate::simd::{Lanes, Part, STATES};
use crate::vehicle::group::Group;

/// The states of a step, set apart: at distances of 4096 bytes loads and stores would take each other for the same, and
/// all would want the same few lines of the first cache.
const CACHE_PADDING: usize = 16;

/// x and the states x_2, x_3 at which the next slopes are taken, x_4 in the room of x_2; all four slopes k_1 .. k_4.
#[repr(C)]
struct Rk4Workspace<P> {
    states: [([P; STATES], [P; CACHE_PADDING]); 3],
    slopes: [([P; STATES], [P; CACHE_PADDING]); 4],
}

impl<P: Part> Rk4Workspace<P> {
    #[inline(always)]
    fn new() -> Self {
        let all = ([P::zero(); STATES], [P::zero(); CACHE_PADDING]);
        Rk4Workspace { states: [all; 3], slopes: [all; 4] }
    }
}

/// A part of the lanes on its way.
pub struct Rk4Part<'a, P, M> {
    at: usize,
    moving: M,
    /// Increments to the states of k_2, k_3, k_4, and h/6, h^2/6.
    ahead: [P; 3],
    sixth: [P; 2],
    room: Rk4Workspace<P>,
    watching: PartRecorder<'a, P>,
}

/// The states at which the slopes k_2, k_3, k_4 of a step are taken, and these: in straight code what fits stays in
/// registers.
pub struct Rk4Stages<P> {
    states: [[P; STATES]; 3],
    slopes: [[P; STATES]; 3],
}

impl<P: Part> Rk4Stages<P> {
    #[inline(always)]
    pub fn empty() -> Self {
        let none = [P::zero(); STATES];
        Rk4Stages { states: [none; 3], slopes: [none; 3] }
    }
}

/// Receiver of a part of the lanes.
enum PartRecorder<'a, P> {
    /// Every channel.
    Series(Vec<Signal<'a, P>>),
    RideSums(RideAccumulator<'a, P>),
}

impl<'a, P: Part, M: Rate<P>> Rk4Part<'a, P, M> {
    #[inline(always)]
    pub fn new(group: &'a Group, initial: &[Lanes], recorder: &Recorder<'_>, at: usize, moving: M) -> Self {
        let mut room = Rk4Workspace::new();
        for (x, start) in room.states[0].0.iter_mut().zip(initial) {
            *x = P::load(start, at);
        }
        let watching = match recorder {
            Recorder::RideSums(sums) => PartRecorder::RideSums(RideAccumulator::new(sums, group, at)),
            Recorder::Series(_) => {
                PartRecorder::Series(group.readings.iter().map(|reading| Signal::of(reading, at)).collect())
            }
        };
        Rk4Part { at, moving, ahead: [P::zero(); 3], sixth: [P::zero(); 2], room, watching }
    }

    #[inline(always)]
    pub fn set_step(&mut self, h: &Lanes) {
        let h = P::load(h, self.at);
        let half = h * P::splat(0.5);
        let sixth = h * P::splat(1.0 / 6.0);
        (self.ahead, self.sixth) = ([half, half, h], [sixth, sixth * h]);
    }

    #[inline(always)]
    pub fn rate(&mut self, turn: usize, index: usize, row: &[f64]) {
        let Rk4Workspace { states, slopes } = &mut self.room;
        let state = if turn == 3 { 1 } else { turn };
        self.moving.rate(index, row, &mut states[state].0, &mut slopes[turn].0);
    }

    #[inline(always)]
    pub fn sample(&mut self, k: usize, row: &[f64], recorder: &mut Recorder<'_>) {
        let (x, dx) = (&self.room.states[0].0, &self.room.slopes[0].0);
        match (&mut self.watching, recorder) {
            (PartRecorder::RideSums(growing), _) => growing.sample(row, x, dx),
            (PartRecorder::Series(signals), Recorder::Series(series)) => {
                for (c, signal) in signals.iter().enumerate() {
                    signal.read(row, x, dx).write(series.lanes_mut(c, k, self.at));
                }
            }
            (PartRecorder::Series(_), Recorder::RideSums(_)) => {}
        }
    }

    /// Hands over what has been summed.
    #[inline(always)]
    pub fn store(&self, recorder: &mut Recorder<'_>) {
        if let (Recorder::RideSums(sums), PartRecorder::RideSums(growing)) = (recorder, &self.watching) {
            growing.store(sums, self.at);
        }
    }

    /// Hold own states within their largest magnitude.
    #[inline(always)]
    pub fn clamp_own_states(&mut self, group: &Group) {
        let x = &mut self.room.states[0].0;
        for (i, limit) in &group.clamped_states {
            x[i % STATES] = x[i % STATES].clamp(P::load(limit, self.at));
        }
    }

    /// The state of the lanes, and where they begin.
    pub fn state(&mut self) -> (usize, &mut [P; STATES]) {
        (self.at, &mut self.room.states[0].0)
    }

    /// To the velocities and own states where the next slope is taken, and to the positions where that after it is taken.
    #[inline(always)]
    pub fn ahead<const TURN: usize>(&mut self, turn: usize) {
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

    /// h, h/6, h^2/6.
    #[inline(always)]
    fn lengths(&self) -> [P; 3] {
        [self.ahead[2], self.sixth[0], self.sixth[1]]
    }

    /// The step: x + h/6 (k_1 + 2 k_2 + 2 k_3 + k_4) of own states, positions and velocities as [`finish_step`].
    #[inline(always)]
    pub fn step(&mut self, turn: usize) {
        let (n, states) = self.moving.size();
        let (n, states) = (n.min(STATES / 2), states.min(STATES));
        let lengths @ [_, sixth, _] = self.lengths();
        let Rk4Workspace { states: [(x, _), ..], slopes } = &mut self.room;
        let (moving, own) = x[..states].split_at_mut(2 * n);
        let (q, v) = moving.split_at_mut(n);
        let (k_1, own_1) = slopes[0].0[n..states].split_at(n);
        let (k_2, own_2) = slopes[1].0[n..states].split_at(n);
        let (k_3, own_3) = slopes[2].0[n..states].split_at(n);
        let (k_4, own_4) = slopes[turn & 3].0[n..states].split_at(n);
        for i in 0..n {
            [q[i], v[i]] = finish_step(lengths, q[i], v[i], [k_1[i], k_2[i], k_3[i], k_4[i]]);
        }
        for i in 0..states - 2 * n {
            let middle = own_2[i] + own_3[i];
            own[i] = sixth.mul_add((own_1[i] + middle) + (middle + own_4[i]), own[i]);
        }
    }
}

/// Position and velocity at the end of a step of RK4 by the slopes k of the velocity, h, h/6, h^2/6 given:
/// q + h v + h^2/6 (k_1 + k_2 + k_3), v + h/6 (k_1 + 2 k_2 + 2 k_3 + k_4).
#[inline(always)]
fn finish_step<P: Part>([h, sixth, square]: [P; 3], q: P, v: P, [k_1, k_2, k_3, k_4]: [P; 4]) -> [P; 2] {
    let middle = k_2 + k_3;
    let sum = k_1 + middle;
    [square.mul_add(sum, h.mul_add(v, q)), sixth.mul_add(sum + (middle + k_4), v)]
}

/// A step of vehicles without states of their own, stage by stage, each at a row of the input table and its index.
impl<P: Part, M: Rate<P>> Rk4Part<'_, P, M> {
    /// k_1 at x, which is sampled, and the state at which k_2 is taken.
    #[inline(always)]
    pub fn first(
        &mut self,
        at: (usize, &[f64]),
        stages: &mut Rk4Stages<P>,
        sample: Option<usize>,
        recorder: &mut Recorder<'_>,
    ) {
        self.rate(0, at.0, at.1);
        if let Some(k) = sample {
            self.sample(k, at.1, recorder);
        }
        let n = self.moving.size().0.min(STATES / 2);
        let (half, x, k_1, next) =
            (self.ahead[0], &self.room.states[0].0, &self.room.slopes[0].0, &mut stages.states[0]);
        for i in 0..n {
            next[i] = half.mul_add(x[n + i], x[i]);
            next[n + i] = half.mul_add(k_1[n + i], x[n + i]);
        }
    }

    /// k_2 or k_3, and the state at which the slope after it is taken.
    #[inline(always)]
    pub fn next<const TURN: usize>(&mut self, at: (usize, &[f64]), stages: &mut Rk4Stages<P>) {
        let n = self.moving.size().0.min(STATES / 2);
        let (to, x) = (self.ahead[TURN], &self.room.states[0].0);
        let Rk4Stages { states, slopes } = stages;
        self.moving.rate(at.0, at.1, &mut states[TURN - 1], &mut slopes[TURN - 1]);
        for i in 0..n {
            states[TURN][i] = to.mul_add(states[TURN - 1][n + i], x[i]);
            states[TURN][n + i] = to.mul_add(slopes[TURN - 1][n + i], x[n + i]);
        }
    }

    /// k_4 and the step.
    #[inline(always)]
    pub fn last(&mut self, at: (usize, &[f64]), stages: &mut Rk4Stages<P>) {
        let n = self.moving.size().0.min(STATES / 2);
        let Rk4Stages { states: [.., x_4], slopes: [k_2, k_3, k_4] } = stages;
        self.moving.rate(at.0, at.1, x_4, k_4);
        let lengths = self.lengths();
        let Rk4Workspace { states: [(x, _), ..], slopes: [(k_1, _), ..] } = &mut self.room;
        for i in 0..n {
            let v = n + i;
            [x[i], x[v]] = finish_step(lengths, x[i], x[v], [k_1[v], k_2[v], k_3[v], k_4[v]]);
        }
    }
}
