//! Creep forces of Vermeulen and Johnson: an elliptical contact without spin.
use super::effect::*;
use crate::simd::Part;

pub struct VermeulenJohnson;

impl Effect for VermeulenJohnson {
    const RECORD: Record = Record {
        key: "vermeulen_johnson",
        title: "creep forces of Vermeulen and Johnson",
        source: "Vermeulen and Johnson, Journal of Applied Mechanics 31 (1964); holds without spin",
        law: "T_x = pi/(phi C11) f11 u_x, T_y = pi/(psi C22) f22 u_y, both times 1 - q/3 + q^2/27 for q = abs(T)/(mu N) < 3, \
              else 1/q",
        kind: Kind::Creep,
        at: &["contact"],
        params: &[
            param(
                "friction",
                "mu",
                "1",
                [0.35, 0.01, 1.0],
                "1",
                "dry rail 0.35; wet 0.15; poor adhesion 0.05",
                Role::Shape,
            ),
            param(
                "longitudinal_factor",
                "pi/(phi C11)",
                "1",
                [1.0, 0.1, 3.0],
                "1",
                "1 where kappa_x holds the ellipse factor; `railui contact` gives it for a Kalker kappa_x",
                Role::Shape,
            ),
            param(
                "lateral_factor",
                "pi/(psi C22)",
                "1",
                [1.0, 0.1, 3.0],
                "1",
                "1 where kappa_y holds the ellipse factor; `railui contact` gives it for a Kalker kappa_y",
                Role::Shape,
            ),
        ],
        supersedes: Supersedes::CreepForces,
        states: 0,
        odd: true,
        dissipates: true,
        // but for the spin part it is creep_saturation: measured motions cannot separate the two
        candidate: false,
        diagnosis: Diagnosis::of(ADHESION),
        shapes: &[],
    };

    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let [friction, longitudinal, lateral] = first(p);
        vec![per_square_of_sliding(friction * site.wheel_load), longitudinal, lateral]
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [_, longitudinal, lateral] = first(p);
        Slopes { damping: (longitudinal.max(lateral) - 1.0).max(0.0) * site.creep_damping, ..Slopes::default() }
    }
}

impl Creep for VermeulenJohnson {
    #[inline(always)]
    fn forces<P: Part>(p: Numbers<'_>, wheel: &Creeping<P>) -> [P; 2] {
        let [per_square, longitudinal, lateral]: [P; 3] = p.first();
        let tx = longitudinal * wheel.tx;
        let ty = lateral * (wheel.ty - wheel.spin);
        let factor = saturated(tx.mul_add(tx, ty * ty) * per_square);
        [factor * tx, factor * ty]
    }
}
