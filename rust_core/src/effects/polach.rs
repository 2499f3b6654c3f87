//! Creep forces of Polach: adhesion and slip reduced apart, friction that falls with the speed of slip.
use super::effect::*;
use crate::simd::Part;

pub struct Polach;

impl Effect for Polach {
    const RECORD: Record = Record {
        key: "polach",
        title: "creep forces of Polach",
        source: "Polach, Vehicle System Dynamics Supplement 33 (1999); Wear 258 (2005) for the reductions and the falling \
                 friction; spin enters with its part of the linear lateral force, which holds where spin is small",
        law: "F = (2 mu N/pi) (k_A e/(1 + (k_A e)^2) + atan(k_S e)), e = (pi/4) T_linear/(mu N), mu = mu_0 ((1 - A) \
              exp(-B w) + A), w: sliding speed",
        kind: Kind::Creep,
        at: &["contact"],
        params: &[
            param(
                "friction",
                "mu_0",
                "1",
                [0.4, 0.01, 1.0],
                "1",
                "at no slip: dry rail 0.55, wet 0.30 (Polach 2005); 0.4 between them",
                Role::Shape,
            ),
            param(
                "adhesion_reduction",
                "k_A",
                "1",
                [1.0, 0.01, 1.0],
                "1",
                "1 for clean surfaces (1999); dry 1.00, wet 0.30 (2005)",
                Role::Shape,
            ),
            param(
                "slip_reduction",
                "k_S",
                "1",
                [1.0, 0.01, 1.0],
                "1",
                "1 for clean surfaces (1999); dry 0.40, wet 0.10 (2005); at most k_A",
                Role::Shape,
            ),
            param(
                "friction_ratio",
                "A",
                "1",
                [1.0, 0.01, 1.0],
                "1",
                "friction at endless over that at no slip: 1 (1999); 0.40 (2005)",
                Role::Shape,
            ),
            param(
                "friction_decay",
                "B",
                "s/m",
                [0.0, 0.0, 10.0],
                "1",
                "0 (1999); dry 0.60, wet 0.20 s/m (2005)",
                Role::Shape,
            ),
        ],
        supersedes: Supersedes::CreepForces,
        states: 0,
        odd: true,
        dissipates: true,
        // a saturation like creep_saturation, within 10 % of it: measured motions cannot separate them
        candidate: false,
        diagnosis: Diagnosis::of(ADHESION),
        shapes: &[],
    };

    // pi/(4 mu_0 N), k_A, k_S, A, B; 1/(kappa_x N), 1/(kappa_y N)
    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let soft = site.creep_slopes.map(|slope| if slope > 0.0 { 1.0 / slope } else { 0.0 });
        let ([friction, adhesion, slip, ratio, decay], [soft_x, soft_y]) = (first(p), soft);
        let per_force = std::f64::consts::FRAC_PI_4 / (friction * site.wheel_load);
        vec![per_force, adhesion, slip, ratio, -decay, soft_x, soft_y]
    }
}

impl Creep for Polach {
    // the factor on T: (k_A/(1 + (k_A e)^2) + k_S atan(k_S e)/(k_S e))/2
    #[inline(always)]
    fn forces<P: Part>(p: Numbers<'_>, wheel: &Creeping<P>) -> [P; 2] {
        let (one, half) = (P::splat(1.0), P::splat(0.5));
        let [per_force, k_a, k_s, last, decay, soft_x, soft_y]: [P; 7] = p.first();
        let (falls, mut per_limit) = (one - last, per_force);
        // where friction falls in no lane, no speed of slip is asked for
        if falls.any_from(P::splat(f64::MIN_POSITIVE)) {
            let (along, across) = (wheel.tx * soft_x, (wheel.ty - wheel.spin) * soft_y);
            let slip = wheel.speed * along.mul_add(along, across * across).sqrt();
            per_limit = per_force / falls.mul_add((slip * decay).exp_below_zero(), last);
        }
        let e = wheel.tx.mul_add(wheel.tx, wheel.ty * wheel.ty).sqrt() * per_limit;
        // both quotients over one denominator
        let (adhesion, [arc, sliding]) = (k_a * e, (k_s * e).atan_fraction());
        let sticking = adhesion.mul_add(adhesion, one);
        let factor = half * k_a.mul_add(sliding, k_s * arc * sticking) / (sticking * sliding);
        [factor * wheel.tx, factor * wheel.ty]
    }
}
