//! Conicity that grows, or falls, with the amplitude.
use super::effect::*;
use crate::simd::Part;

pub struct NonlinearConicity;

impl Effect for NonlinearConicity {
    const RECORD: Record = Record {
        key: "nonlinear_conicity",
        title: "conicity that depends on amplitude",
        source: "thesis 5.5 (polynomial form of the contact geometry)",
        law: "(r_1 - r_2)/2 = lambda e (1 + l3 e^2)",
        kind: Kind::Rolling,
        at: &["contact"],
        params: &[param(
            "cubic",
            "l3",
            "1/m^2",
            [2e4, -1e6, 1e6],
            "1",
            "half as conical again at 5 mm",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: false,
        candidate: true,
        diagnosis: Diagnosis::of("wheel profiles: hollow wear; measure them and use them in the model"),
        shapes: &[&[2e4]],
    };
}

impl Rolling for NonlinearConicity {
    #[inline(always)]
    fn roll<P: Part>(p: Numbers<'_>, alpha: P, _gauge: P, _s: f64, to: &mut RollingRadius<P>) {
        let [cubic]: [P; 1] = p.first();
        to.cubic = alpha.mul_add(cubic, to.cubic);
    }
}
