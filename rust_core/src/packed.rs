//! Sparse rows for one part of the lanes, made ready for the step loop: over the state, and over the input table.
use crate::lanes::Part;
use crate::rows::COLUMNS;
use crate::vehicle::STATES;
use std::marker::PhantomData;

/// A row: where its sum goes and where it starts from, its terms.
pub type Row<P> = ([usize; 2], Vec<(usize, P)>);

/// Rows two by two where they read the same places: what a place holds is loaded once for both. Every factor stands beside
/// the next in memory. Terms are summed one by one in the order of their places: so one that is zero moves no digit,
/// whichever vehicle beside it needs it.
#[derive(Clone, Debug)]
pub struct Packed<P> {
    twins: Strips<P, 2>,
    singles: Strips<P, 1>,
}

impl<P: Part> Packed<P> {
    /// From rows over the places of a [`State`] or a [`Table`], which they are summed over later. Panics for other places.
    pub fn new<V: Places<P>>(rows: &[Row<P>]) -> Self {
        assert!(rows.iter().flat_map(|row| &row.1).all(|(place, _)| *place < V::COUNT), "a place that is not there");
        let places = |rows: &[&Row<P>]| together(rows).len();
        let mut left: Vec<_> = rows.iter().collect();
        let mut twins = Vec::new();
        // a row apart loads a place and a factor per term, two together load a place and two factors; to begin and to end
        // a sum costs as much as two terms
        let cost = |rows: &[&Row<P>]| (1 + rows.len()) * (places(rows) + 2);
        let spared = |a: &Row<P>, b: &Row<P>| (cost(&[a]) + cost(&[b])) as isize - cost(&[a, b]) as isize;
        while let Some((_, i, j)) = (0..left.len())
            .flat_map(|j| (0..j).map(move |i| (i, j)))
            .map(|(i, j)| (spared(left[i], left[j]), i, j))
            .filter(|(spared, ..)| *spared > 0)
            .max_by_key(|(spared, i, j)| (*spared, usize::MAX - i, usize::MAX - j))
        {
            let (second, first) = (left.remove(j), left.remove(i));
            twins.push([first, second]);
        }
        let singles: Vec<_> = left.into_iter().map(|row| [row]).collect();
        Packed { twins: Strips::new::<V>(&twins), singles: Strips::new::<V>(&singles) }
    }

    /// At this speed [m/s], before [`Packed::sums`] over a [`Table`].
    #[inline(always)]
    pub fn pace(&mut self, speed: f64) {
        self.twins.pace(P::splat(speed));
        self.singles.pace(P::splat(speed));
    }

    /// to[..] = from[..] (or none) + the sum of every row.
    #[inline(always)]
    pub fn sums(&self, values: &impl Places<P>, from: Option<&[P; STATES]>, to: &mut [P; STATES]) {
        self.twins.sums(values, from, to);
        self.singles.sums(values, from, to);
    }
}

