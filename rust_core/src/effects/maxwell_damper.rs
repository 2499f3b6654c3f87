//! A damper in series with its mounting spring, blowing off at a largest force.
use super::effect::*;
use crate::simd::Part;

pub struct MaxwellDamper;

impl super::Law {
    /// The law of an element of vehicles: a spring and a damper in series.
    pub const SERIES: Self = Self::MaxwellDamper;
}

impl Effect for MaxwellDamper {
    const RECORD: Record = Record {
        key: "maxwell_damper",
        title: "damper in series with a spring (Maxwell)",
        source: "Maxwell 1867; yaw dampers: Bruni et al., Vehicle System Dynamics 49 (2011)",
        law: "F = -f, f' = k v - (k/c) f, abs(f) at most the blow-off force F_b",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[
            param("stiffness", "k", "F/z", [1.0, 0.01, 1000.0], "k", "as stiff as the nominal spring; a mounting may be a thousand times it", Role::Strength),
            param(
                "damping",
                "c",
                "F*s/z",
                [1.0, 0.001, 100.0],
                "k/w",
                "corner at 10 rad/s with the nominal spring",
                Role::Shape,
            ),
            param(
                "blow_off",
                "F_b",
                "F",
                [1e9, 0.001, 1e9],
                "F",
                "no limit unless a design gives one",
                Role::Optional,
            ),
        ],
        supersedes: Supersedes::Nothing,
        states: 1,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { family: STICKING, damper: true, ..Diagnosis::of("mountings and bushes of the dampers of {place}") },
        // corner frequencies k/c from 1 to 150 rad/s
        shapes: &[
            &[1.0, 10.0], &[1.0, 4.0], &[1.0, 2.0], &[1.0, 1.0], &[1.0, 0.5], &[1.0, 0.25], &[1.0, 0.13], &[1.0, 0.067],
        ],
    };

    fn prepare(p: &[f64], _: &Site) -> Vec<f64> {
        let [stiffness, damping, blow_off] = first(p);
        vec![stiffness, stiffness / damping, blow_off]
    }

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let [stiffness, damping] = first(p);
        Slopes { stiffness, damping: 0.0, rate: stiffness / damping }
    }

    // f that overshoots within a step would come back late: an error of first order
    fn largest(p: &[f64]) -> Option<f64> {
        let [_, _, blow_off] = first(p);
        Some(blow_off)
    }
}

impl Force for MaxwellDamper {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, v: P, _s: f64, f: P, df: &mut P) -> P {
        let [k, corner, limit]: [P; 3] = p.first();
        let rate = k * v - corner * f;
        let outwards = (P::zero()).if_less(rate * f, P::zero(), rate);
        *df = f.abs().if_less(limit, rate, outwards);
        -f.clamp(limit)
    }
}
