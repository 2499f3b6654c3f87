//! A spring whose stiffness differs between the two sides.
use super::effect::*;
use crate::simd::Part;

pub struct QuadraticStiffness;

impl Effect for QuadraticStiffness {
    const RECORD: Record = Record {
        key: "quadratic_stiffness",
        title: "quadratic (asymmetric) stiffness",
        source: "first even term of a spring's characteristic; Nayfeh and Mook, Nonlinear Oscillations (1979)",
        law: "F = -k2 z^2",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[param(
            "stiffness",
            "k2",
            "F/z^2",
            [1.0, -300.0, 300.0],
            "k/z",
            "doubles the nominal spring's force at 5 mm (5 mrad) on one side",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis::of("unequal springs or a preload at {place}: travel to either side"),
        shapes: &[&[0.3]],
    };

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [stiffness] = first(p);
        Slopes { stiffness: 2.0 * stiffness.abs() * site.motion, ..Slopes::default() }
    }
}

impl Force for QuadraticStiffness {
    const SPEED: bool = false;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [k]: [P; 1] = p.first();
        -(k * z * z)
    }
}
