//! Effects: physical laws that the linear model lacks, at a location, with an amount.
pub use super::law::{Creep, Creeping, Flanging, Force, Numbers, Rolling, RollingRadius, cubic_saturation, saturated};
pub use crate::simd::Elementary;

/// One parameter of a law. `default`, `minimum` and `maximum` are multiples of `times`: products and quotients of
/// k, c (the vehicle's own linear terms at the place), z, v, F (its reference motion, 5 mm or 5 mrad, at
/// w = 10 rad/s, and force k z), m (mass of the frame), h (the flange clearance), r (the rolling radius).
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
    /// The rail that stays where it is.
    RigidRail,
}

impl Supersedes {
    /// Do both replace the same term?
    pub fn clashes(self, other: Supersedes) -> bool {
        use Supersedes::{CreepForces, Nothing, RigidRail, RollingRadii};
        match (self, other) {
            (Nothing, _) | (_, Nothing) => false,
            (CreepForces | RollingRadii | RigidRail, _) | (_, CreepForces | RollingRadii | RigidRail) => self == other,
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
    /// The formula, in the symbols of its parameters; z: deflection at the location, v its speed, F: force on the body above it.
    pub law: &'static str,
    pub kind: Kind,
    pub at: &'static [&'static str],
    pub params: &'static [Param],
    pub supersedes: Supersedes,
    /// Own states; of a force or a rail one at most.
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
    /// Speed of most of the motion, for which the steps of a law resolve its changes.
    pub usual_speed: f64,
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
    /// A place of the suspension, with the motion and speed that steps must hold for: 0.01 m and 0.3 m/s, or 0.01 rad and
    /// 0.1 rad/s. A wheelset that hunts from flange to flange (8 mm on 20 m at 50 m/s) yaws at 0.04 rad/s. Across a primary
    /// suspension the rms speed is about 0.01 m/s and 0.005 rad/s; across a secondary one it is larger, and so are the
    /// deflections at which springs yield. The motion of a rig is not known.
    pub fn moving(class: &str, stiffness: f64, damping: f64) -> Self {
        let (speed, usual_speed) = match class {
            "rig" => (0.3, 0.3),
            _ if class.ends_with("_yaw") => (0.1, 0.01),
            _ => (0.3, 0.02),
        };
        Site { stiffness, damping, motion: 0.01, speed, usual_speed, ..Site::default() }
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

/// The first N numbers of a law, which [`Effect::counts`] has counted.
pub fn first<const N: usize>(p: &[f64]) -> [f64; N] {
    *p.first_chunk().expect("counted")
}

/// 1/(3 T_lim)^2 of a friction limit T_lim = mu N: its product with the square of a creep force is below one until the wheel
/// slides fully.
pub fn per_square_of_sliding(limit: f64) -> f64 {
    (3.0 * limit).powi(-2)
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
