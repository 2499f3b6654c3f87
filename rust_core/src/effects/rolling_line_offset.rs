//! Running band off the middle: unequal diameters or rails worn on one side.
use super::effect::*;
use crate::simd::Part;

pub struct RollingLineOffset;

impl Effect for RollingLineOffset {
    const RECORD: Record = Record {
        key: "rolling_line_offset",
        title: "lateral offset of the running band",
        source: "thesis 5.5; EN 15302 (unequal diameters)",
        law: "(r_1 - r_2)/2 = lambda (e - e_0)",
        kind: Kind::Rolling,
        at: &["contact"],
        params: &[param("offset", "e_0", "m", [1e-3, -2e-2, 2e-2], "1", "1 mm, a worn rail", Role::Strength)],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        candidate: false,
        diagnosis: Diagnosis::of("wheel diameters and rail wear on the two sides"),
        shapes: &[],
    };
}

impl Rolling for RollingLineOffset {
    #[inline(always)]
    fn roll<P: Part>(p: Numbers<'_>, alpha: P, _gauge: P, _s: f64, to: &mut RollingRadius<P>) {
        let [offset]: [P; 1] = p.first();
        to.shift = alpha.mul_add(offset, to.shift);
    }
}
