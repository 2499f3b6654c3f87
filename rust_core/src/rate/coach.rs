//! A vehicle on two bogies that are alike: the terms that its rows usually have, at places that are known when compiled.
//!
//! Degrees of freedom: y, psi, phi of the body and of both frames, y, psi of four wheelsets, in this order; velocities
//! follow. Terms are summed in the order of their columns, as `packed` sums them: to the same digits.
use crate::rate::blocks::Row;
use crate::rate::packed::Table;
use crate::rate::unrolled::{Signed, UnrolledRows};
use crate::simd::Part;
use crate::vehicle::group::{Group, STATES};

/// Degrees of freedom.
pub const DOFS: usize = 17;
/// Index of the first velocity; the first degree of freedom of each frame, and of the wheelsets under it.
const V: Signed = DOFS as Signed;
const FRAMES: [Signed; 2] = [3, 6];
const WHEELS: [Signed; 2] = [9, 13];

/// Columns of the input table that are read: first of each wheelset, how many there are.
const COLUMN: [usize; 4] = [2, 7, 12, 17];
const READ: usize = 22;

const BODY_Y_PHI: [[Signed; 12]; 1] = [[0, 2, 3, 5, 6, 8, V, V + 2, V + 3, V + 5, V + 6, V + 8]];
const BODY_PSI: [[Signed; 14]; 1] = [[1, 3, 4, 5, 6, 7, 8, V + 1, V + 3, V + 4, V + 5, V + 6, V + 7, V + 8]];
const FRAMES_Y: [[Signed; 12]; 2] = [frame_y(0), frame_y(1)];
const FRAMES_PSI: [[Signed; 8]; 2] = [frame_psi(0), frame_psi(1)];
const FRAMES_PHI: [[Signed; 14]; 2] = [frame_phi(0), frame_phi(1)];
const WHEELS_Y: [[Signed; 4]; 2] = [wheels_y(0), wheels_y(1)];
const WHEELS_PSI: [[Signed; 1]; 4] = [[FRAMES[0] + 1], [FRAMES[0] + 1], [FRAMES[1] + 1], [FRAMES[1] + 1]];
const STOPS: [[Signed; 6]; 2] = [stop(0), stop(1)];
const UNDER_FRAMES: [[Signed; 4]; 2] = [under_frame(0), under_frame(1)];
const UNDER_ROLLS: [[Signed; 8]; 2] = [under_roll(0), under_roll(1)];
const UNDER_WHEELS: [[Signed; 4]; 4] = [under_wheel(0), under_wheel(1), under_wheel(2), under_wheel(3)];

/// psi of the body moves the pivot of the second bogie the other way.
const fn psi(bogie: usize, place: Signed) -> Signed {
    if bogie == 0 { place } else { -place }
}

const fn frame_y(bogie: usize) -> [Signed; 12] {
    let (f, w) = (FRAMES[bogie], WHEELS[bogie]);
    [0, psi(bogie, 1), 2, f, f + 2, w, w + 2, V, psi(bogie, V + 1), V + 2, V + f, V + f + 2]
}

const fn frame_psi(bogie: usize) -> [Signed; 8] {
    let (f, w) = (FRAMES[bogie], WHEELS[bogie]);
    [1, f + 1, w, w + 1, w + 2, w + 3, V + 1, V + f + 1]
}

const fn frame_phi(bogie: usize) -> [Signed; 14] {
    let (f, w) = (FRAMES[bogie], WHEELS[bogie]);
    [0, psi(bogie, 1), 2, f, f + 2, w, w + 2, V, psi(bogie, V + 1), V + 2, V + f, V + f + 2, V + w, V + w + 2]
}

/// Of one wheelset of each bogie.
const fn wheels_y(bogie: usize) -> [Signed; 4] {
    let f = FRAMES[bogie];
    [f, f + 1, f + 2, V + f + 2]
}

/// The deflection of a stop between a frame and the body.
const fn stop(bogie: usize) -> [Signed; 6] {
    let f = FRAMES[bogie];
    [0, psi(bogie, 1), 2, f, f + 1, f + 2]
}

/// y_w and phi_w under both wheelsets of a frame.
const fn under_frame(bogie: usize) -> [Signed; 4] {
    let [a, b] = [COLUMN[2 * bogie] as Signed, COLUMN[2 * bogie + 1] as Signed];
    [a, a + 2, b, b + 2]
}

