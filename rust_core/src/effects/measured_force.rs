//! Identified curve of force over motion, speed or distance, which the verdict "outside" adds.
use super::polyline;
use super::effect::*;
use crate::simd::Part;
use std::marker::PhantomData;

/// F = f(z), f(v) or f(s): linear between the points of the curve, constant beyond its ends
pub struct CurveOf<X>(PhantomData<X>);

/// Laws of the catalogue's entry; by default the curve is a function of z.
pub type MeasuredForce = CurveOf<Displacement>;
pub type MeasuredForceOfSpeed = CurveOf<Speed>;
pub type MeasuredForceOfDistance = CurveOf<Distance>;

/// The abscissa of a curve.
pub trait Abscissa {
    /// Is it the speed v?
    const SPEED: bool;
    /// Is it the distance run?
    const OF_DISTANCE: bool = false;

    fn of<P: Part>(z: P, v: P, s: f64) -> P;

    /// Largest slope of the curve, for the step size.
    fn slopes(steepest: f64) -> Slopes;
}

pub struct Displacement;
pub struct Speed;
pub struct Distance;

impl Abscissa for Displacement {
    const SPEED: bool = false;

    #[inline(always)]
    fn of<P: Part>(z: P, _v: P, _s: f64) -> P {
        z
    }

    fn slopes(steepest: f64) -> Slopes {
        Slopes { stiffness: steepest, ..Slopes::default() }
    }
}

impl Abscissa for Speed {
    const SPEED: bool = true;

    #[inline(always)]
    fn of<P: Part>(_z: P, v: P, _s: f64) -> P {
        v
    }

    fn slopes(steepest: f64) -> Slopes {
        Slopes { damping: steepest, ..Slopes::default() }
    }
}

impl Abscissa for Distance {
    const SPEED: bool = false;
    const OF_DISTANCE: bool = true;

    #[inline(always)]
    fn of<P: Part>(_z: P, _v: P, s: f64) -> P {
        P::splat(s)
    }

    fn slopes(_: f64) -> Slopes {
        Slopes::default()
    }
}

/// Numbers as they enter: the count n, n motions, n forces.
impl<X: Abscissa> Effect for CurveOf<X> {
    const RECORD: Record = Record {
        key: "measured_force",
        title: "identified restoring-force curve",
        source: "thesis 6.2 (equivalent input signals); linear between the points, constant outside",
        law: "F = f(z), f(v) or f(s), linear between the points, constant beyond the ends",
        kind: Kind::Force,
        at: &[
            "secondary_lateral",
            "secondary_yaw",
            "primary_lateral",
            "primary_yaw",
            "wheelset",
            "wheelset_yaw",
            "frame",
            "frame_yaw",
            "contact",
            "rig",
        ],
        params: &[
            param("motion", "z", "z", [0.0, -1e9, 1e9], "1", "monotone grid, measured", Role::Shape),
            param("force", "F", "F", [0.0, -1e9, 1e9], "1", "measured", Role::Strength),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        candidate: false,
        diagnosis: Diagnosis::of("{place}"),
        shapes: &[],
    };

    fn counts(p: &[f64]) -> bool {
        polyline::counts(p)
    }

    fn prepare(p: &[f64], _: &Site) -> Vec<f64> {
        polyline::prepare(p, 0.0)
    }

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let (x, f) = polyline::points(p);
        let slope = (1..x.len()).map(|i| (f[i] - f[i - 1]).abs() / (x[i] - x[i - 1])).fold(0.0, f64::max);
        X::slopes(slope)
    }
}

impl<X: Abscissa> Force for CurveOf<X> {
    const SPEED: bool = X::SPEED;
    const OF_DISTANCE: bool = X::OF_DISTANCE;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, v: P, s: f64, _x: P, _dx: &mut P) -> P {
        polyline::at(p, X::of(z, v, s))
    }
}
