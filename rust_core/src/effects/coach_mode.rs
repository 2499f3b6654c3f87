//! The coach is not still: a mass above the frame on a spring and a damper.
use super::effect::*;

pub struct CoachMode;

impl Effect for CoachMode {
    const RECORD: Record = Record {
        key: "coach_mode",
        title: "lateral carbody mode",
        source: "thesis ch. 3 (forces of the carbody); one lateral mode",
        law: "m y_c'' + c (y_c' - y') + k (y_c - y) = 0; F = -k (y - y_c) - c (y' - y_c') on the frame",
        kind: Kind::Body,
        at: &["secondary_lateral"],
        params: &[
            param("mass", "m", "kg", [5.0, 0.1, 30.0], "m", "half a carbody, five times the frame", Role::Shape),
            param("stiffness", "k", "F/z", [1.0, 0.01, 100.0], "k", STIFFNESS_ORIGIN, Role::Shape),
            param("damping", "c", "F*s/z", [1.0, 0.0, 100.0], "c", "the nominal damper's", Role::Shape),
        ],
        supersedes: Supersedes::StiffnessAndDamping,
        states: 2,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis::of("carbody: its lateral mode takes part in the motion; measure it or extend the model"),
        shapes: &[
            &[0.3, 1.0, 1.0], &[1.0, 1.0, 1.0], &[3.0, 1.0, 1.0], &[8.0, 1.0, 1.0], &[1.0, 3.0, 1.0], &[3.0, 3.0, 1.0],
            &[8.0, 3.0, 1.0], &[1.0, 1.0, 0.3], &[3.0, 1.0, 0.3], &[8.0, 1.0, 0.3], &[3.0, 0.3, 1.0],
        ],
    };

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let [mass, stiffness, damping] = first(p);
        Slopes { stiffness, damping, rate: (stiffness / mass).sqrt().max(damping / mass) }
    }
}