/// The places that any of these rows reads, in order.
fn together<P>(rows: &[&Row<P>]) -> Vec<usize> {
    let mut places: Vec<_> = rows.iter().flat_map(|row| row.1.iter().map(|(place, _)| *place)).collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// Rows in groups of N over the same places.
#[derive(Clone, Debug)]
struct Strips<P, const N: usize> {
    heads: Vec<Head<P, N>>,
    /// Steps of two terms: an offset each (see [`Places`]), a factor per row.
    places: Vec<[u32; 2]>,
    factors: Vec<[[P; N]; 2]>,
    /// Those that the speed multiplies: step, term, factors at 1 m/s.
    moved: Vec<(usize, usize, [P; N])>,
}

/// A group of rows: where the sums go and where they start from, and its number of steps.
#[derive(Clone, Debug)]
struct Head<P, const N: usize> {
    to: [Place<P>; N],
    from: [Place<P>; N],
    steps: u32,
}

impl<P: Part, const N: usize> Strips<P, N> {
    fn new<V: Places<P>>(groups: &[[&Row<P>; N]]) -> Self {
        let mut strips = Strips { heads: Vec::new(), places: Vec::new(), factors: Vec::new(), moved: Vec::new() };
        for rows in groups {
            let places = together(rows);
            for step in places.chunks(2) {
                strips.push::<V>(step, rows);
            }
            let [to, from] = [0, 1].map(|end| rows.map(|row| Place::new(row.0[end])));
            strips.heads.push(Head { to, from, steps: places.len().div_ceil(2) as u32 });
        }
        strips
    }

    /// A step of one place or two.
    fn push<V: Places<P>>(&mut self, places: &[usize], rows: &[&Row<P>; N]) {
        let (step, last) = (self.places.len(), places[places.len() - 1]);
        self.places.push([places[0], last].map(|place| (V::still(place) * V::SIZE) as u32));
        self.factors.push([[P::zero(); N]; 2]);
        for (k, place) in places.iter().enumerate() {
            let factor =
                |row: &&Row<P>| row.1.iter().find(|(i, _)| i == place).map_or(P::zero(), |(_, factor)| *factor);
            let factors = rows.each_ref().map(factor);
            self.factors[step][k] = factors;
            if V::still(*place) != *place {
                self.moved.push((step, k, factors));
            }
        }
    }

    #[inline(always)]
    fn pace(&mut self, speed: P) {
        for (step, k, factors) in &self.moved {
            for (to, factor) in self.factors[*step][*k].iter_mut().zip(factors) {
                *to = speed * *factor;
            }
        }
    }

    // adapters and closures of the library need not be compiled for the level: plain loops over indices are
    #[allow(clippy::needless_range_loop)]
    #[inline(always)]
    fn sums(&self, values: &impl Places<P>, from: Option<&[P; STATES]>, to: &mut [P; STATES]) {
        let (mut places, mut factors) = (self.places.as_ptr(), self.factors.as_ptr());
        for head in &self.heads {
            let mut sums = [P::zero(); N];
            if let Some(from) = from {
                for n in 0..N {
                    sums[n] = head.from[n].of(from);
                }
            }
            for _ in 0..head.steps {
                // SAFETY: the heads count as many steps as there are
                let (places_of, factors_of) = unsafe { (&*places, &*factors) };
                for k in 0..2 {
                    let value = values.at(places_of[k]);
                    for n in 0..N {
                        sums[n] = factors_of[k][n].mul_add(value, sums[n]);
                    }
                }
                (places, factors) = unsafe { (places.add(1), factors.add(1)) };
            }
            for n in 0..N {
                head.to[n].put(to, sums[n]);
            }
        }
    }
}

/// What the places of a row hold.
pub trait Places<P> {
    /// Bytes from one place to the next.
    const SIZE: usize;
    /// How many places there are.
    const COUNT: usize;
    /// Where that stands which, times the speed, a place holds.
    fn still(place: usize) -> usize {
        place
    }
    /// So many bytes behind the first place.
    fn at(&self, offset: u32) -> P;
}

/// Positions and velocities.
pub struct State<'a, P>(pub &'a [P; STATES]);

impl<P: Part> Places<P> for State<'_, P> {
    const SIZE: usize = size_of::<P>();
    const COUNT: usize = STATES;

    #[inline(always)]
    fn at(&self, offset: u32) -> P {
        // SAFETY: `Packed::new` refuses places from COUNT on; a mask would be vectorised, at a cost
        debug_assert!((offset as usize) < size_of_val(self.0));
        unsafe { *self.0.as_ptr().byte_add(offset as usize) }
    }
}

/// A row of the input table. What the speed multiplies stands as far behind as a row is long at most: its factors carry
/// the speed, see [`Packed::pace`].
pub struct Table<'a>(pub &'a [f64]);

impl Table<'_> {
    /// The place of a column times the speed.
    pub fn moved(column: usize) -> usize {
        column + COLUMNS
    }
}

impl<P: Part> Places<P> for Table<'_> {
    const SIZE: usize = size_of::<f64>();
    const COUNT: usize = 2 * COLUMNS;

    fn still(place: usize) -> usize {
        place % COLUMNS
    }

    #[inline(always)]
    fn at(&self, offset: u32) -> P {
        P::splat(self.0[offset as usize / size_of::<f64>()])
    }
}

/// A place of a state, ready to be read.
#[derive(Clone, Copy, Debug)]
pub struct Place<P>(u32, PhantomData<P>);

impl<P: Part> Place<P> {
    /// Panics from [`STATES`] on.
    pub fn new(index: usize) -> Self {
        assert!(index < STATES, "a place that is not there");
        Place((index * size_of::<P>()) as u32, PhantomData)
    }

    #[inline(always)]
    pub fn of(self, x: &[P; STATES]) -> P {
        // SAFETY: a place is made below STATES alone; an index would have to be masked and shifted
        unsafe { *x.as_ptr().byte_add(self.0 as usize) }
    }

    #[inline(always)]
    pub fn put(self, x: &mut [P; STATES], value: P) {
        // SAFETY: as above
        unsafe { *x.as_mut_ptr().byte_add(self.0 as usize) = value }
    }
}
