//! Flange contact: a stiff spring beyond the clearance between flange and rail.
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
        kind: Kind::Force,
        at: &["contact"],
        params: &[
            param("clearance", "h", "m", [1.0, 0.1, 3.0], "h", "contact.flange_clearance of the design", Role::Shape),
            param("stiffness", "k", "N/m", [14.6e6, 1e5, 1e8], "1", "14.6 MN/m, Kaas-Petersen", Role::Strength),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        shapes: &[
            &[1.0, 5e6], &[0.2, 5e6], &[0.3, 5e6], &[0.4, 5e6], &[0.5, 5e6], &[0.6, 5e6], &[0.7, 5e6], &[0.8, 5e6],
            &[0.9, 5e6], &[1.15, 5e6], &[1.3, 5e6],
        ],
    };

    fn steepest_slopes(p: &[f64], _: &Site) -> Slopes {
        Slopes { stiffness: p[1], ..Slopes::default() }
    }
}

impl Force for FlangeContact {
    const SPEED: bool = false;

    // F = -k (abs(e) - h) sign e beyond h
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, e: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        -(p.get::<P>(1) * (e - e.clamp(p.get(0))))
    }
}

impl Effect for FlangeContactInGauge {
    const RECORD: Record = FlangeContact::RECORD;

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        FlangeContact::steepest_slopes(p, site)
    }
}

/// Without a gauge deviation, which only a wheelset knows: [`in_gauge`].
impl Force for FlangeContactInGauge {
    const SPEED: bool = false;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, e: P, v: P, s: f64, x: P, dx: &mut P) -> P {
        FlangeContact::force(p, e, v, s, x, dx)
    }
}

// F = -k (abs(e) - h - g/2) sign e beyond h + g/2
#[inline(always)]
pub fn in_gauge<P: Part>(p: Numbers<'_>, e: P, gauge: f64) -> P {
    let clearance = (p.get::<P>(0) + P::splat(0.5 * gauge)).max(P::zero());
    -(p.get::<P>(1) * (e - e.clamp(clearance)))
}
