//! Variation of the running band along the track, where rails are worn or laid to one side.
use super::polyline;
use super::effect::*;
use crate::simd::Part;

pub struct RollingLine;

/// Numbers as they enter: the count n, n places, n offsets.
impl Effect for RollingLine {
    const RECORD: Record = Record {
        key: "rolling_line",
        title: "variation of the running band along the track",
        source: "thesis 5.5; EN 15302 (worn and asymmetric profiles); linear between the points, constant outside",
        law: "(r_1 - r_2)/2 = lambda (e - e_0(s))",
        kind: Kind::Rolling,
        at: &["contact"],
        params: &[
            param("place", "s", "m", [0.0, -1e9, 1e9], "1", "along the track, as the leading wheelset meets it", Role::Shape),
            param("offset", "e_0", "m", [0.0, -2e-2, 2e-2], "1", "measured", Role::Strength),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        // a property of a track, not of a vehicle: an undeclared one is reported as a discrepancy over the distance
        candidate: false,
        diagnosis: Diagnosis::of("rail profiles along the line: side wear, grinding"),
        shapes: &[],
    };

    fn counts(p: &[f64]) -> bool {
        polyline::counts(p)
    }

    // a wheelset that runs behind the first meets every place so much later
    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        polyline::prepare(p, site.behind)
    }
}

impl Rolling for RollingLine {
    #[inline(always)]
    fn roll<P: Part>(p: Numbers<'_>, alpha: P, _gauge: P, s: f64, to: &mut RollingRadius<P>) {
        to.shift = alpha.mul_add(polyline::at(p, P::splat(s)), to.shift);
    }
}
