//! Dry friction, smoothed over a slip speed.
use super::effect::*;
use crate::simd::Part;

pub struct DryFriction;

impl Effect for DryFriction {
    const RECORD: Record = Record {
        key: "dry_friction",
        title: "dry friction",
        source: "Coulomb 1785, smoothed: Bruni et al., Vehicle System Dynamics 49 (2011)",
        law: "F = -F_c tanh(v/v_0)",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[
            param("force", "F_c", "F", [0.3, 0.0, 100.0], "F", FORCE_ORIGIN, Role::Strength),
            param(
                "slip_speed",
                "v_0",
                "v",
                [0.1, 0.002, 4.0],
                "v",
                "5 mm/s (5 mrad/s), a tenth of the reference speed",
                Role::Shape,
            ),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { family: STICKING, undetermined_at_rest: true, common: 2, followed: true, ..Diagnosis::of("sliding surfaces of {place}: wear, lubrication, friction dampers") },
        shapes: &[&[0.5, 0.03], &[0.5, 0.08], &[0.5, 0.2], &[0.5, 0.5], &[0.5, 1.2]],
    };

    fn prepare(p: &[f64], _: &Site) -> Vec<f64> {
        let [force, slip_speed] = first(p);
        vec![force, 1.0 / slip_speed]
    }

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        let [force, slip_speed] = first(p);
        Slopes { damping: force / slip_speed, ..Slopes::default() }
    }
}

impl Force for DryFriction {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, _z: P, v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [force, per_slip_speed]: [P; 2] = p.first();
        -(force * (v * per_slip_speed).tanh())
    }
}
