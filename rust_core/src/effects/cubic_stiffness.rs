//! A spring that stiffens, or softens, with the cube of the deflection.
use super::effect::*;
use crate::simd::Part;

pub struct CubicStiffness;

impl Effect for CubicStiffness {
    const RECORD: Record = Record {
        key: "cubic_stiffness",
        title: "cubic stiffness",
        source: "Duffing 1918; rubber springs: Bruni et al., Vehicle System Dynamics 49 (2011)",
        law: "F = -k3 z^3",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[param(
            "stiffness",
            "k3",
            "F/z^3",
            [1.0, -30.0, 1000.0],
            "k/z^2",
            "doubles the nominal spring's force at 5 mm (5 mrad)",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { family: STIFFENING, ..Diagnosis::of("progressive springs or rubber of {place}; force against deflection on a test bench") },
        shapes: &[&[0.3]],
    };

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [stiffness] = first(p);
        Slopes { stiffness: (3.0 * stiffness * site.motion * site.motion).max(0.0), ..Slopes::default() }
    }
}

impl Force for CubicStiffness {
    const SPEED: bool = false;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [k]: [P; 1] = p.first();
        -(k * z * z * z)
    }
}
