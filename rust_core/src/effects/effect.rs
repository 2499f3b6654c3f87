//! Effects: physical laws that the linear model lacks, at a location, with an amount.
use crate::simd::{Lanes, Part};

/// One parameter of a law. `default`, `minimum` and `maximum` are multiples of `times`: a product of
/// k, c (the vehicle's own linear terms at the place), z, v, F (its reference motion, 5 mm or 5 mrad, at
/// 10 rad/s, and force k z), m (mass of the frame), h (the flange clearance), r (the rolling radius).
#[derive(Clone, Copy, Debug)]
pub struct Param {
    pub key: &'static str,
    pub symbol: &'static str,
    /// A word of z, v, F, s, 1 at the place, or an SI unit where it does not depend on the place.
    pub unit: &'static str,
    pub default: f64,
    pub minimum: f64,
    pub maximum: f64,
    pub times: &'static str,
    pub origin: &'static str,
    pub role: Role,
}

/// Treatment of a parameter in the search for an unmodelled effect.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// The force is proportional to it; of a law with memory that of fast (Maxwell) or of large motion (Bouc-Wen) alone.
    Strength,
    /// It shapes the law.
    Shape,
    /// Off unless a design gives it; never searched for.
    Optional,
    /// It belongs to a run, not to the vehicle.
    Run,
}

/// Part of the linear model that the law replaces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Supersedes {
    Nothing,
    Stiffness,
    StiffnessAndDamping,
    CreepForces,
    RollingRadii,
}

impl Supersedes {
    /// Do both replace the same term?
    pub fn clashes(self, other: Supersedes) -> bool {
        use Supersedes::{CreepForces, Nothing, RollingRadii};
        match (self, other) {
            (Nothing, _) | (_, Nothing) => false,
            (CreepForces | RollingRadii, _) | (_, CreepForces | RollingRadii) => self == other,
            _ => true,
        }
    }
}

/// Quantity that the law acts on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    Force,
    Creep,
    Rolling,
    Profile,
    Rail,
    /// A body behind its location, with the numbers mass, stiffness and damping.
    Body,
    Sensor(Alteration),
}

/// Alteration of a simulated signal by a sensor, in the order in which they act.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Alteration {
    Delay,
    Gain,
    Offset,
}

impl Alteration {
    pub const ALL: [Alteration; 3] = [Alteration::Delay, Alteration::Gain, Alteration::Offset];

    /// The number that alters nothing.
    pub fn neutral(self) -> f64 {
        f64::from(self == Alteration::Gain)
    }
}

/// Properties of an effect that its identification and the reports about it use.
#[derive(Clone, Copy, Debug)]
pub struct Diagnosis {
    /// Subject of an inspection where it is found; `{place}` stands for its location.
    pub inspection: &'static str,
    /// Family of laws that a small amount may confuse at one location; empty: none.
    pub family: &'static str,
    /// True if other values of the vehicle's own parameters may replace it.
    pub linear: bool,
    /// True of a law of dampers: where a damper and a spring join the same bodies, it is looked for at the damper.
    pub damper: bool,
    /// True if it acts the more, the smaller its parameter is.
    pub smaller_is_stronger: bool,
    /// True if its force is undetermined where nothing moves.
    pub undetermined_at_rest: bool,
    /// Column of a run without which it does not act; empty: none.
    pub column: &'static str,
    /// Place among the common effects, to which a table with little room is limited; 0: it is none of them.
    pub common: u8,
    /// True if the size of it is followed in a fleet that names no effects.
    pub followed: bool,
}

impl Diagnosis {
    /// None of the properties.
    pub const fn of(inspection: &'static str) -> Self {
        Diagnosis {
            inspection,
            family: "",
            linear: false,
            damper: false,
            smaller_is_stronger: false,
            undetermined_at_rest: false,
            column: "",
            common: 0,
            followed: false,
        }
    }
}

/// A law that sticks moves little, one that stiffens is linear where the motion is small.
pub const STICKING: &str = "sticking";
pub const STIFFENING: &str = "stiffening";
pub const ADHESION: &str = "adhesion: wet, greasy or contaminated rails, flange lubrication, weather of the day";

