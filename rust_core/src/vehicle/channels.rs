//! Channels of a vehicle as terms of its state and its input row, and the guiding forces of its wheels.
use crate::simd::{Lanes, Part};
use crate::wheel_rail::wheelset::{Passing, WheelsetLanes};

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

/// Which wheels of which wheelset guide: both together, or one.
#[derive(Clone, Debug)]
pub struct Guiding {
    pub wheelset: WheelsetLanes,
    /// 0: both; 1 right, 2 left.
    pub wheel: usize,
    pub dofs: usize,
    pub speed_scale: Lanes,
    pub inv_speed_scale: Lanes,
}

/// A reading of a part of the lanes.
pub enum Signal<'a, P> {
    /// Of a wheelset relative to the rails, such as every score has: as its terms, without loops over them; the next likewise.
    Displacement {
        state: (usize, P),
        inputs: [(usize, P); 2],
    },
    /// Of a point of a body that yaws and rolls, with what its lean feels of gravity.
    Felt {
        state: (usize, P),
        rate: [(usize, P); 3],
    },
    Terms(Sum<P>),
    Guiding(&'a Guiding, usize, Sum<P>),
}

/// The terms of a reading.
pub struct Sum<P> {
    state: Vec<(usize, P)>,
    rate: Vec<(usize, P)>,
    inputs: Vec<(usize, P)>,
    rates: Vec<(usize, P)>,
}

impl<P: Part> Sum<P> {
    #[inline(always)]
    fn read(&self, row: &[f64], x: &[P; 64], dx: &[P; 64]) -> P {
        let mut value = P::zero();
        for (i, a) in &self.state {
            value = a.mul_add(x[i & 63], value);
        }
        for (i, a) in &self.rate {
            value = a.mul_add(dx[i & 63], value);
        }
        for (column, a) in &self.inputs {
            value = a.mul_add(P::splat(row[*column]), value);
        }
        for (column, a) in &self.rates {
            value = a.mul_add(P::splat(row[1] * row[*column]), value);
        }
        value
    }
}

impl Guiding {
    #[inline(always)]
    fn force<P: Part>(&self, at: usize, row: &[f64], x: &[P; 64]) -> P {
        let speed = P::splat(row[1]) * P::load(&self.speed_scale, at);
        let inv_speed = P::splat(1.0 / row[1]) * P::load(&self.inv_speed_scale, at);
        let [right, left] = self.wheelset.guiding(at, &Passing { row, speed }, inv_speed, self.dofs, x);
        match self.wheel {
            0 => right + left,
            1 => right,
            _ => left,
        }
    }
}

impl Reading {
    /// A share of it.
    pub fn times(&self, share: f64) -> Self {
        let part = |terms: &Terms| terms.iter().map(|(i, a)| (*i, Lanes::from_fn(|l| share * a.0[l]))).collect();
        let [state, rate, inputs, rates] = [&self.state, &self.rate, &self.inputs, &self.rates].map(part);
        Reading { state, rate, inputs, rates, ..self.clone() }
    }

    /// Of the lanes from `at` on.
    #[inline(always)]
    pub fn part<P: Part>(&self, at: usize) -> Signal<'_, P> {
        let part = |terms: &[(usize, Lanes)]| terms.iter().map(|(i, a)| (*i, P::load(a, at))).collect::<Vec<_>>();
        let [state, rate, inputs, rates] =
            [&self.state, &self.rate, &self.inputs, &self.rates].map(|terms| part(terms));
        match (&self.guiding, &state[..], &rate[..], &inputs[..], &rates[..]) {
            (Some(guiding), ..) => Signal::Guiding(guiding, at, Sum { state, rate, inputs, rates }),
            (None, &[state], &[], &[line, level], &[]) => Signal::Displacement { state, inputs: [line, level] },
            (None, &[state], &[a, b, c], &[], &[]) => Signal::Felt { state, rate: [a, b, c] },
            _ => Signal::Terms(Sum { state, rate, inputs, rates }),
        }
    }
}

impl<P: Part> Signal<'_, P> {
    #[inline(always)]
    pub fn read(&self, row: &[f64], x: &[P; 64], dx: &[P; 64]) -> P {
        match self {
            Signal::Displacement { state: (i, a), inputs: [(line, b), (level, c)] } => {
                c.mul_add(P::splat(row[*level]), b.mul_add(P::splat(row[*line]), *a * x[i & 63]))
            }
            Signal::Felt { state: (i, g), rate: [(j, a), (k, b), (l, c)] } => {
                let turned = b.mul_add(dx[k & 63], a.mul_add(dx[j & 63], *g * x[i & 63]));
                c.mul_add(dx[l & 63], turned)
            }
            Signal::Terms(sum) => sum.read(row, x, dx),
            Signal::Guiding(guiding, at, sum) => guiding.force(*at, row, x) + sum.read(row, x, dx),
        }
    }
}
