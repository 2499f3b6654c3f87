//! A damper that is stronger in one direction.
use super::effect::*;
use crate::simd::Part;

pub struct AsymmetricDamper;

impl Effect for AsymmetricDamper {
    const RECORD: Record = Record {
        key: "asymmetric_damper",
        title: "asymmetric damper",
        source: "Iwnicki (ed.), Handbook of Railway Vehicle Dynamics (2006), ch. 3",
        law: "F = -r c v for v > 0, else 0, in addition to the nominal -c v",
        kind: Kind::Force,
        at: &["secondary_lateral", "secondary_yaw", "rig"],
        params: &[param(
            "ratio",
            "r",
            "1",
            [0.5, -1.0, 10.0],
            "1",
            "half as strong again in one direction",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { damper: true, ..Diagnosis::of("dampers of {place}: compression and extension on a test bench") },
        shapes: &[&[0.5]],
    };

    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let [ratio] = first(p);
        vec![ratio * site.damping]
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [ratio] = first(p);
        Slopes { damping: (ratio * site.damping).max(0.0), ..Slopes::default() }
    }
}

impl Force for AsymmetricDamper {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [c]: [P; 1] = p.first();
        -(c * v.max(P::zero()))
    }
}
