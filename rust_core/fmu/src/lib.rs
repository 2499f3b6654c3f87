//! A vehicle as a functional mock-up unit: the C functions of FMI 3.0 for co-simulation over the kernel.
//!
//! One communication step is one sample of the track. The inputs are the track under the leading wheelset and its slopes;
//! between two samples it is the cubic of these values and slopes, and the other wheelsets meet it later. The outputs at a
//! communication point are those of the vehicle one step before: the track at the end of a step is known only then.
mod description;
mod functions;
mod history;
mod instance;
mod unsupported;
mod vehicle;