/// Also the speed times dy_w/ds and dphi_w/ds.
const fn under_roll(bogie: usize) -> [Signed; 8] {
    let [[a, b, c, d], [_, _, e, f], [_, _, g, h]] =
        [under_frame(bogie), under_wheel(2 * bogie), under_wheel(2 * bogie + 1)];
    [a, b, c, d, e, f, g, h]
}

const fn under_wheel(i: usize) -> [Signed; 4] {
    let c = COLUMN[i];
    [c as Signed, c as Signed + 2, Table::moved(c + 1) as Signed, Table::moved(c + 3) as Signed]
}

/// True if a group has the size of a coach, wheelsets last, and no states of its own except positions and velocities.
pub fn has_coach_structure(group: &Group) -> bool {
    let places = |i: usize| (WHEELS[0] as usize + 2 * i, WHEELS[0] as usize + 2 * i + 1, COLUMN[i]);
    (group.dofs, group.states, group.wheelsets.len()) == (DOFS, 2 * DOFS, COLUMN.len())
        && group.wheelsets.iter().enumerate().all(|(i, w)| (w.y, w.psi, w.column) == places(i))
}

/// Nothing but zeros is left of the rows.
fn spent(rows: &[Row]) -> bool {
    rows.iter().all(|(_, terms)| terms.iter().all(|(_, a)| a.is_zero()))
}

/// Accelerations by the state of a part of the lanes, and deflections of the stops.
pub struct Coach<P> {
    body_y_phi: UnrolledRows<P, 12, 2>,
    body_psi: UnrolledRows<P, 14, 1>,
    frames_y: UnrolledRows<P, 12, 1>,
    frames_psi: UnrolledRows<P, 8, 1>,
    frames_phi: UnrolledRows<P, 14, 1>,
    leading_y: UnrolledRows<P, 4, 1>,
    trailing_y: UnrolledRows<P, 4, 1>,
    wheels_psi: UnrolledRows<P, 1, 1>,
    stops: Option<UnrolledRows<P, 6, 1>>,
}

/// dx of a degree of freedom: its velocity's rate.
macro_rules! rate {
    ($dx:ident, $dof:expr) => {
        $dx[(V + $dof) as usize]
    };
}

/// Prepared values of degrees of freedom, from which the sums start.
macro_rules! from {
    ($prepared:ident, $($dof:expr),*) => {
        [$([$prepared[$dof as usize]]),*]
    };
}

impl<P: Part> Coach<P> {
    /// The lanes from `at` on, of the rows of all degrees of freedom and of these stops; none where they have other terms.
    pub fn new(mut rows: Vec<Row>, stops: usize, at: usize) -> Option<Self> {
        let rows = &mut rows[..];
        let ([f, g], [w, z]) = (FRAMES.map(|f| V + f), WHEELS.map(|w| V + w));
        let coach = Coach {
            body_y_phi: UnrolledRows::taken(rows, [[V, V + 2]], &BODY_Y_PHI, at)?,
            body_psi: UnrolledRows::taken(rows, [[V + 1]], &BODY_PSI, at)?,
            frames_y: UnrolledRows::taken(rows, [[f], [g]], &FRAMES_Y, at)?,
            frames_psi: UnrolledRows::taken(rows, [[f + 1], [g + 1]], &FRAMES_PSI, at)?,
            frames_phi: UnrolledRows::taken(rows, [[f + 2], [g + 2]], &FRAMES_PHI, at)?,
            leading_y: UnrolledRows::taken(rows, [[w], [z]], &WHEELS_Y, at)?,
            trailing_y: UnrolledRows::taken(rows, [[w + 2], [z + 2]], &WHEELS_Y, at)?,
            wheels_psi: UnrolledRows::taken(rows, [[w + 1], [w + 3], [z + 1], [z + 3]], &WHEELS_PSI, at)?,
            stops: if stops == 2 { Some(UnrolledRows::taken(rows, [[0], [1]], &STOPS, at)?) } else { None },
        };
        spent(rows).then_some(coach)
    }

    /// dx of the wheelsets, from `prepared`.
    #[inline(always)]
    pub fn wheelsets(&self, x: &[P; STATES], prepared: &[P; STATES], dx: &mut [P; STATES]) {
        let [w, z] = WHEELS;
        [[rate!(dx, w)], [rate!(dx, z)]] = self.leading_y.sums(&WHEELS_Y, from!(prepared, w, z), x);
        [[rate!(dx, w + 2)], [rate!(dx, z + 2)]] = self.trailing_y.sums(&WHEELS_Y, from!(prepared, w + 2, z + 2), x);
        [[rate!(dx, w + 1)], [rate!(dx, w + 3)], [rate!(dx, z + 1)], [rate!(dx, z + 3)]] =
            self.wheels_psi.sums(&WHEELS_PSI, from!(prepared, w + 1, w + 3, z + 1, z + 3), x);
    }

