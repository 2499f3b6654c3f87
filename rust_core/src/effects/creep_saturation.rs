//! Saturation of the creep forces at the friction limit.
use super::effect::*;
use crate::simd::Part;

pub struct CreepSaturation;

impl Effect for CreepSaturation {
    const RECORD: Record = Record {
        key: "creep_saturation",
        title: "saturation of the creep forces",
        source: "Vermeulen and Johnson, Journal of Applied Mechanics 31 (1964); Shen, Hedrick and Elkins 1983",
        law: "T = T_linear (1 - q/3 + q^2/27) for q = abs(T_linear)/(mu N) < 3, else mu N T_linear/abs(T_linear)",
        kind: Kind::Creep,
        at: &["contact"],
        params: &[param(
            "friction",
            "mu",
            "1",
            [0.35, 0.01, 1.0],
            "1",
            "dry rail 0.35; wet 0.15; poor adhesion 0.05",
            Role::Shape,
        )],
        supersedes: Supersedes::CreepForces,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { smaller_is_stronger: true, common: 3, ..Diagnosis::of(ADHESION) },
        shapes: &[&[0.04], &[0.07], &[0.1], &[0.15], &[0.2], &[0.28], &[0.4], &[0.6]],
    };

    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let [friction] = first(p);
        vec![per_square_of_sliding(friction * site.wheel_load)]
    }
}

impl Creep for CreepSaturation {
    const CUBIC: bool = true;

    // q = T/(mu N); factor 1 - q/3 + q^2/27 for q < 3, else 1/q
    #[inline(always)]
    fn forces<P: Part>(p: Numbers<'_>, wheel: &Creeping<P>) -> [P; 2] {
        let [per_square]: [P; 1] = p.first();
        let factor = saturated(wheel.tx.mul_add(wheel.tx, wheel.ty * wheel.ty) * per_square);
        [factor * wheel.tx, factor * wheel.ty]
    }
}
