//! A rail that yields under a wheelset.
use crate::simd::Part;
use crate::wheel_rail::wheelset::{Slipping, WheelsetLanes};

impl WheelsetLanes {
    /// u' of the rail from k_r u + c_r u' = -Q_y, in which Q_y holds u' through the lateral creepage.
    ///
    /// `still`: k_r u + Q_y without creep forces; `ty`: those at u' = 0. With saturation the sum's slope lies between
    /// c_r and c_r + 2 share, which bounds the steps of the secant method; its last step is the square of a small one.
    /// A converged lane stays, whatever its neighbours do.
    #[inline(always)]
    pub(super) fn yielding<P: Part>(
        &self,
        part: usize,
        damping: P,
        still: P,
        share: P,
        creeps: Option<&Slipping<P>>,
        ty: [P; 2],
    ) -> P {
        let steepest = share.mul_add(P::splat(2.0), damping);
        let Some(creeps) = creeps else {
            return (ty[0] + ty[1] - still) / steepest;
        };
        let (none, one, half) = (P::zero(), P::splat(1.0), P::splat(0.5));
        let sum = |du: P| {
            let (ty_1, ty_2) = (share.neg_mul_add(du, ty[0]), share.neg_mul_add(du, ty[1]));
            let ([_, ty_1], [_, ty_2]) = self.creep_forces(part, creeps, ty_1, ty_2);
            damping.mul_add(du, still) - ty_1 - ty_2
        };
        let (mut before, mut total_before) = (none, sum(none));
        let (near, far) = (-total_before / steepest, -total_before / damping);
        let (mut low, mut high) = (near.min(far), near.max(far));
        let (mut du, mut on_the_way) = (near, one);
        for _ in 0..40 {
            let total = sum(du);
            low = total.if_less(none, du, low);
            high = total.if_less(none, high, du);
            let (apart, smallest) = (du - before, P::splat(1e-300));
            let secant = (total - total_before) / apart.abs().if_less(smallest, one, apart);
            let slope = apart.abs().if_less(smallest, steepest, secant.max(damping));
            let step = du - total / slope;
            let middle = half * (low + high);
            let inside = step.if_less(low, middle, high.if_less(step, middle, step));
            let moved = (inside - du).abs();
            (before, total_before) = (du, total);
            du = on_the_way.if_less(half, du, inside);
            let near_enough = inside.abs().mul_add(P::splat(1e-6), P::splat(1e-12));
            on_the_way = moved.if_less(near_enough, none, on_the_way);
            if !on_the_way.any_from(half) {
                break;
            }
        }
        du
    }
}
