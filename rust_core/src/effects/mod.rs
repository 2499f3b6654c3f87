//! The catalogue: every effect on one line, under what it acts on.
/// The list, with which a macro is called: here, and in [`law`] for the steps.
macro_rules! laws {
    ($then:ident) => {
        $then! {
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
    };
}

mod polyline;
pub mod law;
pub mod effect;
pub mod port;
pub mod placed;
#[cfg(test)]
mod laws;

use crate::error::Error;
use crate::simd::{Dual, Lanes, Part, Portable};
use effect::{Creep, Creeping, Effect, Force, Numbers, Record, Site, Slopes};
pub use placed::PlacedLaw;
use port::{Action, act_by};

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

            /// F of a force, and x' of its own state into dx; other laws make none.
            #[inline(always)]
            pub fn force<P: Part>(self, p: Numbers<'_>, z: P, v: P, s: f64, x: P, dx: &mut P) -> P {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::force(p, z, v, s, x, dx), $(Law::$choice => <$f::$choice as Force>::force(p, z, v, s, x, dx),)*)*
                    _ => P::zero(),
                }
            }

            /// The action of a port with this law.
            fn action<P: Part>(self) -> Action<P> {
                match self {
                    $($(#[$condition])* Law::$force => act_by::<P, $f::$force>, $(Law::$choice => act_by::<P, $f::$choice>,)*)*
                    _ => unreachable!("only forces act at ports"),
                }
            }

            /// True if the law depends on the speed.
            pub fn looks_at_speed(self) -> bool {
                match self {
                    $($(#[$condition])* Law::$force => <$f::$force as Force>::SPEED, $(Law::$choice => <$f::$choice as Force>::SPEED,)*)*
                    _ => false,
                }
            }
        }
    };
}

laws!(catalogue);

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
}

/// Derivatives with respect to motion, speed and own state.
#[derive(Clone, Copy, Debug)]
pub struct Derivatives {
    pub z: f64,
    pub v: f64,
    pub x: f64,
}
