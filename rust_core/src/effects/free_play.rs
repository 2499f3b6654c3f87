//! Free play: the nominal spring acts beyond a clearance, nothing inside it.
use super::effect::*;
use crate::simd::Part;

pub struct FreePlay;

impl Effect for FreePlay {
    const RECORD: Record = Record {
        key: "free_play",
        title: "clearance",
        source: "thesis 2.1 (clearance in the axle boxes gives a small limit cycle)",
        law: "F = -k (z - clamp(z, -h, h)) in place of the nominal -k z",
        kind: Kind::Force,
        at: SUSPENSIONS,
        params: &[param(
            "half_width",
            "h",
            "z",
            [0.06, 0.0, 2.0],
            "z",
            "0.3 mm to either side, a worn axle box; up to 10 mm",
            Role::Shape,
        )],
        supersedes: Supersedes::Stiffness,
        states: 0,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { family: STIFFENING, common: 1, followed: true, ..Diagnosis::of("clearance in {place}: guides, bushes, wear plates, pins") },
        shapes: &[&[0.08], &[0.15], &[0.25], &[0.4], &[0.6], &[0.85], &[1.2], &[1.7], &[2.4], &[3.3]],
    };

    // K contains the nominal spring: the effect removes it inside the clearance
    fn prepare(p: &[f64], site: &Site) -> Vec<f64> {
        let [gap] = first(p);
        vec![site.stiffness, gap]
    }
}

impl Force for FreePlay {
    const SPEED: bool = false;

    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, _v: P, _s: f64, _x: P, _dx: &mut P) -> P {
        let [k, gap]: [P; 2] = p.first();
        k * z.clamp(gap)
    }
}
