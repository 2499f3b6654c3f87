//! Which rows are summed together: those that read the same places, and those with the same factors over other places.
use crate::simd::Lanes;
use std::borrow::Cow;
use std::fmt;

/// A row: where its sum goes and where it starts from, its terms.
pub type Row = ([usize; 2], Vec<(usize, Lanes)>);

/// Rows over the places that any of them reads, once, or twice with the same factors over other places.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Rows over the same places.
    pub rows: usize,
    /// Indices that the sums are written to, and those that they start from: of the rows, then those of the second time.
    pub ends: Cow<'static, [[usize; 2]]>,
    /// Term after term, of the rows and of the second time; `!place` is the opposite of what a place holds.
    pub places: Cow<'static, [isize]>,
}

impl Block {
    /// How often the factors are used.
    pub fn times(&self) -> usize {
        self.ends.len() / self.rows
    }

    /// The factors, term after term and row after row, an even number of terms. They leave the rows; none where those of
    /// the second time differ.
    fn factors(&self, rows: &mut [Row]) -> Option<Vec<Lanes>> {
        let (mut factors, times) = (Vec::new(), self.times());
        for places in self.places.chunks_exact(times) {
            for n in 0..self.rows {
                let mut all = (0..times).map(|m| taken(rows, self.ends[m * self.rows + n][0], places[m]));
                let first = all.next()?;
                factors.push(all.all(|other| other == first).then_some(first)?);
            }
        }
        factors.resize(factors.len().next_multiple_of(2 * self.rows), Lanes::ZERO);
        Some(factors)
    }
}

impl fmt::Display for Block {
    /// `rows: to<from ...: places of a term; ...`, as the files of `structures` have it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ends: Vec<_> = self.ends.iter().map(|[to, from]| format!("{to}<{from}")).collect();
        let term = |places: &[isize]| places.iter().map(isize::to_string).collect::<Vec<_>>().join(" ");
        let terms: Vec<_> = self.places.chunks_exact(self.times()).map(term).collect();
        write!(f, "{}: {}: {}", self.rows, ends.join(" "), terms.join("; "))
    }
}

/// Rows in blocks, and their factors block after block.
#[derive(Clone, Debug)]
pub struct Plan {
    pub blocks: Cow<'static, [Block]>,
    pub factors: Vec<Lanes>,
}

impl Plan {
    /// Of any rows, with at most so many places of which the opposite is read.
    pub fn of(rows: &[Row], most: usize) -> Self {
        let (twins, singles) = pairs(rows);
        let mut opposites = Opposites { most, found: Vec::new() };
        let ((quads, twins), (likes, singles)) = (alike(twins, &mut opposites), alike(singles, &mut opposites));
        let blocks: Vec<_> = [quads, twins, likes, singles].concat();
        Plan::known(blocks.into(), rows).expect("made of these rows")
    }

    /// In blocks that are given; none where the rows have other terms.
    pub fn known(blocks: Cow<'static, [Block]>, rows: &[Row]) -> Option<Self> {
        let mut left = rows.to_vec();
        let factors: Option<Vec<_>> = blocks.iter().map(|block| block.factors(&mut left)).collect();
        let is_spent = left.iter().all(|(_, terms)| terms.iter().all(|(_, a)| a.is_zero()));
        let factors = factors.filter(|_| is_spent)?.concat();
        Some(Plan { blocks, factors })
    }
}

/// The factor of the row that goes to an index at a place, which leaves the row: zero where there is none.
fn taken(rows: &mut [Row], to: usize, place: isize) -> Lanes {
    let row = rows.iter_mut().find(|(ends, _)| ends[0] == to);
    let factor = row.and_then(|(_, terms)| {
        let term = terms.iter().position(|(i, _)| *i as isize == place.max(!place))?;
        Some(terms.remove(term).1)
    });
    let factor = factor.unwrap_or(Lanes::ZERO);
    if place < 0 { minus(&factor) } else { factor }
}

pub fn minus(a: &Lanes) -> Lanes {
    Lanes(a.0.map(|a| -a))
}

/// The places that any of these rows reads, in order.
fn together(rows: &[&Row]) -> Vec<usize> {
    let mut places: Vec<_> = rows.iter().flat_map(|row| row.1.iter().map(|(place, _)| *place)).collect();
    places.sort_unstable();
    places.dedup();
    places
}

/// Rows two by two where they read the same places, and those that are left.
fn pairs(rows: &[Row]) -> (Vec<Group<'_>>, Vec<Group<'_>>) {
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
        twins.push(Group::of(vec![first, second]));
    }
    (twins, left.into_iter().map(|row| Group::of(vec![row])).collect())
}

/// Rows that are summed together, the places that they read, and the factors of each place.
#[derive(Clone)]
struct Group<'a> {
    rows: Vec<&'a Row>,
    places: Vec<usize>,
    factors: Vec<Vec<Lanes>>,
}

impl<'a> Group<'a> {
    fn of(rows: Vec<&'a Row>) -> Self {
        let places = together(&rows);
        let factor = |row: &Row, i: usize| row.1.iter().find(|(j, _)| *j == i).map_or(Lanes::ZERO, |term| term.1);
        let factors = places.iter().map(|i| rows.iter().map(|row| factor(row, *i)).collect()).collect();
        Group { rows, places, factors }
    }

    fn ends(&self) -> Vec<[usize; 2]> {
        self.rows.iter().map(|row| row.0).collect()
    }

    fn alone(&self) -> Block {
        let places: Vec<_> = self.places.iter().map(|i| *i as isize).collect();
        Block { rows: self.rows.len(), ends: self.ends().into(), places: places.into() }
    }

    /// Both in one, where place by place their factors are the same or opposite in every vehicle.
    fn with(&self, other: &Self, opposites: &mut Opposites) -> Option<Block> {
        if self.factors.len() != other.factors.len() {
            return None;
        }
        let mut places = Vec::new();
        let opposite = |a: &[Lanes], b: &[Lanes]| a.iter().zip(b).all(|(a, b)| *a == minus(b));
        let both: Vec<_> = self.factors.iter().zip(&other.factors).collect();
        if both.iter().any(|(a, b)| a != b && !opposite(a, b)) {
            return None;
        }
        for (k, (a, b)) in both.into_iter().enumerate() {
            let there = other.places[k];
            places.push(self.places[k] as isize);
            places.push(if a == b { there as isize } else { opposites.of(there)? });
        }
        let ends = [self.ends(), other.ends()].concat();
        Some(Block { rows: self.rows.len(), ends: ends.into(), places: places.into() })
    }
}

/// Places of which the opposite is needed.
struct Opposites {
    most: usize,
    found: Vec<usize>,
}

impl Opposites {
    fn of(&mut self, place: usize) -> Option<isize> {
        if !self.found.contains(&place) {
            if self.found.len() == self.most {
                return None;
            }
            self.found.push(place);
        }
        Some(!(place as isize))
    }
}

/// Groups of rows two by two where they have the same factors, and those that are left.
fn alike(groups: Vec<Group<'_>>, opposites: &mut Opposites) -> (Vec<Block>, Vec<Block>) {
    let (mut joined, mut single): (Vec<_>, Vec<Group<'_>>) = (Vec::new(), Vec::new());
    for group in groups {
        let found = single.iter().enumerate().find_map(|(i, first)| Some((i, first.with(&group, opposites)?)));
        match found {
            Some((i, both)) => {
                single.remove(i);
                joined.push(both);
            }
            None => single.push(group),
        }
    }
    (joined, single.iter().map(Group::alone).collect())
}
