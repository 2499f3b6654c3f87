//! Track and suspension terms of a fused vehicle: rows of any vehicle, or the unrolled rows of a coach.
use crate::rate::blocks::Row;
use crate::rate::coach::{self, Coach, Under};
use crate::rate::packed::{Packed, State, Table};
use crate::simd::Part;
use crate::vehicle::group::{Group, STATES};

/// Accelerations by the input table.
pub enum TrackRows<P> {
    Any(Box<Packed<P, Table>>),
    Coach(Box<Under<P>>),
}

impl<P: Part> TrackRows<P> {
    /// The lanes from `at` on.
    #[inline(always)]
    pub fn new(group: &Group, rows: Vec<Row>, at: usize) -> Self {
        let under = if coach::has_coach_structure(group) { Under::new(rows.clone(), at) } else { None };
        under
            .map_or_else(|| TrackRows::Any(Box::new(Packed::new(&rows, at))), |under| TrackRows::Coach(Box::new(under)))
    }

    /// At this speed [m/s], before [`Laying::prepare_row`].
    #[inline(always)]
    pub fn set_speed(&mut self, speed: f64) {
        match self {
            TrackRows::Any(rows) => rows.set_speed(speed),
            TrackRows::Coach(under) => under.set_speed(speed),
        }
    }

    /// The sums over a row of the input table.
    #[inline(always)]
    pub fn prepare_row(&self, row: &[f64], prepared: &mut [P; STATES]) {
        match self {
            TrackRows::Any(rows) => rows.sums(row, None, prepared),
            TrackRows::Coach(under) => under.prepare_row(row, prepared),
        }
    }
}

/// Accelerations by the state: of the wheelsets; of all else; in unused entries of dx the deflections of the stops.
pub enum Suspension<P> {
    Any { wheelsets: Box<Packed<P, State>>, bodies: Box<Packed<P, State>> },
    Coach(Box<Coach<P>>),
}

impl<P: Part> Suspension<P> {
    /// The lanes from `at` on, with so many stops.
    #[inline(always)]
    pub fn new(group: &Group, wheelsets: &[Row], bodies: &[Row], stops: usize, at: usize) -> Self {
        let all = || [bodies, wheelsets].concat();
        let coach = if coach::has_coach_structure(group) { Coach::new(all(), stops, at) } else { None };
        let any = || Suspension::Any {
            wheelsets: Box::new(Packed::new(wheelsets, at)),
            bodies: Box::new(Packed::with_opposites(bodies, at, group.states)),
        };
        coach.map_or_else(any, |coach| Suspension::Coach(Box::new(coach)))
    }

    #[inline(always)]
    pub fn wheelsets(&self, x: &[P; STATES], prepared: &[P; STATES], dx: &mut [P; STATES]) {
        match self {
            Suspension::Any { wheelsets, .. } => wheelsets.sums(x, Some(prepared), dx),
            Suspension::Coach(coach) => coach.wheelsets(x, prepared, dx),
        }
    }

    /// x has room behind its states.
    #[inline(always)]
    pub fn bodies(&self, x: &mut [P; STATES], prepared: &[P; STATES], dx: &mut [P; STATES]) {
        match self {
            Suspension::Any { bodies, .. } => {
                bodies.oppose(x);
                bodies.sums(x, Some(prepared), dx);
            }
            Suspension::Coach(coach) => coach.bodies(x, prepared, dx),
        }
    }
}
