//! Sensor: offset of a signal.
use super::effect::*;

pub struct SensorOffset;

impl Effect for SensorOffset {
    const RECORD: Record = Record {
        key: "sensor_offset",
        title: "sensor offset",
        source: "x(t) -> gain x(t - delay) + offset; the simulated signal is altered, never the measured one",
        law: "x(t) -> x(t) + offset, of the simulated signal",
        kind: Kind::Sensor(Alteration::Offset),
        at: &["e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "psi1", "psi2", "z", "vz", "az"],
        params: &[param("offset", "offset", "z", [0.0, -1e3, 1e3], "1", "none; visible in the mean only", Role::Shape)],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: false,
        dissipates: false,
        candidate: false,
        diagnosis: Diagnosis::of("zero of channel {place}"),
        shapes: &[],
    };
}
