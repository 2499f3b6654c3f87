//! The rail yields sideways under the wheelset.
use super::effect::*;

pub struct RailFlexibility;

impl Effect for RailFlexibility {
    const RECORD: Record = Record {
        key: "rail_flexibility",
        title: "lateral track flexibility",
        source: "Knothe and Grassie, Vehicle System Dynamics 22 (1993), one spring and damper under each wheelset",
        law: "k_r u + c_r u' = -Q_y; u is subtracted from e, u' enters the lateral creep",
        kind: Kind::Rail,
        at: &["track"],
        params: &[
            param("stiffness", "k_r", "N/m", [2e7, 1e6, 1e9], "1", "20 MN/m, an ordinary ballasted track", Role::Shape),
            param("damping", "c_r", "N*s/m", [1e5, 1e3, 1e7], "1", "0.1 MN*s/m, an ordinary ballasted track", Role::Shape),
        ],
        supersedes: Supersedes::RigidRail,
        states: 1,
        odd: true,
        dissipates: true,
        candidate: true,
        diagnosis: Diagnosis { smaller_is_stronger: true, ..Diagnosis::of("track: fastenings and lateral stiffness; measure the rails under load") },
        shapes: &[
            &[2e6, 3e4], &[4e6, 3e4], &[8e6, 3e4], &[1.6e7, 3e4], &[4e7, 1e5], &[2e6, 2e5], &[4e6, 2e5], &[8e6, 2e5],
            &[1.6e7, 2e5], &[4e6, 1e6], &[8e6, 1e6],
        ],
    };

    fn steepest_slopes(p: &[f64], site: &Site) -> Slopes {
        let [stiffness, damping] = first(p);
        Slopes { rate: stiffness / (damping + site.creep_damping), ..Slopes::default() }
    }
}
