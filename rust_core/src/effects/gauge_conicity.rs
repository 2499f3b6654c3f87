//! Conicity that follows the gauge.
use super::effect::*;
use crate::simd::Part;

pub struct GaugeConicity;

impl Effect for GaugeConicity {
    const RECORD: Record = Record {
        key: "gauge_conicity",
        title: "conicity that depends on gauge",
        source: "thesis 5.5 (the gauge term); S1002 on 60E1: -15 1/m by the conicity of EN 15302 at 3 mm, about \
                 -30 1/m linearised over an sd of 2 mm; take the value that railui contact prints for the sd of your run",
        law: "lambda = lambda_0 + lambda_g g, g: deviation of the gauge",
        kind: Kind::Rolling,
        at: &["contact"],
        params: &[param(
            "per_gauge",
            "lambda_g",
            "1/m",
            [-15.0, -100.0, 100.0],
            "1",
            "S1002 on 60E1, conicity of EN 15302 at 3 mm; about -30 1/m over an sd of 2 mm",
            Role::Strength,
        )],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: false,
        candidate: true,
        diagnosis: Diagnosis { column: "gauge", ..Diagnosis::of("wheel and rail profiles with the gauge along the line") },
        shapes: &[&[-15.0]],
    };
}

impl Rolling for GaugeConicity {
    #[inline(always)]
    fn roll<P: Part>(p: Numbers<'_>, alpha: P, gauge: P, _s: f64, to: &mut RollingRadius<P>) {
        let [per_gauge]: [P; 1] = p.first();
        to.conicity = (alpha * per_gauge).mul_add(gauge, to.conicity);
    }
}
