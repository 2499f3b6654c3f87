//! A spring that the declaration forgot.
use super::effect::*;
use crate::simd::Part;

pub struct Spring;

impl Effect for Spring {
    const RECORD: Record = Record {
        key: "spring",
        title: "spring",
        source: "Hooke; thesis (3.1)",
        law: "F = -k z",
        kind: Kind::Force,
        at: &["secondary_lateral", "secondary_yaw", "primary_lateral", "primary_yaw", "wheelset_yaw", "rig"],
        params: &[param("stiffness", "k", "F/z", [1.0, 0.0, 100.0], "k", STIFFNESS_ORIGIN, Role::Strength)],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { linear: true, common: 4, ..Diagnosis::of("stiffness of {place}: wrong spring, broken leaf or rubber, ice, data sheet") },
        shapes: &[&[1.0]],
    };

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let [stiffness] = first(p);
        Slopes { stiffness, ..Slopes::default() }
    }
}

impl Force for Spring {
    const SPEED: bool = false;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [k]: [P; 1] = p.first();
        -(k * z)
    }
}
