//! A rail that yields under a wheelset.
use crate::simd::Part;
use crate::wheel_rail::wheelset::{Slipping, WheelsetLanes};

/// Steps of the secant method at most, and the change of u' by which it ends: the next step is the square of a small one.
const MOST_STEPS: usize = 40;
const RELATIVE: f64 = 1e-6;
const ABSOLUTE: f64 = 1e-12; // m/s

/// Lateral forces on the rail as a function of u': a closure would not be compiled for the level.
struct Balance<'a, P> {
    wheelset: &'a WheelsetLanes,
    part: usize,
    damping: P,
    still: P,
    share: P,
    creeps: &'a Slipping<P>,
    ty: [P; 2],
}

impl<P: Part> Balance<'_, P> {
    /// k_r u + c_r u' + Q_y
    #[inline(always)]
    fn sum(&self, du: P) -> P {
        let (ty_1, ty_2) = (self.share.neg_mul_add(du, self.ty[0]), self.share.neg_mul_add(du, self.ty[1]));
        let ([_, ty_1], [_, ty_2]) = self.wheelset.creep_forces(self.part, self.creeps, ty_1, ty_2);
        self.damping.mul_add(du, self.still) - ty_1 - ty_2
    }
}

impl WheelsetLanes {
    /// u' of the rail from k_r u + c_r u' = -Q_y, in which Q_y holds u' through the lateral creepage.
    ///
    /// `still`: k_r u + Q_y without creep forces; `ty`: those at u' = 0. The secant method begins at the root with linear
    /// creep forces. The root lies between 0 and where half the rail's damping alone would reach it, since creep forces
    /// that fall with the creepage are taken to lower the slope of the sum by c_r/2 at most. A converged lane stays,
    /// whatever its neighbours do.
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
        let balance = Balance { wheelset: self, part, damping, still, share, creeps, ty };
        let (mut before, mut total_before) = (none, balance.sum(none));
        let least = half * damping;
        let (near, far) = (-total_before / steepest, -total_before / least);
        let (mut low, mut high) = (far.min(none), far.max(none));
        let (mut du, mut on_the_way) = (near, one);
        for _ in 0..MOST_STEPS {
            let total = balance.sum(du);
            low = total.if_less(none, du, low);
            high = total.if_less(none, high, du);
            let (apart, smallest) = (du - before, P::splat(f64::MIN_POSITIVE));
            let secant = (total - total_before) / apart.abs().if_less(smallest, one, apart);
            let slope = apart.abs().if_less(smallest, steepest, secant.max(least));
            let step = du - total / slope;
            let middle = half * (low + high);
            let inside = step.if_less(low, middle, high.if_less(step, middle, step));
            let moved = (inside - du).abs();
            (before, total_before) = (du, total);
            du = on_the_way.if_less(half, du, inside);
            let near_enough = inside.abs().mul_add(P::splat(RELATIVE), P::splat(ABSOLUTE));
            on_the_way = moved.if_less(near_enough, none, on_the_way);
            if !on_the_way.any_from(half) {
                break;
            }
        }
        du
    }
}