/// The record of an effect: the one place where it describes itself.
#[derive(Clone, Copy, Debug)]
pub struct Record {
    pub key: &'static str,
    pub title: &'static str,
    pub source: &'static str,
    pub kind: Kind,
    pub at: &'static [&'static str],
    pub params: &'static [Param],
    pub supersedes: Supersedes,
    pub states: usize,
    /// F(-z, -v) = -F(z, v)
    pub odd: bool,
    /// Over a closed cycle it takes energy out, or none. Not so the laws of the rolling radii: by these hunting lives on
    /// the speed of the train.
    pub dissipates: bool,
    /// True if the score test includes it.
    pub candidate: bool,
    pub diagnosis: Diagnosis,
    /// Starting shapes of a search: per parameter a multiple of its own unit made of the actual rms motion at
    /// the location (z, v), the force k z, and k, c; 0 means the parameter's default.
    pub shapes: &'static [&'static [f64]],
}

/// Properties of the vehicle at the location of the effect.
#[derive(Clone, Copy, Debug, Default)]
pub struct Site {
    /// The linear spring and damper there, per unit of z and v.
    pub stiffness: f64,
    pub damping: f64,
    /// Largest motion and speed that the step size must hold for.
    pub motion: f64,
    pub speed: f64,
    /// Wheel load [N], and 2 kappa_y N / V [N s/m] at the lowest speed.
    pub wheel_load: f64,
    pub creep_damping: f64,
    /// kappa_x N, kappa_y N [N] and 2 N epsilon/b [N/m].
    pub creep_slopes: [f64; 2],
    pub gravitational: f64,
    /// Distance of the wheelset behind the first [m].
    pub behind: f64,
}

impl Site {
    /// A place of the suspension, with the motion and speed that steps must hold for.
    pub fn moving(stiffness: f64, damping: f64) -> Self {
        Site { stiffness, damping, motion: 0.01, speed: 0.3, ..Site::default() }
    }
}

/// Steepest slopes of a law beyond the linear terms: force per z, force per v, rate of an own state [1/s].
#[derive(Clone, Copy, Debug, Default)]
pub struct Slopes {
    pub stiffness: f64,
    pub damping: f64,
    pub rate: f64,
}

/// Every effect: its record, its numbers made ready (no division in a law), its steepest slopes.
pub trait Effect {
    const RECORD: Record;

    /// True if this many numbers describe it. Curves have their own count.
    fn counts(p: &[f64]) -> bool {
        p.len() == Self::RECORD.params.len()
    }

    fn prepare(p: &[f64], _site: &Site) -> Vec<f64> {
        p.to_vec()
    }

    fn steepest_slopes(_p: &[f64], _site: &Site) -> Slopes {
        Slopes::default()
    }

    /// Largest magnitude of the own state, where it has one: it is clamped to it at the end of every step.
    fn largest(_p: &[f64]) -> Option<f64> {
        None
    }
}

/// The prepared numbers of a part of the lanes.
#[derive(Clone, Copy)]
pub struct Numbers<'a> {
    pub lanes: &'a [Lanes],
    pub at: usize,
}

impl Numbers<'_> {
    /// The first N of them.
    #[inline(always)]
    pub fn first<P: Part, const N: usize>(&self) -> [P; N] {
        self.from(0)
    }

    /// N of them, from one on.
    #[inline(always)]
    pub fn from<P: Part, const N: usize>(&self, begin: usize) -> [P; N] {
        let lanes = &self.lanes[begin..begin + N];
        let mut numbers = [P::zero(); N];
        for i in 0..N {
            numbers[i] = P::load(&lanes[i], self.at);
        }
        numbers
    }
}

/// The first N numbers of a law, which [`Effect::counts`] has counted.
pub fn first<const N: usize>(p: &[f64]) -> [f64; N] {
    *p.first_chunk().expect("counted")
}

/// F(z, v, x) beyond the superseded linear term, and x' of an own state; s is the distance run.
pub trait Force: Effect {
    /// True if the law depends on the speed v.
    const SPEED: bool = true;
    /// True of a force of the distance run alone: forms of the rate compute it once per row of the input table.
    const OF_DISTANCE: bool = false;
    /// True of a stop: F = -k (z - clamp(z, h)) of the prepared numbers h, k. Forms of the rate that know stops compute it
    /// only where one is met.
    const STOP: bool = false;

