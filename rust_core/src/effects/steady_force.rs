//! A constant force on the frame, such as wind.
use super::effect::*;
use crate::simd::Part;

pub struct SteadyForce;

impl Effect for SteadyForce {
    const RECORD: Record = Record {
        key: "steady_force",
        title: "steady force",
        source: "side wind, or lateral acceleration not balanced by cant; changes the mean values only, which the \
                 comparison band leaves out",
        law: "F = F_0",
        kind: Kind::Force,
        at: &["frame", "frame_yaw"],
        params: &[param("force", "F", "F", [0.3, -100.0, 100.0], "F", FORCE_ORIGIN, Role::Strength)],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        candidate: false,
        diagnosis: Diagnosis::of("steady lateral forces: cant, side wind, drawgear, wheel load differences"),
        shapes: &[],
    };
}

impl Force for SteadyForce {
    const SPEED: bool = false;
    const OF_DISTANCE: bool = true;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [force]: [P; 1] = p.first();
        force
    }
}
