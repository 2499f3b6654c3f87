//! The catalogue: every effect on one line, under what it acts on.
mod polyline;
pub mod effect;
pub mod port;
#[cfg(test)]
mod laws;

use crate::error::Error;
use crate::simd::{Dual, Lanes, Part, Portable};
use effect::{Creep, Creeping, Effect, Flanging, Force, Numbers, Record, Rolling, RollingRadius, Site, Slopes};

macro_rules! catalogue {
    (force { $($(#[$condition:meta])* $f:ident::$force:ident $(= $default:literal)? $(| $choice:ident = $word:literal)*,)* } creep { $($c:ident::$creep:ident,)* } rolling { $($r:ident::$roll:ident,)* }
     other { $($o:ident::$other:ident,)* }) => {
        $($(#[$condition])* pub mod $f;)* $(pub mod $c;)* $(pub mod $r;)* $(pub mod $o;)*

        /// An effect of the catalogue; one that leaves a choice is a law of its own for each, so that no lane chooses.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Law { $($(#[$condition])* $force, $($choice,)*)* $($creep,)* $($roll,)* $($other,)* }

        /// All of them, in the order of the list, each once: by its default where there is a choice.
        pub const CATALOGUE: &[Law] = &[$($(#[$condition])* Law::$force,)* $(Law::$creep,)* $(Law::$roll,)* $(Law::$other,)*];

        impl Law {
            /// Record of the law.
            pub fn record(self) -> &'static Record {
                match self {
                    $($(#[$condition])* Law::$force => &<$f::$force as Effect>::RECORD, $(Law::$choice => &<$f::$choice as Effect>::RECORD,)*)*
                    $(Law::$creep => &<$c::$creep as Effect>::RECORD,)*
                    $(Law::$roll => &<$r::$roll as Effect>::RECORD,)*
                    $(Law::$other => &<$o::$other as Effect>::RECORD,)*
                }
            }

            /// Its numbers made ready for the lanes.
            pub fn prepare(self, p: &[f64], site: &Site) -> Vec<f64> {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Effect>::prepare(p, site), $(Law::$choice => <$f::$choice as Effect>::prepare(p, site),)*)*
                    $(Law::$creep => <$c::$creep as Effect>::prepare(p, site),)*
                    $(Law::$roll => <$r::$roll as Effect>::prepare(p, site),)*
                    $(Law::$other => <$o::$other as Effect>::prepare(p, site),)*
                }
            }

            /// Do as many numbers as these describe it?
            pub fn counts(self, p: &[f64]) -> bool {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Effect>::counts(p), $(Law::$choice => <$f::$choice as Effect>::counts(p),)*)*
                    $(Law::$creep => <$c::$creep as Effect>::counts(p),)*
                    $(Law::$roll => <$r::$roll as Effect>::counts(p),)*
                    $(Law::$other => <$o::$other as Effect>::counts(p),)*
                }
            }

            /// Its steepest slopes at a place, for the step size.
            pub fn steepest_slopes(self, p: &[f64], site: &Site) -> Slopes {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Effect>::steepest_slopes(p, site), $(Law::$choice => <$f::$choice as Effect>::steepest_slopes(p, site),)*)*
                    $(Law::$creep => <$c::$creep as Effect>::steepest_slopes(p, site),)*
                    $(Law::$roll => <$r::$roll as Effect>::steepest_slopes(p, site),)*
                    $(Law::$other => <$o::$other as Effect>::steepest_slopes(p, site),)*
                }
            }

            /// Limit of the magnitude of its own state, where there is one.
            pub fn largest(self, p: &[f64]) -> Option<f64> {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Effect>::largest(p), $(Law::$choice => <$f::$choice as Effect>::largest(p),)*)*
                    _ => None,
                }
            }

            /// F of a force, and x' of its own state into dx; other laws make none.
            #[inline(always)]
            pub fn force<P: Part>(self, p: Numbers<'_>, z: P, v: P, s: f64, x: P, dx: &mut P) -> P {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::force(p, z, v, s, x, dx), $(Law::$choice => <$f::$choice as Force>::force(p, z, v, s, x, dx),)*)*
                    _ => P::zero(),
                }
            }

            /// F of a force at the contact of a wheelset, with the gauge deviation there.
            #[inline(always)]
            pub fn at_contact<P: Part>(self, p: Numbers<'_>, e: P, v: P, s: f64, gauge: f64) -> P {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::at_contact(p, e, v, s, gauge), $(Law::$choice => <$f::$choice as Force>::at_contact(p, e, v, s, gauge),)*)*
                    _ => P::zero(),
                }
            }

            /// Creep forces of a flange, and friction times creepage.
            #[inline(always)]
            pub fn friction<P: Part>(self, p: Numbers<'_>, of: &Flanging<P>) -> ([P; 2], P) {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::friction(p, of), $(Law::$choice => <$f::$choice as Force>::friction(p, of),)*)*
                    _ => ([P::zero(); 2], P::zero()),
                }
            }

            /// Does it slide with friction at a contact?
            pub fn slides(self, p: &[f64]) -> bool {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::slides(p), $(Law::$choice => <$f::$choice as Force>::slides(p),)*)*
                    _ => false,
                }
            }

            /// Is it a stop: a spring beyond a clearance?
            pub fn is_stop(self) -> bool {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::STOP, $(Law::$choice => <$f::$choice as Force>::STOP,)*)*
                    _ => false,
                }
            }

            /// Is it the cubic saturation of the creep forces, and nothing else?
            pub fn is_cubic_saturation(self) -> bool {
                match self {
                    $(Law::$creep => <$c::$creep as Creep>::CUBIC,)*
                    _ => false,
                }
            }

            /// The same law by its choice: a curve over z, v or s, a flange whose clearance follows the gauge.
            pub fn against(self, word: &str) -> Result<Law, Error> {
                match (self, word) {
                    $($((Law::$force, $default) => Ok(self),)? $((Law::$force, $word) => Ok(Law::$choice),)*)*
                    _ => Err(Error::Against { kind: self.record().key.into(), word: word.into() }),
                }
            }

            /// True of a force of the distance run alone.
            pub fn is_of_distance(self) -> bool {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::OF_DISTANCE, $(Law::$choice => <$f::$choice as Force>::OF_DISTANCE,)*)*
                    _ => false,
                }
            }

            /// True if the law depends on the speed.
            pub fn looks_at_speed(self) -> bool {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::SPEED, $(Law::$choice => <$f::$choice as Force>::SPEED,)*)*
                    _ => false,
                }
            }

            /// T_x, T_y of N wheels; those of the linear law where this is none of creep.
            #[inline(always)]
            pub fn creep<P: Part, const N: usize>(self, p: Numbers<'_>, wheels: &[Creeping<P>; N]) -> [[P; 2]; N] {
                match self {
                    $(Law::$creep => creep_of::<$c::$creep, P, N>(p, wheels),)*
                    _ => linear_of(wheels),
                }
            }

            /// Contribution of a law of the rolling radii to their difference.
            #[inline(always)]
            pub fn roll<P: Part>(self, p: Numbers<'_>, alpha: P, gauge: P, s: f64, to: &mut RollingRadius<P>) {
                match self {
                    $(Law::$roll => <$r::$roll as Rolling>::roll(p, alpha, gauge, s, to),)*
                    _ => {}
                }
            }
        }
    };
}

