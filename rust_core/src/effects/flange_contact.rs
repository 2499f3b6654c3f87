//! Flange contact: a stiff spring beyond the clearance between flange and rail, and the friction of the flange.
use super::effect::*;
use crate::simd::Part;

pub struct FlangeContact;

/// The same with the clearance h + g/2, g the gauge deviation under the wheelset; nothing where that is below zero.
pub struct FlangeContactInGauge;

impl Effect for FlangeContact {
    const RECORD: Record = Record {
        key: "flange_contact",
        title: "flange contact",
        source: "thesis 2.2; stiffness: Cooperrider 1972, Kaas-Petersen 1986",
        law: "F = -k (abs(e) - h) sign e for abs(e) > h, else 0; with mu > 0 also the creep force of a flange d below the tread, \
              inclined by gamma, under the load abs(F)/sin(gamma)",
        kind: Kind::Force,
        at: &["contact"],
        params: &[
            param("clearance", "h", "m", [1.0, 0.1, 3.0], "h", "contact.flange_clearance of the design", Role::Shape),
            param("stiffness", "k", "N/m", [14.6e6, 1e5, 1e8], "1", "14.6 MN/m, Kaas-Petersen", Role::Strength),
            param("friction", "mu", "1", [0.0, 0.0, 1.0], "1", "none unless a design gives it; dry 0.35", Role::Optional),
            param("depth", "d", "m", [0.01, 1e-3, 0.03], "1", "10 mm below the tread", Role::Optional),
            param("angle", "gamma", "rad", [1.2217, 0.5, 1.5], "1", "70 degrees", Role::Optional),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { common: 6, ..Diagnosis::of("wheel flanges and gauge: flange thickness, track gauge, clearance") },
        shapes: &[
            &[1.0, 5e6], &[0.2, 5e6], &[0.3, 5e6], &[0.4, 5e6], &[0.5, 5e6], &[0.6, 5e6], &[0.7, 5e6], &[0.8, 5e6],
            &[0.9, 5e6], &[1.15, 5e6], &[1.3, 5e6],
        ],
    };

    /// All, or those of a flange without friction.
    fn counts(p: &[f64]) -> bool {
        matches!(p.len(), 2 | 5)
    }

    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let (&[clearance, stiffness], friction) = p.split_first_chunk().expect("counted");
        let &[mu, depth, angle] = friction else { return p.to_vec() };
        let (sin, cos) = angle.sin_cos();
        // no force instead of an infinite 1/mu
        let (limit, normal) = if mu > 0.0 { (per_square_of_sliding(mu), 1.0 / sin) } else { (1.0, 0.0) };
        let [x, y] = site.creep_slopes.map(|slope| site.wheel_load / slope);
        let load = site.wheel_load;
        vec![clearance, stiffness, normal, limit, 1.0 / load, depth / load, 1.0 / (load * cos), cos, x, y]
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [_, stiffness] = first(p);
        // as steep as both wheels: a flange under twice the wheel load
        let damping = if Self::slides(p) { site.creep_damping } else { 0.0 };
        Slopes { stiffness, damping, ..Slopes::default() }
    }
}

impl Force for FlangeContact {
    const SPEED: bool = false;
    const STOP: bool = true;

    // F = -k (abs(e) - h) sign e beyond h
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, e: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [clearance, k]: [P; 2] = p.first();
        -(k * (e - e.clamp(clearance)))
    }

    fn slides(p: &[f64]) -> bool {
        matches!(p, [_, _, mu, ..] if *mu > 0.0)
    }

    // t_x = kappa_x (dr/r + b psi'/V + d/r sign e), t_y = kappa_y u_y/cos gamma, N_f = abs(F)/sin gamma;
    // T = N_f t (1 - q/3 + q^2/27) for q = abs(t)/mu < 3, else mu N_f t/abs(t). T_y cos gamma acts across.
    #[inline(always)]
    fn friction<P: Part>(p: Numbers<'_>, of: &Flanging<P>) -> ([P; 2], P) {
        if p.lanes.len() == 2 {
            return ([P::zero(); 2], P::zero());
        }
        let [_, _, normal, per_square, per_load, depth, per_load_cos, cos, soft_x, soft_y]: [P; 10] = p.first();
        let deeper = depth * of.kx_r;
        let tx = of.tx.mul_add(per_load, of.force.if_less(P::zero(), deeper, -deeper));
        let ty = of.ty * per_load_cos;
        let square = tx.mul_add(tx, ty * ty);
        let force = of.force.abs() * normal * saturated(square * per_square);
        let wear = force * (tx * tx).mul_add(soft_x, ty * ty * soft_y);
        ([force * tx, force * ty * cos], wear)
    }
}

impl Effect for FlangeContactInGauge {
    const RECORD: Record = FlangeContact::RECORD;

    fn counts(p: &[f64]) -> bool {
        FlangeContact::counts(p)
    }

    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        FlangeContact::prepare(p, site)
    }

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        FlangeContact::steepest_slopes(p, site)
    }
}

impl Force for FlangeContactInGauge {
    const SPEED: bool = false;

    /// Without a gauge deviation, which only a wheelset knows.
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, e: P, v: P, s: f64, x: P, dx: &mut P) -> P {
        FlangeContact::force(p, e, v, s, x, dx)
    }

    // F = -k (abs(e) - h - g/2) sign e beyond h + g/2
    #[inline(always)]
    fn at_contact<P: Part>(p: Numbers<'_>, e: P, _v: P, _s: f64, gauge: f64) -> P {
        let [clearance, k]: [P; 2] = p.first();
        let clearance: P = (clearance + P::splat(0.5 * gauge)).max(P::zero());
        -(k * (e - e.clamp(clearance)))
    }

    fn slides(p: &[f64]) -> bool {
        FlangeContact::slides(p)
    }

    #[inline(always)]
    fn friction<P: Part>(p: Numbers<'_>, of: &Flanging<P>) -> ([P; 2], P) {
        FlangeContact::friction(p, of)
    }
}
