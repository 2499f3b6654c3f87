//! A measured curve of force against motion or speed: what the verdict "outside" adds.
use super::curve;
use super::effect::*;
use crate::lanes::Part;

/// F = f(z), f(v) or f(s): linear between the points of the curve, held beyond its ends
pub struct MeasuredForce;

/// Numbers as they enter: 0 (against z), 1 (v) or 2 (s), the count n, n motions, n forces.
impl Effect for MeasuredForce {
    const RECORD: Record = Record {
        key: "measured_force",
        title: "measured curve of force",
        source: "thesis 6.2 (equivalent input signals); linear between the points, held outside",
        kind: Kind::Force,
        at: &[
            "secondary_lateral",
            "secondary_yaw",
            "primary_lateral",
            "primary_yaw",
            "wheelset",
            "wheelset_yaw",
            "frame",
            "frame_yaw",
            "contact",
            "rig",
        ],
        params: &[
            param("motion", "z", "z", [0.0, -1e9, 1e9], "1", "monotone grid, measured", Role::Shape),
            param("force", "F", "F", [0.0, -1e9, 1e9], "1", "measured", Role::Strength),
        ],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        candidate: false,
        shapes: &[],
    };

    fn counts(p: &[f64]) -> bool {
        p.split_first().is_some_and(|(_, curve)| curve::counts(curve))
    }

    // against, then the curve
    fn prepare(p: &[f64], _: &Site) -> Vec<f64> {
        [vec![p[0]], curve::prepare(&p[1..], 0.0)].concat()
    }

    fn stiffest(p: &[f64], _: &Site) -> Slopes {
        let (x, f) = curve::points(&p[1..]);
        let slope = (1..x.len()).map(|i| (f[i] - f[i - 1]).abs() / (x[i] - x[i - 1])).fold(0.0, f64::max);
        match p[0] as u8 {
            0 => Slopes { stiffness: slope, ..Slopes::default() },
            1 => Slopes { damping: slope, ..Slopes::default() },
            _ => Slopes::default(),
        }
    }
}

impl Force for MeasuredForce {
    #[inline(always)]
    fn force<P: Part>(p: Numbers<'_>, z: P, v: P, s: f64, _x: P, _dx: &mut P) -> P {
        let at = match p.lanes[0].0[0] as u8 {
            0 => z,
            1 => v,
            _ => P::splat(s),
        };
        curve::at(p, 1, at)
    }
}
