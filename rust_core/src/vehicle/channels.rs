//! Channels of a vehicle as terms of its state and its input row.
use crate::simd::Lanes;
use crate::wheel_rail::guiding::Guiding;

/// Terms of a sum: places and factors.
type Terms = Vec<(usize, Lanes)>;

/// A channel as terms of x and x' and of the input row.
#[derive(Clone, Debug, Default)]
pub struct Reading {
    pub name: String,
    pub state: Terms,
    pub rate: Terms,
    pub inputs: Terms,
    /// Columns that the speed multiplies, with the lane's share of the speed.
    pub rates: Terms,
    /// The lateral forces of the wheels of a wheelset on the rails, added to the terms above.
    pub guiding: Option<Box<Guiding>>,
}

impl Reading {
    /// A share of it.
    pub fn times(&self, share: f64) -> Self {
        let part = |terms: &Terms| terms.iter().map(|(i, a)| (*i, Lanes::from_fn(|l| share * a.0[l]))).collect();
        let [state, rate, inputs, rates] = [&self.state, &self.rate, &self.inputs, &self.rates].map(part);
        Reading { state, rate, inputs, rates, ..self.clone() }
    }
}
