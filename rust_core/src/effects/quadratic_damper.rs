//! A hydraulic damper whose force grows with the square of the speed.
use super::effect::*;
use crate::simd::Part;

pub struct QuadraticDamper;

impl Effect for QuadraticDamper {
    const RECORD: Record = Record {
        key: "quadratic_damper",
        title: "quadratic damper",
        source: "orifice flow; Bruni et al., Vehicle System Dynamics 49 (2011)",
        law: "F = -c2 abs(v) v",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[param(
            "damping",
            "c2",
            "F*s^2/z^2",
            [1.0, 0.0, 1000.0],
            "c/v",
            "the nominal damper's force at 50 mm/s (50 mrad/s)",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { damper: true, ..Diagnosis::of("dampers of {place}: valve characteristic on a test bench") },
        shapes: &[&[1.0]],
    };

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [damping] = first(p);
        Slopes { damping: 2.0 * damping * site.speed, ..Slopes::default() }
    }
}

impl Force for QuadraticDamper {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [c]: [P; 1] = p.first();
        -(c * v.abs() * v)
    }
}