catalogue! {
    force {
        spring::Spring,
        viscous_damper::ViscousDamper,
        free_play::FreePlay,
        cubic_stiffness::CubicStiffness,
        quadratic_stiffness::QuadraticStiffness,
        bump_stop::BumpStop,
        dry_friction::DryFriction,
        hysteresis::Hysteresis,
        quadratic_damper::QuadraticDamper,
        asymmetric_damper::AsymmetricDamper,
        maxwell_damper::MaxwellDamper,
        flange_contact::FlangeContact | FlangeContactInGauge = "gauge",
        run_out::RunOut,
        steady_force::SteadyForce,
        // a law outside of this folder: see build.rs
        #[cfg(more_effects)]
        more::More,
        measured_force::MeasuredForce = "z" | MeasuredForceOfSpeed = "v" | MeasuredForceOfDistance = "s",
    }
    creep {
        creep_saturation::CreepSaturation,
        vermeulen_johnson::VermeulenJohnson,
        shen_hedrick_elkins::ShenHedrickElkins,
        polach::Polach,
    }
    rolling {
        nonlinear_conicity::NonlinearConicity,
        gauge_conicity::GaugeConicity,
        rolling_line_offset::RollingLineOffset,
        rolling_line::RollingLine,
    }
    other {
        profile_shape::ProfileShape,
        rail_flexibility::RailFlexibility,
        coach_mode::CoachMode,
        sensor_delay::SensorDelay,
        sensor_gain::SensorGain,
        sensor_offset::SensorOffset,
    }
}

