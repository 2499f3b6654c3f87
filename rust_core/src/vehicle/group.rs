//! A group of sixteen vehicles of one structure: the rate of change of its state.
use crate::effects::PlacedLaw;
use crate::effects::effect::Alteration;
use crate::numeric::sparse_rows::Rows;
use crate::simd::{Lanes, Part};
use crate::vehicle::channels::Reading;
use crate::vehicle::plain_bogie::PlainBogie;
use crate::wheel_rail::contact::Contact;
use crate::wheel_rail::wheelset::{Passing, WheelsetLanes};

/// Room for the state of one vehicle.
pub const STATES: usize = 64;

/// Input of the step loop: sixteen vehicles of one structure.
#[derive(Clone, Debug)]
pub struct Group {
    pub dofs: usize,
    pub states: usize,
    pub columns: usize,
    /// -K and -C over x = [q, q'], and what the track moves of the suspension.
    pub matrix: Rows,
    pub inv_mass: Vec<Lanes>,
    pub wheelsets: Vec<WheelsetLanes>,
    pub forces: Vec<PlacedLaw>,
    pub speed_scale: Lanes,
    pub inv_speed_scale: Lanes,
    pub limit: f64,
    /// Set where the structure is a bogie with nothing but saturation and flange: its rate in one piece.
    pub plain: Option<PlainBogie<Lanes>>,
    /// Set where another structure has no more at its contacts than that.
    pub contacts: Option<Vec<Contact<Lanes>>>,
    /// Own states that are clamped to a largest magnitude at the end of every step.
    pub clamped_states: Vec<(usize, Lanes)>,
    /// Contribution of the load transfer to the guiding forces of every wheelset; without terms where nothing rolls.
    pub leaning: Vec<Reading>,
    pub readings: Vec<Reading>,
    /// Sensor laws: what they alter, the channel, its number times the amount.
    pub sensors: Vec<(Alteration, String, Lanes)>,
}

impl Group {
    /// Does a creep force saturate or a flange touch anywhere?
    pub fn touches(&self) -> bool {
        self.wheelsets.iter().any(|w| !w.creeps.is_empty() || !w.laws.is_empty())
    }

    /// The plain bogie, where nothing acts except its contacts and these act in full.
    pub fn fully_plain(&self) -> Option<&PlainBogie<Lanes>> {
        self.plain.as_ref().filter(|bogie| bogie.acts_fully() && self.forces.is_empty())
    }

    #[inline(always)]
    fn passing<'a, P: Part>(&self, at: usize, row: &'a [f64]) -> Passing<'a, P> {
        Passing::new(row, P::load(&self.speed_scale, at), P::load(&self.inv_speed_scale, at))
    }

    /// Hold own states within their largest magnitude.
    #[inline(always)]
    pub fn clamp_own_states<P: Part>(&self, at: usize, x: &mut [P; STATES]) {
        for (i, limit) in &self.clamped_states {
            x[i & 63] = x[i & 63].clamp(P::load(limit, at));
        }
    }

    /// dx[n ..] = rate of change of velocities and own states under the input row (that of the n positions is part of x),
    /// in one fixed order: K and C, inputs, wheelsets, laws, masses.
    #[inline(always)]
    pub fn rate<P: Part>(&self, at: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let n = self.dofs;
        self.matrix.forces(at, x, row, n, dx);
        if !self.wheelsets.is_empty() {
            let track = self.passing(at, row);
            for wheelset in &self.wheelsets {
                wheelset.add(at, &track, n, x, dx);
            }
        }
        self.act::<P, false>(at, row, x, dx);
        for i in 0..n {
            dx[(n + i) & 63] = dx[(n + i) & 63] * P::load(&self.inv_mass[i], at);
        }
    }

    /// Motion that the track imposes at the location of a law.
    #[inline(always)]
    pub fn follow<P: Part>(&self, law: &PlacedLaw, at: usize, row: &[f64], z: &mut P, v: &mut P) {
        for (column, a) in &law.inputs {
            *z = P::load(a, at).mul_add(P::splat(row[*column]), *z);
            if law.looks_at_speed {
                *v = P::load(a, at).mul_add(self.passing::<P>(at, row).speed * P::splat(row[column + 1]), *v);
            }
        }
    }

    /// The laws at ports: their forces added to dx[n ..], or the accelerations that they cause.
    #[inline(always)]
    pub fn act<P: Part, const PER_MASS: bool>(&self, at: usize, row: &[f64], x: &[P; STATES], dx: &mut [P; STATES]) {
        let n = self.dofs;
        for law in &self.forces {
            let (mut z, mut v) = (P::zero(), P::zero());
            for (i, a) in &law.row {
                z = P::load(a, at).mul_add(x[i & 63], z);
            }
            if law.looks_at_speed {
                for (i, a) in &law.row {
                    v = P::load(a, at).mul_add(x[(n + i) & 63], v);
                }
            }
            self.follow(law, at, row, &mut z, &mut v);
            let mut own = P::zero();
            let force = law.law.force(law.numbers(at), z, v, row[0], x[law.state & 63], &mut own);
            if law.has_state {
                dx[law.state & 63] = own;
            }
            let force = P::load(&law.alpha, at) * force;
            for (i, a) in if PER_MASS { &law.pushes } else { &law.reaction } {
                dx[(n + i) & 63] = P::load(a, at).mul_add(force, dx[(n + i) & 63]);
            }
        }
    }
}
