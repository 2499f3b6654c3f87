//! Quasi-static equilibrium of a vehicle in a curve: forces on its bodies with accelerations and rates zero.
use crate::simd::{Job, LANES, Lanes, Part};
use crate::vehicle::group::Group;

/// States of sixteen vehicles in a curve, in coordinates fixed to the track.
pub struct Equilibrium<'a> {
    /// Per state; velocities are not used.
    pub states: &'a [Lanes],
    /// Row of the input table: what the curve moves of the suspension, and the forces on the bodies.
    pub row: &'a [Lanes],
    /// 1/R, the centre at +y.
    pub curvature: Lanes,
}

/// Results of a wheelset: e, psi, Q_y, longitudinal creepage of wheel 2 (that of wheel 1 is opposite),
/// T_x1, T_x2, T_y1, T_y2 of the treads, friction times creepage at the flange.
pub const WHEELSET_RESULTS: usize = 9;

/// Forces on the degrees of freedom, then the rates of own states of rails and effects; and the results of the wheelsets.
pub struct Forces {
    pub residual: Vec<Lanes>,
    pub wheelsets: Vec<[Lanes; WHEELSET_RESULTS]>,
}

/// Source: docs/theory.md, quasi-static curve: the line's offsets act on the suspension, b/R and 1/R on the creepages.
pub struct EquilibriumForces<'a> {
    pub group: &'a Group,
    pub stand: &'a Equilibrium<'a>,
}

impl Job for EquilibriumForces<'_> {
    type Output = Forces;

    #[inline(always)]
    fn run<P: Part>(self) -> Forces {
        let EquilibriumForces { group, stand } = self;
        let n = group.dofs;
        let mut out = Forces {
            residual: vec![Lanes::ZERO; group.states - n],
            wheelsets: vec![[Lanes::ZERO; WHEELSET_RESULTS]; group.wheelsets.len()],
        };
        let row = vec![0.0; group.columns];
        for at in (0..LANES).step_by(P::WIDTH) {
            let x = |i: usize| P::load(&stand.states[i], at);
            let given = |column: usize| P::load(&stand.row[column], at);
            let mut force = vec![P::zero(); group.states - n];
            for (i, j, a) in group.matrix.state().filter(|(_, j, _)| *j < n) {
                force[i] = P::load(a, at).mul_add(x(j), force[i]);
            }
            for (i, force) in force.iter_mut().enumerate().take(n) {
                for (column, a) in group.matrix.columns_of(i) {
                    *force = P::load(a, at).mul_add(given(column), *force);
                }
            }
            let curvature = P::load(&stand.curvature, at);
            for ((wheelset, leaning), results) in group.wheelsets.iter().zip(&group.leaning).zip(&mut out.wheelsets) {
                let rail = wheelset.rail.as_ref().map(|rail| rail.state);
                let u = rail.map_or(P::zero(), x);
                let found = wheelset.standing(at, &row, curvature, x(wheelset.y), x(wheelset.psi), u);
                force[wheelset.y] = force[wheelset.y] + found.q_y;
                force[wheelset.psi] = force[wheelset.psi] + found.q_psi;
                if let Some(state) = rail {
                    force[state - n] = found.rail;
                }
                let ([tx_1, tx_2], [ty_1, ty_2]) = (found.tx, found.ty);
                let (psi, wear) = (x(wheelset.psi), found.flange_wear);
                let mut q_y = found.q_y;
                for (i, a) in leaning.state.iter().filter(|(i, _)| *i < n) {
                    q_y = P::load(a, at).neg_mul_add(x(*i), q_y);
                }
                for (column, a) in &leaning.inputs {
                    q_y = P::load(a, at).neg_mul_add(given(*column), q_y);
                }
                let numbers = [found.e, psi, q_y, found.creepage, tx_1, tx_2, ty_1, ty_2, wear];
                for (value, to) in numbers.into_iter().zip(results) {
                    value.store(to, at);
                }
            }
            for law in &group.forces {
                let mut motion = P::zero();
                for (i, a) in &law.row {
                    motion = P::load(a, at).mul_add(x(*i), motion);
                }
                for (column, a) in &law.inputs {
                    motion = P::load(a, at).mul_add(given(*column), motion);
                }
                let own = if law.has_state { x(law.state) } else { P::zero() };
                let mut rate = P::zero();
                let f = law.law.force(law.numbers(at), motion, P::zero(), 0.0, own, &mut rate);
                if law.has_state {
                    force[law.state - n] = rate;
                }
                for (i, a) in &law.reaction {
                    force[*i] = (P::load(a, at) * P::load(&law.alpha, at)).mul_add(f, force[*i]);
                }
            }
            for (value, to) in force.into_iter().zip(&mut out.residual) {
                value.store(to, at);
            }
        }
        out
    }
}
