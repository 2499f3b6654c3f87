//! Sensor time delay.
use super::effect::*;

pub struct SensorDelay;

impl Effect for SensorDelay {
    const RECORD: Record = Record {
        key: "sensor_delay",
        title: "sensor time delay",
        source: "x(t) -> gain x(t - delay) + offset; the simulated signal is altered, never the measured one",
        law: "x(t) -> x(t - tau), of the simulated signal",
        kind: Kind::Sensor(Alteration::Delay),
        at: &["e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2", "psi1", "psi2", "z", "vz", "az", "F"],
        params: &[param("delay", "tau", "s", [0.0, -0.05, 0.05], "1", "none; up to 50 ms either way", Role::Shape)],
        supersedes: Supersedes::Nothing,
        states: 0,
        odd: true,
        dissipates: false,
        candidate: true,
        diagnosis: Diagnosis::of("clock, filter and anti-alias settings of channel {place}"),
        shapes: &[&[0.004]],
    };
}
