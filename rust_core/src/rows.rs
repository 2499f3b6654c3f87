//! Sparse rows of sixteen vehicles: forces that are linear in the state and in the track.
//!
//! Rows of one length stand together, each filled up to an even number of terms: their products are written out for
//! every length, since a loop of a few turns costs more in mispredicted ends than in products.
use crate::lanes::{Job, LANES, Lanes, Part, dispatch, level};

/// Columns of the input table that may move anything; behind them those that the speed multiplies.
pub const COLUMNS: usize = 64;
/// The longest row.
const LONGEST: usize = 64;

/// Rows of one length.
#[derive(Clone, Debug)]
struct Even {
    length: usize,
    rows: Vec<u32>,
    places: Vec<u32>,
    factors: Vec<Lanes>,
    /// The factors as one part of the lanes after the other: what a part reads stands close together.
    packed: Vec<Lanes>,
}

/// Terms of one kind by length of their rows.
#[derive(Clone, Debug, Default)]
struct Terms {
    groups: Vec<Even>,
}

impl Terms {
    fn push(&mut self, row: usize, mut terms: Vec<(usize, Lanes)>) {
        terms.retain(|(_, factor)| !factor.is_zero());
        if terms.is_empty() {
            return;
        }
        if terms.len() % 2 == 1 {
            terms.push((terms[0].0, Lanes::ZERO));
        }
        let length = terms.len();
        assert!(length <= LONGEST, "a row of {length} terms");
        let group = match self.groups.iter_mut().find(|group| group.length == length) {
            Some(group) => group,
            None => {
                self.groups.push(Even {
                    length,
                    rows: Vec::new(),
                    places: Vec::new(),
                    factors: Vec::new(),
                    packed: Vec::new(),
                });
                self.groups.last_mut().expect("just pushed")
            }
        };
        group.rows.push(row as u32);
        for (place, factor) in terms {
            group.places.push(place as u32);
            group.factors.push(factor);
        }
    }

    /// to(row, sum of factor times value) for every row that has terms.
    #[inline(always)]
    fn each<P: Part>(&self, at: usize, value: impl Fn(usize) -> P, mut to: impl FnMut(usize, P)) {
        for group in &self.groups {
            match group.length {
                2 => group.each::<P, 2>(at, &value, &mut to),
                4 => group.each::<P, 4>(at, &value, &mut to),
                6 => group.each::<P, 6>(at, &value, &mut to),
                8 => group.each::<P, 8>(at, &value, &mut to),
                10 => group.each::<P, 10>(at, &value, &mut to),
                12 => group.each::<P, 12>(at, &value, &mut to),
                14 => group.each::<P, 14>(at, &value, &mut to),
                16 => group.each::<P, 16>(at, &value, &mut to),
                _ => group.long(at, &value, &mut to),
            }
        }
    }
}

impl Even {
    #[inline(always)]
    fn each<P: Part, const N: usize>(&self, at: usize, value: &impl Fn(usize) -> P, to: &mut impl FnMut(usize, P)) {
        let share = LANES / P::WIDTH;
        let here = self.packed.len() / share * (at / P::WIDTH);
        let factors = self.packed[here..here + self.packed.len() / share].chunks_exact(N.div_ceil(share));
        for (row, (places, factors)) in self.rows.iter().zip(self.places.as_chunks::<N>().0.iter().zip(factors)) {
            // two sums side by side, for the latency of an addition
            let mut sums = [P::zero(); 2];
            for k in 0..N {
                let factor = P::load(&factors[k / share], k % share * P::WIDTH);
                sums[k % 2] = factor.mul_add(value(places[k] as usize), sums[k % 2]);
            }
            to(*row as usize, sums[0] + sums[1]);
        }
    }

    /// Parts of `width` lanes: [part][row][term].
    fn pack(&mut self, width: usize) {
        let (share, n) = (LANES / width, self.length);
        self.packed.clear();
        for at in (0..LANES).step_by(width) {
            for row in self.factors.chunks_exact(n) {
                for some in row.chunks(share) {
                    let lane = |l: usize| some.get(l / width).map_or(0.0, |factor| factor.0[at + l % width]);
                    self.packed.push(Lanes::from_fn(lane));
                }
            }
        }
    }

    #[inline(always)]
    fn long<P: Part>(&self, at: usize, value: &impl Fn(usize) -> P, to: &mut impl FnMut(usize, P)) {
        let terms = self.places.chunks_exact(self.length).zip(self.factors.chunks_exact(self.length));
        for (row, (places, factors)) in self.rows.iter().zip(terms) {
            let mut sum = P::zero();
            for (place, factor) in places.iter().zip(factors) {
                sum = P::load(factor, at).mul_add(value(*place as usize), sum);
            }
            to(*row as usize, sum);
        }
    }
}

struct Width;

impl Job for Width {
    type Output = usize;

    #[inline(always)]
    fn run<P: Part>(self) -> usize {
        P::WIDTH
    }
}

/// Rows over the state, and over columns of the input table.
#[derive(Clone, Debug, Default)]
pub struct Rows {
    count: usize,
    state: Terms,
    inputs: Terms,
}

impl Rows {
    /// The terms of the next row: of the state, of columns, of columns that the speed multiplies (the lane's share of
    /// the speed in the factor). Those that are zero in every lane are left out.
    pub fn push(&mut self, state: Vec<(usize, Lanes)>, inputs: Vec<(usize, Lanes)>, rates: Vec<(usize, Lanes)>) {
        let moved = rates.into_iter().map(|(column, factor)| (column + COLUMNS, factor));
        let driven: Vec<_> = inputs.into_iter().chain(moved).filter(|(_, factor)| !factor.is_zero()).collect();
        self.state.push(self.count, state);
        self.inputs.push(self.count, driven);
        self.count += 1;
    }

    /// Lay the factors out for the width of the parts that will read them.
    pub fn pack(&mut self) {
        let width = dispatch(level(), Width);
        self.state.groups.iter_mut().chain(&mut self.inputs.groups).for_each(|group| group.pack(width));
    }

    /// The terms of all rows over the state: row, place, factor.
    pub fn state(&self) -> impl Iterator<Item = (usize, usize, &Lanes)> {
        self.state.groups.iter().flat_map(|group| {
            let terms = group.places.iter().zip(&group.factors).enumerate();
            terms.map(|(k, (place, factor))| (group.rows[k / group.length] as usize, *place as usize, factor))
        })
    }

    /// Does the track move anything but the wheelsets?
    pub fn is_driven(&self) -> bool {
        !self.inputs.groups.is_empty()
    }

    /// forces[from ..] = the force of every row.
    #[inline(always)]
    pub fn forces<P: Part>(&self, at: usize, x: &[P; 64], table: &[f64], from: usize, forces: &mut [P; 64]) {
        for force in &mut forces[from..from + self.count] {
            *force = P::zero();
        }
        self.state.each(at, |i| x[i & 63], |row, force| forces[(from + row) & 63] = force);
        if self.is_driven() {
            let to = |row: usize, force: P| forces[(from + row) & 63] = forces[(from + row) & 63] + force;
            let moving = |column: usize| table[column % COLUMNS] * if column < COLUMNS { 1.0 } else { table[1] };
            self.inputs.each(at, |column| P::splat(moving(column)), to);
        }
    }
}
