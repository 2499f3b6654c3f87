//! A damper that the declaration forgot.
use super::effect::*;
use crate::simd::Part;

pub struct ViscousDamper;

impl Effect for ViscousDamper {
    const RECORD: Record = Record {
        key: "viscous_damper",
        title: "viscous damper",
        source: "thesis (3.1)",
        law: "F = -c v",
        kind: Kind::Force,
        at: &["secondary_lateral", "secondary_yaw", "primary_lateral", "primary_yaw", "wheelset_yaw", "rig"],
        params: &[param(
            "damping",
            "c",
            "F*s/z",
            [1.0, 0.0, 100.0],
            "c",
            "the nominal damper's, or F at 10 rad/s where there is none",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { linear: true, damper: true, ..Diagnosis::of("dampers of {place}: type, leakage, temperature") },
        shapes: &[&[1.0]],
    };

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let [damping] = first(p);
        Slopes { damping, ..Slopes::default() }
    }
}

impl Force for ViscousDamper {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [c]: [P; 1] = p.first();
        -(c * v)
    }
}