    fn force<P: Part>(p: Numbers<'_>, z: P, v: P, s: f64, x: P, dx: &mut P) -> P;

    /// The force at the contact of a wheelset, whose rails are apart by the gauge deviation g.
    #[inline(always)]
    fn at_contact<P: Part>(p: Numbers<'_>, e: P, v: P, s: f64, _gauge: f64) -> P {
        Self::force(p, e, v, s, P::zero(), &mut P::zero())
    }

    /// Is there friction where it touches at a contact?
    fn slides(_p: &[f64]) -> bool {
        false
    }

    /// Creep forces of a flange along the rail and across it, and friction times creepage.
    #[inline(always)]
    fn friction<P: Part>(_p: Numbers<'_>, _of: &Flanging<P>) -> ([P; 2], P) {
        ([P::zero(); 2], P::zero())
    }
}

/// The flange's force on the wheelset, and at its wheel t_x and t_y of the linear law without spin, and kappa_x N/r.
#[derive(Clone, Copy)]
pub struct Flanging<P> {
    pub force: P,
    pub tx: P,
    pub ty: P,
    pub kx_r: P,
}

/// Creep of one wheel: forces of the linear law, part of t_y that is spin, speed of the wheelset.
#[derive(Clone, Copy)]
pub struct Creeping<P> {
    pub tx: P,
    pub ty: P,
    pub spin: P,
    pub speed: P,
}

/// Creep forces of a wheel where the linear law gives t_x, t_y.
pub trait Creep: Effect {
    /// True of [`cubic_saturation`] alone, its one prepared number [`per_square_of_sliding`].
    const CUBIC: bool = false;

    fn forces<P: Part>(p: Numbers<'_>, wheel: &Creeping<P>) -> [P; 2];
}

/// 1/(3 T_lim)^2 of a friction limit T_lim = mu N: its product with the square of a creep force is below one until the wheel
/// slides fully.
pub fn per_square_of_sliding(limit: f64) -> f64 {
    (3.0 * limit).powi(-2)
}

/// Factor of Vermeulen and Johnson, see [`cubic_saturation`].
#[inline(always)]
pub fn saturated<P: Part>(square: P) -> P {
    let [factor] = cubic_saturation::<P, true, 1>([square], [P::zero(); 2]);
    factor
}

/// Factors of Vermeulen and Johnson for N wheels, the square of q = T/(3 mu N) given: 1 - q + q^2/3 for q < 1, else 1/(3 q);
/// of a share of the saturation, and a third of it, as much of what it takes off, unless it is `WHOLE` in all lanes.
#[inline(always)]
pub fn cubic_saturation<P: Part, const WHOLE: bool, const N: usize>(
    square: [P; N],
    [share, share_third]: [P; 2],
) -> [P; N] {
    let (one, third) = (P::splat(1.0), P::splat(1.0 / 3.0));
    // loops, for closures inside array functions would not be compiled for the level
    let (mut q, mut factor, mut largest) = (square, square, one);
    for i in 0..N {
        q[i] = square[i].sqrt();
        factor[i] = if WHOLE {
            third.mul_add(square[i], one) - q[i]
        } else {
            share.neg_mul_add(q[i], share_third.mul_add(square[i], one))
        };
        largest = if i == 0 { square[0] } else { largest.max(square[i]) };
    }
    // full sliding is rare: its divisions are made only where a lane slides
    if largest.any_from(one) {
        for i in 0..N {
            // the same digits in full as by a share of one, whatever the other lanes do
            let more = third / q[i].max(third) - one;
            let sliding = if WHOLE { more + one } else { share.mul_add(more, one) };
            factor[i] = square[i].if_less(one, factor[i], sliding);
        }
    }
    factor
}

/// (r_1 - r_2)/2 = (lambda + conicity)(e - shift)(1 + cubic (e - shift)^2)
#[derive(Clone, Copy)]
pub struct RollingRadius<P> {
    pub shift: P,
    pub conicity: P,
    pub cubic: P,
}

/// Adds to the terms of the rolling radius difference, times the amount alpha.
pub trait Rolling: Effect {
    fn roll<P: Part>(p: Numbers<'_>, alpha: P, gauge: P, s: f64, to: &mut RollingRadius<P>);
}

/// A parameter with the usual role and origin, written short.
pub const fn param(
    key: &'static str,
    symbol: &'static str,
    unit: &'static str,
    range: [f64; 3],
    times: &'static str,
    origin: &'static str,
    role: Role,
) -> Param {
    Param { key, symbol, unit, default: range[0], minimum: range[1], maximum: range[2], times, origin, role }
}

pub const STIFFNESS_ORIGIN: &str = "as stiff as the nominal spring; 0.01 to 100 times it";
pub const FORCE_ORIGIN: &str =
    "a third of the nominal spring's force at 5 mm (5 mrad); up to 100 times it, for springs that friction outdoes";
pub const SUSPENSIONS: &[&str] = &["secondary_lateral", "secondary_yaw", "primary_lateral", "primary_yaw", "rig"];
