//! A stop that the suspension meets beyond a gap.
use super::effect::*;
use crate::simd::Part;

pub struct BumpStop;

impl super::Law {
    /// The law of an element of vehicles: a stop.
    pub const STOP: Self = Self::BumpStop;
}

impl Effect for BumpStop {
    const RECORD: Record = Record {
        key: "bump_stop",
        title: "bump stop",
        source: "Iwnicki (ed.), Handbook of Railway Vehicle Dynamics (2006), ch. 3",
        law: "F = -k (abs(z) - h) sign z for abs(z) > h, else 0",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[
            param("gap", "h", "z", [1.0, 0.0, 6.0], "z", "5 mm to either side; up to 30 mm", Role::Shape),
            param("stiffness", "k", "F/z", [3.0, 0.0, 100.0], "k", STIFFNESS_ORIGIN, Role::Strength),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { family: STIFFENING, ..Diagnosis::of("stops of {place}: gap and witness marks") },
        shapes: &[
            &[0.15, 1.0], &[0.3, 1.0], &[0.5, 1.0], &[0.75, 1.0], &[1.0, 1.0], &[1.3, 1.0], &[1.6, 1.0],
            &[2.0, 1.0], &[2.4, 1.0], &[2.9, 1.0],
        ],
    };

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let [_, stiffness] = first(p);
        Slopes { stiffness, ..Slopes::default() }
    }
}

impl Force for BumpStop {
    const SPEED: bool = false;
    const STOP: bool = true;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [gap, k]: [P; 2] = p.first();
        -(k * (z - z.clamp(gap)))
    }
}
