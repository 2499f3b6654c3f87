//! Structure shared by all vehicles of a group, and the numbers of one vehicle.
use crate::effects::Law;
use crate::effects::effect::{Kind, Site, first};
use crate::error::{Error, Result, expect_len};
use crate::vehicle::assembly::{Assembly, LINKAGE, Port};
use crate::vehicle::kinds::VehicleKind;
use crate::vehicle::line::{LineColumns, LinePlaces, LineSetup};
use std::ops::Range;

/// An effect at a place; wheelset 0: both, or none in particular.
#[derive(Clone, Debug)]
pub struct Placed {
    pub law: Law,
    pub at: String,
    pub wheelset: u8,
    /// Number of numbers that describe it.
    pub count: usize,
}

/// Structure shared by all vehicles of a group.
#[derive(Clone, Debug)]
pub struct Structure {
    pub kind: VehicleKind,
    pub measured: Vec<String>,
    pub placed: Vec<Placed>,
    /// Does the track have curves? Then the input table has the columns of [`LinePlaces`].
    pub line: bool,
}

/// The numbers of one vehicle: of the kind, of its effects one after the other, their amounts, its share of the speed.
#[derive(Clone, Copy, Debug)]
pub struct Single<'a> {
    pub numbers: &'a [f64],
    pub effects: &'a [f64],
    pub amounts: &'a [f64],
    pub speed_scale: f64,
}

impl Structure {
    /// Check the placed effects against the kind of vehicle.
    pub fn check(&self) -> Result<()> {
        let layout = self.kind.layout();
        let known = layout.map_or(Ok(Vec::new()), |it| Ok(it.assemble(&vec![1.0; it.numbers], None)?.ports))?;
        for (i, placed) in self.placed.iter().enumerate() {
            let record = placed.law.record();
            let class = known.iter().find(|p| p.at == placed.at).map_or(placed.at.as_str(), |p| p.class);
            if !record.at.contains(&class) || (layout.is_some() && record.kind == Kind::Body) {
                let known = record.at.join(", ");
                return Err(Error::Place { kind: record.key.into(), at: placed.at.clone(), known });
            }
            for other in &self.placed[..i] {
                let both = other.wheelset == 0 || placed.wheelset == 0 || other.wheelset == placed.wheelset;
                let first = other.law.record();
                if other.at == placed.at && both && first.supersedes.clashes(record.supersedes) {
                    let (first, second) = (first.key.into(), record.key.into());
                    return Err(Error::Superseded { first, second, at: placed.at.clone() });
                }
            }
        }
        Ok(())
    }

    /// Columns of the input table that these vehicles read.
    pub fn columns(&self) -> usize {
        self.kind.columns() + if self.line { LineColumns::count(self.kind.positions()) } else { 0 }
    }

    /// The columns of a line with curves, and whether springs to the ground hold a carbody: not where an effect is one.
    fn line_setup(&self) -> Option<LineSetup> {
        let carbody = !self.placed.iter().any(|placed| placed.law.record().kind == Kind::Body);
        self.line.then(|| LineSetup { columns: LineColumns(self.kind.columns()), carbody })
    }

    /// Number of numbers of all effects together.
    pub fn effect_numbers(&self) -> usize {
        self.placed.iter().map(|p| p.count).sum()
    }

    /// Is this place driven by a measured force of the coach, so that nothing else acts there?
    fn driven(&self, at: &str) -> bool {
        (at == "secondary_lateral" && self.measured.iter().any(|q| q == "Qy"))
            || (at == "secondary_yaw" && self.measured.iter().any(|q| q == "Qpsi"))
    }

    /// The effects that act in this run, with the range of their numbers.
    pub fn acting(&self) -> impl Iterator<Item = (usize, &Placed, Range<usize>)> {
        let mut begin = 0;
        self.placed.iter().enumerate().filter_map(move |(i, placed)| {
            let range = begin..begin + placed.count;
            begin = range.end;
            (!self.driven(&placed.at)).then_some((i, placed, range))
        })
    }

    /// As many numbers for every effect as describe it, and none of a layout that is not a number.
    fn check_numbers(&self, one: &Single<'_>) -> Result<()> {
        let mut begin = 0;
        for Placed { law, count, .. } in &self.placed {
            if !law.counts(&one.effects[begin..begin + count]) {
                return Err(Error::Numbers { kind: law.record().key.into(), got: *count });
            }
            if let Some(nan) = one.effects[begin..begin + count].iter().find(|number| number.is_nan()) {
                return Err(Error::VehicleNumber { what: law.record().key.into(), value: *nan, rule: "a number" });
            }
            begin += count;
        }
        match one.numbers.iter().position(|number| !number.is_finite()) {
            Some(i) if self.kind.layout().is_some() => Err(Error::VehicleNumber {
                what: format!("number {i} of the vehicle"),
                value: one.numbers[i],
                rule: "finite",
            }),
            _ => Ok(()),
        }
    }

    /// One vehicle with the bodies that its effects add.
    pub fn assemble(&self, one: &Single<'_>) -> Result<Assembly> {
        expect_len("numbers of the effects", one.effects.len(), self.effect_numbers())?;
        expect_len("amounts", one.amounts.len(), self.placed.len())?;
        self.check_numbers(one)?;
        let line = self.line_setup();
        if line.is_some() {
            LinePlaces::check_speed_scale(one.speed_scale)?;
        }
        let mut vehicle = self.kind.assemble(one.numbers, &self.measured, line)?;
        for (i, placed, range) in self.acting() {
            if placed.law.record().kind == Kind::Body {
                vehicle.add_body(&placed.at, one.amounts[i], first(&one.effects[range]));
            }
        }
        if let Some(setup) = line.filter(|_| self.kind.layout().is_none()) {
            LinePlaces::planar(&vehicle, setup).drive(&mut vehicle);
        }
        Ok(vehicle)
    }

    /// Ports of a placed effect.
    pub fn ports<'a>(&self, vehicle: &'a Assembly, placed: &Placed) -> Result<Vec<&'a Port>> {
        let linkage = placed.at == "wheelset_yaw" && placed.wheelset == 0;
        let found = vehicle.places(&placed.at, if linkage { LINKAGE } else { placed.wheelset });
        if found.is_empty() {
            return Err(Error::Site { at: placed.at.clone(), wheelset: placed.wheelset });
        }
        Ok(found)
    }

    /// The wheelsets at whose contact a placed effect acts.
    pub fn at_wheelsets(&self, vehicle: &Assembly, placed: &Placed) -> Result<Vec<usize>> {
        let chosen = |i: &usize| placed.wheelset == 0 || placed.wheelset as usize == i + 1;
        let found: Vec<_> = (0..vehicle.wheelsets.len()).filter(chosen).collect();
        if found.is_empty() {
            return Err(Error::Site { at: placed.at.clone(), wheelset: placed.wheelset });
        }
        Ok(found)
    }
}

/// The contact of a wheelset as its laws see it at any speed.
pub fn contact_site(vehicle: &Assembly, i: usize) -> Site {
    let w = &vehicle.wheelsets[i];
    Site {
        wheel_load: w.n,
        creep_slopes: [w.kappa_x * w.n, w.kappa_y * w.n],
        gravitational: 2.0 * w.n * w.epsilon / w.b,
        behind: w.behind,
        ..Site::moving("contact", 0.0, 0.0)
    }
}
