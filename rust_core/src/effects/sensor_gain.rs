//! Sensor: gain of a signal.
use super::effect::*;

pub struct SensorGain;

impl Effect for SensorGain {
    const RECORD: Record = Record {
        key: "sensor_gain",
        title: "sensor gain error",
        source: "x(t) -> gain x(t - delay) + offset; the simulated signal is altered, never the measured one",
        law: "x(t) -> gain x(t), of the simulated signal",
        kind: Kind::Sensor(Alteration::Gain),
        at: &["e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "psi1", "psi2", "z", "vz", "az"],
        params: &[param("gain", "gain", "1", [1.0, -3.0, 3.0], "1", "1, as calibrated", Role::Shape)],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: false,
        candidate: true,
        diagnosis: Diagnosis { followed: true, ..Diagnosis::of("calibration, mounting and unit of channel {place}") },
        shapes: &[&[1.2]],
    };
}
