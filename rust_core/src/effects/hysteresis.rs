//! Hysteresis of a friction spring: the element of Bouc and Wen.
use super::effect::*;
use crate::simd::Part;

pub struct Hysteresis;

impl Effect for Hysteresis {
    const RECORD: Record = Record {
        key: "hysteresis",
        title: "hysteresis (Bouc-Wen)",
        source: "Bouc 1967; Wen, J. Eng. Mech. Div. ASCE 102 (1976), n = 2",
        law: "F = -F_y x, x' = (k/F_y) (v - (abs(v) abs(x) x + v x^2)/2)",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[
            param("stiffness", "k", "F/z", [1.0, 0.01, 100.0], "k", STIFFNESS_ORIGIN, Role::Shape),
            param("yield", "F_y", "F", [0.3, 0.003, 100.0], "F", FORCE_ORIGIN, Role::Strength),
        ],
        supersedes: Supersedes::Nothing,
        states: 1,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { family: STICKING, undetermined_at_rest: true, common: 5, ..Diagnosis::of("rubber, leaf springs or friction dampers of {place}: force against deflection on a test bench") },
        shapes: &[
            &[0.3, 0.1], &[0.3, 0.3], &[0.3, 1.0], &[1.0, 0.1], &[1.0, 0.3], &[1.0, 1.0], &[3.0, 0.1], &[3.0, 0.3],
            &[3.0, 1.0], &[10.0, 0.1], &[10.0, 0.3], &[10.0, 1.0],
        ],
    };

    fn prepare(p: &[f64], _: &Site) -> Vec<f64> {
        let [stiffness, yield_force] = first(p);
        vec![stiffness / yield_force, yield_force]
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [stiffness, yield_force] = first(p);
        Slopes { stiffness, damping: 0.0, rate: 2.0 * stiffness / yield_force * site.usual_speed }
    }

    // x never leaves -1 to 1, but a step may where the spring yields within it: held there, it is stable at any speed
    fn largest(_: &[f64]) -> Option<f64> {
        Some(1.0)
    }
}

impl Force for Hysteresis {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, v: P, _s: f64, x: P, dx: &mut P) -> P {
        let x = x.clamp(P::splat(1.0));
        let bend = P::splat(0.5) * (v.abs() * x.abs() * x + v * x * x);
        let [rate, yield_force]: [P; 2] = p.first();
        *dx = rate * (v - bend);
        -(yield_force * x)
    }
}
