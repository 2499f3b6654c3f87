//! A damper that acts the more, the further it is deflected: made up for a test, in no catalogue.
use super::effect::*;
use crate::simd::Part;

pub struct More;

impl Effect for More {
    const RECORD: Record = Record {
        key: "widening_damper",
        title: "damper that grows with the deflection",
        source: "made up",
        law: "F = -c_z abs(z) v",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[param(
            "damping",
            "c_z",
            "F*s/z^2",
            [1.0, 0.0, 1000.0],
            "c/z",
            "the nominal damper's force at 5 mm (5 mrad)",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { damper: true, ..Diagnosis::of("the made-up damper of {place}") },
        shapes: &[&[1.0]],
    };

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [damping] = first(p);
        Slopes { damping: damping * site.motion, ..Slopes::default() }
    }
}

impl Force for More {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [c]: [P; 1] = p.first();
        -(c * z.abs() * v)
    }
}
