//! The guiding forces of the wheels on the rails, as a channel.
use crate::simd::{Lanes, Part, STATES, Work};
use crate::wheel_rail::wheelset::{Passing, WheelsetLanes};

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

impl Guiding {
    #[inline(always)]
    fn force<P: Part>(&self, at: usize, row: &[f64], x: &[P; STATES]) -> P {
        let speed = P::splat(row[1]) * P::load(&self.speed_scale, at);
        let inv_speed = P::splat(1.0 / row[1]) * P::load(&self.inv_speed_scale, at);
        let [right, left] = self.wheelset.guiding(at, &Passing { row, speed }, inv_speed, self.dofs, x);
        match self.wheel {
            0 => right + left,
            1 => right,
            _ => left,
        }
    }

    /// A sum and the force.
    #[inline(always)]
    pub fn add<P: Part>(&self, at: usize, row: &[f64], x: &[P; STATES], mut sum: P) -> P {
        P::out_of_line(Pressing { guiding: self, at, row, x, sum: &mut sum });
        sum
    }
}

/// A guiding force on its way to a sum.
struct Pressing<'l, P> {
    guiding: &'l Guiding,
    at: usize,
    row: &'l [f64],
    x: &'l [P; STATES],
    sum: &'l mut P,
}

impl<P: Part> Work for Pressing<'_, P> {
    #[inline(always)]
    fn run(self) {
        *self.sum = self.guiding.force(self.at, self.row, self.x) + *self.sum;
    }
}

impl WheelsetLanes {
    /// The guiding forces Y of the right and the left wheel on the rails, to the right.
    ///
    /// (3.4) with gamma_1, gamma_2 of (3.8); a flange presses where the wheelset has moved to.
    #[inline(always)]
    fn guiding<P: Part>(&self, part: usize, track: &Passing<'_, P>, inv_speed: P, n: usize, x: &[P; STATES]) -> [P; 2] {
        let (motion, u) = self.motion(n, x);
        let contact = self.contact_at(part, track.speed, inv_speed);
        let touch = self.touch(part, &contact, track, &motion, u);
        let (flange, (_, [ty_1, ty_2])) = (touch.flange, touch.creep());
        let (none, half) = (P::zero(), P::splat(0.5));
        // N (gamma_1 - gamma_2)/2 with the gyroscopic moment, and N (gamma_1 + gamma_2)/2 that spreads the wheels
        let leaning = half * contact.1.gyro.neg_mul_add(motion.vpsi, -touch.gravitation);
        let spread = P::load(&self.spread, part);
        let right = flange.if_less(none, -flange, none);
        let left = none.if_less(flange, -flange, none);
        [leaning + spread + ty_1 + right, leaning - spread + ty_2 + left]
    }
}
