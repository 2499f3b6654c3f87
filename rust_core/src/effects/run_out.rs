//! Lateral force on a wheelset with the period of a wheel revolution.
use super::effect::*;
use crate::simd::Part;

pub struct RunOut;

impl Effect for RunOut {
    const RECORD: Record = Record {
        key: "run_out",
        title: "lateral force once per wheel revolution",
        source: "any cause with the period of a wheel revolution; not derived from the geometry of a run-out, which acts \
                 mainly as a yaw moment, nor from an unbalance, whose force grows with V^2",
        law: "F = F_0 sin(s/r_e + phase)",
        kind: Kind::Force,
        at: &["wheelset"],
        params: &[
            param("force", "F_0", "N", [1000.0, 0.0, 50000.0], "1", "1 kN, up to a wheel load", Role::Strength),
            param("rolling_radius", "r_e", "m", [1.0, 0.99, 1.01], "r", "the nominal rolling radius +/- 1 %", Role::Shape),
            param("phase", "phase", "rad", [0.0, -1e3, 1e3], "1", "estimated on every run", Role::Run),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        candidate: true,
        diagnosis: Diagnosis::of(
            "{place}, with the period of a wheel revolution: run-out and out-of-roundness of the wheels, axle-box bearings",
        ),
        // the turns of a whole run separate radii that differ by some 0.05 %
        shapes: &[
            &[1000.0, 0.990, 0.0], &[1000.0, 0.991, 0.0], &[1000.0, 0.992, 0.0],
            &[1000.0, 0.993, 0.0], &[1000.0, 0.994, 0.0], &[1000.0, 0.995, 0.0],
            &[1000.0, 0.996, 0.0], &[1000.0, 0.997, 0.0], &[1000.0, 0.998, 0.0],
            &[1000.0, 0.999, 0.0], &[1000.0, 1.000, 0.0], &[1000.0, 1.001, 0.0],
            &[1000.0, 1.002, 0.0], &[1000.0, 1.003, 0.0], &[1000.0, 1.004, 0.0],
            &[1000.0, 1.005, 0.0], &[1000.0, 1.006, 0.0], &[1000.0, 1.007, 0.0],
            &[1000.0, 1.008, 0.0], &[1000.0, 1.009, 0.0], &[1000.0, 1.010, 0.0],
        ],
    };

    fn prepare(p: &[f64], _: &Site) -> Vec<f64> {
        let [force, rolling_radius, phase] = first(p);
        vec![force, 1.0 / rolling_radius, phase]
    }
}

impl Force for RunOut {
    const SPEED: bool = false;
    const OF_DISTANCE: bool = true;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, _v: P, s: f64, _x: P, _dx: &mut P) -> P {
        let [force, per_radius, phase]: [P; 3] = p.first();
        force * (P::splat(s) * per_radius + phase).sin()
    }
}