    /// dx of body and frames, from `prepared`, and the deflections of the stops.
    #[inline(always)]
    pub fn bodies(&self, x: &[P; STATES], prepared: &[P; STATES], dx: &mut [P; STATES]) {
        let [f, g] = FRAMES;
        [[rate!(dx, f)], [rate!(dx, g)]] = self.frames_y.sums(&FRAMES_Y, from!(prepared, f, g), x);
        [[rate!(dx, f + 2)], [rate!(dx, g + 2)]] = self.frames_phi.sums(&FRAMES_PHI, from!(prepared, f + 2, g + 2), x);
        [[rate!(dx, f + 1)], [rate!(dx, g + 1)]] = self.frames_psi.sums(&FRAMES_PSI, from!(prepared, f + 1, g + 1), x);
        [[rate!(dx, 0), rate!(dx, 2)]] = self.body_y_phi.sums(&BODY_Y_PHI, [[prepared[0], prepared[2]]], x);
        [[rate!(dx, 1)]] = self.body_psi.sums(&BODY_PSI, from!(prepared, 1), x);
        if let Some(stops) = &self.stops {
            [[dx[0]], [dx[1]]] = stops.sums(&STOPS, [[P::zero()]; 2], x);
        }
    }
}

/// Accelerations by the track of a part of the lanes.
pub struct Under<P> {
    frames_y_psi: UnrolledRows<P, 4, 2>,
    frames_phi: UnrolledRows<P, 8, 1>,
    wheels_y: UnrolledRows<P, 4, 1>,
    /// The factors of the slopes at 1 m/s, the last of `frames_phi` and of `wheels_y`.
    of_slopes: ([P; 4], [P; 2]),
}

impl<P: Part> Under<P> {
    /// The lanes from `at` on, of the rows of all degrees of freedom; none where they have other terms.
    pub fn new(mut rows: Vec<Row>, at: usize) -> Option<Self> {
        let rows = &mut rows[..];
        let ([f, g], [w, z]) = (FRAMES, WHEELS);
        let frames_y_psi = UnrolledRows::taken(rows, [[f, f + 1], [g, g + 1]], &UNDER_FRAMES, at)?;
        let frames_phi = UnrolledRows::taken(rows, [[f + 2], [g + 2]], &UNDER_ROLLS, at)?;
        let wheels_y = UnrolledRows::taken(rows, [[w], [w + 2], [z], [z + 2]], &UNDER_WHEELS, at)?;
        let [.., a, b, c, d] = frames_phi.0.map(|[factor]| factor);
        let [.., e, h] = wheels_y.0.map(|[factor]| factor);
        spent(rows).then_some(Under { frames_y_psi, frames_phi, wheels_y, of_slopes: ([a, b, c, d], [e, h]) })
    }

    /// At this speed [m/s], before [`Under::prepare_row`].
    #[inline(always)]
    pub fn set_speed(&mut self, speed: f64) {
        let (speed, ([a, b, c, d], [e, h])) = (P::splat(speed), self.of_slopes);
        let [.., to_a, to_b, to_c, to_d] = &mut self.frames_phi.0;
        (*to_a, *to_b, *to_c, *to_d) = ([speed * a], [speed * b], [speed * c], [speed * d]);
        let [.., to_e, to_h] = &mut self.wheels_y.0;
        (*to_e, *to_h) = ([speed * e], [speed * h]);
    }

    /// The sums over a row of the input table.
    #[inline(always)]
    pub fn prepare_row(&self, row: &[f64], prepared: &mut [P; STATES]) {
        let Some(row) = row.first_chunk::<READ>() else { return };
        let ([f, g], [w, z]) = (FRAMES.map(|f| f as usize), WHEELS.map(|w| w as usize));
        let none = [P::zero()];
        [[prepared[f], prepared[f + 1]], [prepared[g], prepared[g + 1]]] =
            self.frames_y_psi.sums(&UNDER_FRAMES, [[P::zero(); 2]; 2], row);
        [[prepared[f + 2]], [prepared[g + 2]]] = self.frames_phi.sums(&UNDER_ROLLS, [none; 2], row);
        [[prepared[w]], [prepared[w + 2]], [prepared[z]], [prepared[z + 2]]] =
            self.wheels_y.sums(&UNDER_WHEELS, [none; 4], row);
    }
}
