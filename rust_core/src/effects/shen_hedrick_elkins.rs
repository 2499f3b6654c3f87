//! Creep forces of Shen, Hedrick and Elkins: Kalker's coefficients with spin, cut down for the rail's surface.
use super::effect::*;
use crate::simd::Part;

pub struct ShenHedrickElkins;

impl Effect for ShenHedrickElkins {
    const RECORD: Record = Record {
        key: "shen_hedrick_elkins",
        title: "creep forces of Shen, Hedrick and Elkins",
        source: "Shen, Hedrick and Elkins, 8th IAVSD Symposium (1983); holds where spin is small (tread contact). \
                 Surface factor: Hobbs, British Rail DYN 52 (1967)",
        law: "T_x = k f11 u_x, T_y = k (f22 u_y + f23 u_n), both times 1 - q/3 + q^2/27 for q = abs(T)/(mu N) < 3, \
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
                "surface",
                "k",
                "1",
                [1.0, 0.1, 1.5],
                "1",
                "1 where the coefficients were measured; 0.5 to 0.7 where they are Kalker's",
                Role::Shape,
            ),
        ],
        supersedes: Supersedes::CreepForces,
        states: 0,
        odd: true,
        dissipates: true,
        // with measured coefficients (surface 1) it is creep_saturation itself
        candidate: false,
        diagnosis: Diagnosis::of(ADHESION),
        shapes: &[],
    };

    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let [friction, surface] = first(p);
        vec![per_square_of_sliding(friction * site.wheel_load), surface]
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [_, surface] = first(p);
        Slopes { damping: (surface - 1.0).max(0.0) * site.creep_damping, ..Slopes::default() }
    }
}

impl Creep for ShenHedrickElkins {
    #[inline(always)]
    fn forces<P: Part>(p: Numbers<'_>, wheel: &Creeping<P>) -> [P; 2] {
        let [per_square, surface]: [P; 2] = p.first();
        let (tx, ty) = (surface * wheel.tx, surface * wheel.ty);
        let factor = saturated(tx.mul_add(tx, ty * ty) * per_square);
        [factor * tx, factor * ty]
    }
}
