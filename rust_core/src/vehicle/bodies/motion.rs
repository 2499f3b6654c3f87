//! Linear motions of points of bodies.
use super::Number;
use crate::vehicle::assembly::{Assembly, Inputs, Row};
use crate::vehicle::line::LinePlaces;

/// A linear motion: terms of q and of the input table.
#[derive(Clone, Debug, Default)]
pub(super) struct Motion {
    pub(super) row: Row,
    pub(super) inputs: Inputs,
}

impl Motion {
    pub(super) fn of(dof: Option<usize>) -> Self {
        Motion { row: dof.map(|i| (i, 1.0)).into_iter().collect(), inputs: Inputs::new() }
    }

    pub(super) fn plus(&self, other: &Motion, factor: f64) -> Self {
        Motion { row: sum(&self.row, &other.row, factor), inputs: sum(&self.inputs, &other.inputs, factor) }
    }

    pub(super) fn times(&self, factor: f64) -> Self {
        Motion::default().plus(self, factor)
    }

    pub(super) fn slopes(&self) -> Inputs {
        self.inputs.iter().map(|(column, factor)| (column + 1, *factor)).collect()
    }
}

/// Terms of a + factor b, each place once; nothing is left out, so that all vehicles of a layout have the same terms.
pub(super) fn sum(a: &[(usize, f64)], b: &[(usize, f64)], factor: f64) -> Vec<(usize, f64)> {
    let mut terms = a.to_vec();
    for &(i, value) in b {
        match terms.iter_mut().find(|(j, _)| *j == i) {
            Some((_, old)) => *old += factor * value,
            None => terms.push((i, factor * value)),
        }
    }
    terms
}

/// a - b
pub(super) fn less(a: &Number, b: &Number) -> Number {
    let mut terms = a.clone();
    for &(factor, i) in b {
        match terms.iter_mut().find(|(_, j)| *j == i) {
            Some((old, _)) => *old -= factor,
            None => terms.push((-factor, i)),
        }
    }
    terms
}

/// A body among the degrees of freedom.
pub(super) struct Placed {
    pub(super) y: Motion,
    pub(super) psi: Motion,
    pub(super) phi: Motion,
    pub(super) rolls: bool,
    pub(super) x: f64,
    pub(super) height: f64,
}

impl Placed {
    pub(super) fn ground() -> Self {
        let still = Motion::default;
        Placed { y: still(), psi: still(), phi: still(), rolls: false, x: 0.0, height: 0.0 }
    }

    /// u_x, u_y, u_z of a point relative to the centre of mass.
    pub(super) fn point(&self, [x, y, h]: [f64; 3]) -> [Motion; 3] {
        let lateral = self.y.plus(&self.psi, x).plus(&self.phi, h);
        [self.psi.times(-y), lateral, self.phi.times(y)]
    }
}

/// The force of a spring k (or damper) on the bodies of a row, from what the input table moves.
pub(super) fn drive(to: &mut Vec<(usize, usize, f64)>, row: &[(usize, f64)], inputs: &[(usize, f64)], k: f64) {
    for &(dof, a) in row {
        for &(column, b) in inputs {
            match to.iter_mut().find(|(i, j, _)| (*i, *j) == (dof, column)) {
                Some((.., old)) => *old -= a * k * b,
                None => to.push((dof, column, -a * k * b)),
            }
        }
    }
}

/// The motion of every body as the suspension sees it on a line with curves, and the curvature under every wheelset.
pub(super) fn bend(places: &LinePlaces, vehicle: &mut Assembly, placed: &mut [Placed]) {
    for (position, body) in placed.iter_mut().enumerate() {
        body.y.inputs = places.columns.offset(position);
        body.psi.inputs = places.columns.heading(position);
        for wheelset in vehicle.wheelsets.iter_mut().filter(|w| body.y.row[0].0 == w.y) {
            wheelset.curvature = Some(places.columns.curvature(position));
        }
    }
}
