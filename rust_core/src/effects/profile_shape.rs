//! Shape of the measured profiles: rolling radii and contact angles against the displacement, as they are.
use super::effect::*;
use crate::numeric::profile_spline;

pub struct ProfileShape;

/// Numbers as they enter: the count n, the first displacement, the step between two; then n of each list.
impl Effect for ProfileShape {
    const RECORD: Record = Record {
        key: "profile_shape",
        title: "shape of the wheel and rail profiles",
        source: "measured profiles, rigid contact (thesis 2.2, 5.5); natural cubic spline, straight beyond its ends",
        law: "(r_1 - r_2)/2 = lambda (S(e) + dS/dg(e) g), b (gamma_1 - gamma_2)/2 = epsilon T(e), from measured \
              profiles",
        kind: Kind::Profile,
        at: &["contact"],
        params: &[
            param("displacement", "e", "m", [0.0, -0.1, 0.1], "1", "equally spaced", Role::Shape),
            param("radius", "S", "m", [0.0, -1.0, 1.0], "1", "(r_1 - r_2)/2 over lambda", Role::Shape),
            param("radius_per_gauge", "dS/dg", "1", [0.0, -1e3, 1e3], "1", "its change with the gauge", Role::Shape),
            param("angle", "T", "m", [0.0, -1.0, 1.0], "1", "b (gamma_1 - gamma_2)/2 over epsilon", Role::Shape),
        ],
        supersedes: Supersedes::RollingRadii,
        states: 0,
        odd: false,
        dissipates: false,
        // comes with the profiles of the design: nothing to search for
        candidate: false,
        diagnosis: Diagnosis::of("wheel and rail profiles"),
        shapes: &[],
    };

    fn counts(p: &[f64]) -> bool {
        matches!(p, [count, _, step, values @ ..] if values.len() > 5 && values.len() as f64 == 3.0 * count && *step > 0.0)
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let steepest = profile_spline::steepest_angle(p);
        Slopes { stiffness: site.gravitational * (steepest - 1.0).max(0.0), ..Slopes::default() }
    }
}