#[inline(always)]
fn linear_of<P: Part, const N: usize>(wheels: &[Creeping<P>; N]) -> [[P; 2]; N] {
    let mut forces = [[P::zero(); 2]; N];
    for i in 0..N {
        forces[i] = [wheels[i].tx, wheels[i].ty];
    }
    forces
}

#[inline(always)]
fn creep_of<C: Creep, P: Part, const N: usize>(p: Numbers<'_>, wheels: &[Creeping<P>; N]) -> [[P; 2]; N] {
    let mut forces = linear_of(wheels);
    for i in 0..N {
        forces[i] = C::forces(p, &wheels[i]);
    }
    forces
}

impl Law {
    /// Creep forces of one wheel of a law with its parameters.
    pub fn creep_of_one(self, p: &[f64], site: &Site, [tx, ty, spin, speed]: [f64; 4]) -> [f64; 2] {
        let lanes: Vec<_> = self.prepare(p, site).into_iter().map(Lanes::splat).collect();
        let [tx, ty, spin, speed] = [tx, ty, spin, speed].map(Portable::splat);
        let [forces] = self.creep(Numbers { lanes: &lanes, at: 0 }, &[Creeping { tx, ty, spin, speed }]);
        forces.map(|force| {
            let mut out = Lanes::ZERO;
            force.store(&mut out, 0);
            out.0[0]
        })
    }

    /// Derivatives of the force and of the rate of the own state at rest, at a location without terms of its own.
    pub fn slopes_at_rest(self, p: &[f64]) -> [Derivatives; 2] {
        let lanes: Vec<_> = self.prepare(p, &Site::default()).into_iter().map(Lanes::splat).collect();
        let ([z, v, x], mut rate) = (Dual::<Portable>::variables(), Dual::zero());
        let force = self.force(Numbers { lanes: &lanes, at: 0 }, z, v, 0.0, x, &mut rate);
        [force, rate].map(|of| {
            let [z, v, x] = of.derivatives();
            Derivatives { z, v, x }
        })
    }

    /// The law of a key of the files, by its default where there is a choice.
    pub fn named(key: &str) -> Option<Law> {
        CATALOGUE.iter().copied().find(|law| law.record().key == key)
    }

    /// Elements of vehicles that are laws: a spring and a damper in series, a stop.
    pub const SERIES: Law = Law::MaxwellDamper;
    pub const STOP: Law = Law::BumpStop;
}

/// Derivatives with respect to motion, speed and own state.
#[derive(Clone, Copy, Debug)]
pub struct Derivatives {
    pub z: f64,
    pub v: f64,
    pub x: f64,
}

/// A law at one port with the numbers of sixteen vehicles.
#[derive(Clone, Debug)]
pub struct PlacedLaw {
    pub law: Law,
    pub row: Vec<(usize, Lanes)>,
    /// The row through which the force returns: that of the motion, except where the motion is prescribed.
    pub reaction: Vec<(usize, Lanes)>,
    /// That row over the masses: what the force accelerates.
    pub pushes: Vec<(usize, Lanes)>,
    /// Terms of the input table in z; the speed times the next column is their rate.
    pub inputs: Vec<(usize, Lanes)>,
    pub lanes: Vec<Lanes>,
    pub alpha: Lanes,
    pub state: usize,
    pub has_state: bool,
    /// All amounts are one: nothing to blend.
    pub acts_fully: bool,
    pub looks_at_speed: bool,
    pub is_of_distance: bool,
}

impl PlacedLaw {
    /// At a port, or at a contact that needs no row; its own states begin at `state`.
    pub fn new(
        law: Law,
        row: Vec<(usize, Lanes)>,
        inputs: Vec<(usize, Lanes)>,
        lanes: Vec<Lanes>,
        alpha: Lanes,
        state: usize,
    ) -> Self {
        PlacedLaw {
            law,
            reaction: row.clone(),
            row,
            pushes: Vec::new(),
            inputs,
            lanes,
            alpha,
            state,
            has_state: law.record().states > 0,
            acts_fully: alpha.0.iter().all(|a| *a == 1.0),
            looks_at_speed: law.looks_at_speed(),
            is_of_distance: law.is_of_distance(),
        }
    }

    #[inline(always)]
    pub fn numbers(&self, at: usize) -> Numbers<'_> {
        Numbers { lanes: &self.lanes, at }
    }
}
