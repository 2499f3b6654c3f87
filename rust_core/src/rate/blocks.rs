//! Rows that are summed together: those that read the same places, and those with the same factors over other places.
use crate::simd::Lanes;
use std::ops::Range;

/// A row: where its sum goes and where it starts from, its terms.
pub type Row = ([usize; 2], Vec<(usize, Lanes)>);

/// N rows over the places that any of them reads, M times: with the same factors over other places.
pub struct Block<const N: usize, const M: usize> {
    /// Indices that the sums are written to, and those that they start from.
    pub ends: [[[usize; 2]; N]; M],
    pub places: [Vec<usize>; M],
    /// Place by place.
    pub factors: Vec<[Lanes; N]>,
}

/// The rows of a vehicle in blocks. A vehicle on two bogies has most of its rows twice.
pub struct Blocks {
    pub quads: Vec<Block<2, 2>>,
    pub twins: Vec<Block<2, 1>>,
    pub likes: Vec<Block<1, 2>>,
    pub singles: Vec<Block<1, 1>>,
    /// Places that hold the opposite of others: of which, and where.
    pub opposites: Vec<[usize; 2]>,
}

impl Blocks {
    /// From any rows; opposites use free entries.
    pub fn of(rows: &[Row], free: Range<usize>) -> Self {
        let (twins, singles) = pairs(rows);
        let mut opposites = Opposites { free, found: Vec::new() };
        let (quads, twins) = alike(twins, &mut opposites);
        let (likes, singles) = alike(singles, &mut opposites);
        Blocks { quads, twins, likes, singles, opposites: opposites.found }
    }
}

impl<const N: usize> Block<N, 1> {
    fn of(rows: [&Row; N]) -> Self {
        let places = together(&rows);
        let factor =
            |place: usize, row: &Row| row.1.iter().find(|(i, _)| *i == place).map_or(Lanes::ZERO, |term| term.1);
        let factors = places.iter().map(|place| rows.map(|row| factor(*place, row))).collect();
        Block { ends: [rows.map(|row| row.0)], places: [places], factors }
    }

    /// Both in one, where place by place their factors are the same or opposite in every vehicle.
    fn with(&self, other: &Self, opposites: &mut Opposites) -> Option<Block<N, 2>> {
        if self.factors.len() != other.factors.len() {
            return None;
        }
        let minus = |factors: &[Lanes; N]| factors.map(|a| Lanes(a.0.map(|a| -a)));
        let both = || self.factors.iter().zip(&other.factors);
        let opposite: Vec<_> = both().map(|(a, b)| a != b).collect();
        if both().zip(&opposite).any(|((a, b), opposite)| *opposite && *a != minus(b)) {
            return None;
        }
        let place = |(place, opposite): (&usize, &bool)| if *opposite { opposites.of(*place) } else { Some(*place) };
        let places = other.places[0].iter().zip(&opposite).map(place).collect::<Option<_>>()?;
        let factors = self.factors.clone();
        Some(Block { ends: [self.ends[0], other.ends[0]], places: [self.places[0].clone(), places], factors })
    }
}

/// Indices of which the opposite is needed, and the index of the opposite.
struct Opposites {
    free: Range<usize>,
    found: Vec<[usize; 2]>,
}

impl Opposites {
    fn of(&mut self, place: usize) -> Option<usize> {
        if let Some([_, to]) = self.found.iter().find(|[of, _]| *of == place) {
            return Some(*to);
        }
        let to = self.free.next()?;
        self.found.push([place, to]);
        Some(to)
    }
}

/// The places that any of these rows reads, in order.
fn together(rows: &[&Row]) -> Vec<usize> {
    let mut places: Vec<_> = rows.iter().flat_map(|row| row.1.iter().map(|(place, _)| *place)).collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// Rows two by two where they read the same places, and those that are left.
fn pairs(rows: &[Row]) -> (Vec<Block<2, 1>>, Vec<Block<1, 1>>) {
    let mut left: Vec<_> = rows.iter().collect();
    let mut twins = Vec::new();
    // a row apart loads a place and a factor per term, two together load a place and two factors; to begin and to end
    // a sum costs as much as two terms
    let cost = |rows: &[&Row]| (1 + rows.len()) * (together(rows).len() + 2);
    let spared = |a: &Row, b: &Row| (cost(&[a]) + cost(&[b])) as isize - cost(&[a, b]) as isize;
    while let Some((_, i, j)) = (0..left.len())
        .flat_map(|j| (0..j).map(move |i| (i, j)))
        .map(|(i, j)| (spared(left[i], left[j]), i, j))
        .filter(|(spared, ..)| *spared > 0)
        .max_by_key(|(spared, i, j)| (*spared, usize::MAX - i, usize::MAX - j))
    {
        let (second, first) = (left.remove(j), left.remove(i));
        twins.push(Block::of([first, second]));
    }
    (twins, left.into_iter().map(|row| Block::of([row])).collect())
}

/// Blocks two by two where they have the same factors, and those that are left.
fn alike<const N: usize>(blocks: Vec<Block<N, 1>>, opposites: &mut Opposites) -> (Vec<Block<N, 2>>, Vec<Block<N, 1>>) {
    let (mut joined, mut single): (Vec<_>, Vec<Block<N, 1>>) = (Vec::new(), Vec::new());
    for block in blocks {
        let found = single.iter().enumerate().find_map(|(i, first)| Some((i, first.with(&block, opposites)?)));
        match found {
            Some((i, both)) => {
                single.remove(i);
                joined.push(both);
            }
            None => single.push(block),
        }
    }
    (joined, single)
}
