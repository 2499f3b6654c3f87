//! Errors of the kernel, with their numbers.
use thiserror::Error;

#[derive(Debug, Error)]
pub enum Error {
    #[error("no vehicle of kind {0:?}; known: bogie, wheelset, rig")]
    Vehicle(String),
    #[error("layout of a vehicle: {0}")]
    Layout(String),
    #[error("no effect {0:?} in the catalogue")]
    Effect(String),
    #[error("{kind} has no curve against {word:?}")]
    Against { kind: String, word: String },
    #[error(
        "a vehicle of kind {kind:?} has no input {word:?}; a rig has force, base_displacement, base_acceleration or motion"
    )]
    Input { kind: String, word: String },
    #[error("{kind} cannot act at {at:?}; its locations are {known}")]
    Place { kind: String, at: String, known: String },
    #[error("this vehicle has no place {at:?} for wheelset {wheelset}")]
    Site { at: String, wheelset: u8 },
    #[error("{first} and {second} both take the place of the same linear term at {at}: only one can")]
    Superseded { first: String, second: String, at: String },
    #[error("no channel {0:?}; this vehicle has {1}")]
    Channel(String, String),
    #[error("{what}: {got} given, {expected} expected")]
    Shape { what: String, got: usize, expected: usize },
    #[error("{what}: {got}, at most {most} are stepped")]
    TooMany { what: &'static str, got: usize, most: usize },
    #[error("{kind} is not described by {got} numbers")]
    Numbers { kind: String, got: usize },
    #[error("{what} is {value}, it must be {rule}")]
    Value { what: String, value: f64, rule: &'static str },
    #[error("{what} is {value}, it must be {rule}")]
    VehicleNumber { what: String, value: f64, rule: &'static str },
    #[error("the fastest motion needs {} steps per sample of {dt} s, {limit} are allowed; {remedy}", count(*.needed))]
    Stiff { needed: f64, dt: f64, limit: usize, remedy: &'static str },
    #[error("interrupted")]
    Interrupted,
}

impl Error {
    /// True for an error of the numbers of a vehicle: a vehicle of the same structure may have a result.
    pub fn is_of_vehicle_numbers(&self) -> bool {
        matches!(self, Error::VehicleNumber { .. } | Error::Stiff { .. })
    }
}

/// Result of the kernel, or its error.
pub type Result<T> = std::result::Result<T, Error>;

/// A count as text: in full, or by its power of ten where it is large.
fn count(n: f64) -> String {
    if n < 1e6 { format!("{n:.0}") } else { format!("{n:.0e}") }
}

/// A count that must match.
pub fn expect_len(what: &str, got: usize, expected: usize) -> Result<()> {
    if got == expected { Ok(()) } else { Err(Error::Shape { what: what.into(), got, expected }) }
}
