//! Laws as the steps call them: what they are given and what they give, and the choice among those of the catalogue.
use super::Law;
use crate::simd::{Lanes, Part};

/// The prepared numbers of a part of the lanes.
#[derive(Clone, Copy)]
pub struct Numbers<'a> {
    pub lanes: &'a [Lanes],
    pub at: usize,
}

impl Numbers<'_> {
    /// The first N of them.
    #[inline(always)]
    pub fn first<P: Part, const N: usize>(&self) -> [P; N] {
        self.from(0)
    }

    /// N of them, from one on.
    #[inline(always)]
    pub fn from<P: Part, const N: usize>(&self, begin: usize) -> [P; N] {
        let lanes = &self.lanes[begin..begin + N];
        let mut numbers = [P::zero(); N];
        for i in 0..N {
            numbers[i] = P::load(&lanes[i], self.at);
        }
        numbers
    }
}

/// F(z, v, x) beyond the superseded linear term, and x' of an own state; s is the distance run.
pub trait Force {
    /// True if the law depends on the speed v.
    const SPEED: bool = true;
    /// True of a force of the distance run alone: forms of the rate compute it once per row of the input table.
    const OF_DISTANCE: bool = false;
    /// True of a stop: F = -k (z - clamp(z, h)) of the prepared numbers h, k. Forms of the rate that know stops compute it
    /// only where one is met.
    const STOP: bool = false;

    fn force<P: Part>(p: Numbers<'_>, z: P, v: P, s: f64, x: P, dx: &mut P) -> P;

    /// The force at the contact of a wheelset, whose rails are apart by the gauge deviation g.
    #[inline(always)]
    fn at_contact<P: Part>(p: Numbers<'_>, e: P, v: P, s: f64, _gauge: f64) -> P {
        Self::force(p, e, v, s, P::zero(), &mut P::zero())
    }

    /// Is there friction where it touches at a contact?
    fn slides(_p: &[f64]) -> bool {
        false
    }

    /// Creep forces of a flange along the rail and across it, and friction times creepage.
    #[inline(always)]
    fn friction<P: Part>(_p: Numbers<'_>, _of: &Flanging<P>) -> ([P; 2], P) {
        ([P::zero(); 2], P::zero())
    }
}

/// The flange's force on the wheelset, and at its wheel t_x and t_y of the linear law without spin, and kappa_x N/r.
#[derive(Clone, Copy)]
pub struct Flanging<P> {
    pub force: P,
    pub tx: P,
    pub ty: P,
    pub kx_r: P,
}

/// Creep of one wheel: forces of the linear law, part of t_y that is spin, speed of the wheelset.
#[derive(Clone, Copy)]
pub struct Creeping<P> {
    pub tx: P,
    pub ty: P,
    pub spin: P,
    pub speed: P,
}

/// Creep forces of a wheel where the linear law gives t_x, t_y.
pub trait Creep {
    /// True of [`cubic_saturation`] alone, its one prepared number [`super::effect::per_square_of_sliding`].
    const CUBIC: bool = false;

    fn forces<P: Part>(p: Numbers<'_>, wheel: &Creeping<P>) -> [P; 2];
}

/// Factor of Vermeulen and Johnson, see [`cubic_saturation`].
#[inline(always)]
pub fn saturated<P: Part>(square: P) -> P {
    let [factor] = cubic_saturation::<P, true, 1>([square], [P::zero(); 2]);
    factor
}

/// Factors of Vermeulen and Johnson for N wheels, the square of q = T/(3 mu N) given: 1 - q + q^2/3 for q < 1, else 1/(3 q);
/// of a share of the saturation, and a third of it, as much of what it takes off, unless it is `WHOLE` in all lanes.
#[inline(always)]
pub fn cubic_saturation<P: Part, const WHOLE: bool, const N: usize>(
    square: [P; N],
    [share, share_third]: [P; 2],
) -> [P; N] {
    let (one, third) = (P::splat(1.0), P::splat(1.0 / 3.0));
    // loops, for closures inside array functions would not be compiled for the level
    let (mut q, mut factor, mut largest) = (square, square, one);
    for i in 0..N {
        q[i] = square[i].sqrt();
        factor[i] = if WHOLE {
            third.mul_add(square[i], one) - q[i]
        } else {
            share.neg_mul_add(q[i], share_third.mul_add(square[i], one))
        };
        largest = if i == 0 { square[0] } else { largest.max(square[i]) };
    }
    // full sliding is rare: its divisions are made only where a lane slides
    if largest.any_from(one) {
        for i in 0..N {
            // the same digits in full as by a share of one, whatever the other lanes do
            let more = third / q[i].max(third) - one;
            let sliding = if WHOLE { more + one } else { share.mul_add(more, one) };
            factor[i] = square[i].if_less(one, factor[i], sliding);
        }
    }
    factor
}

/// (r_1 - r_2)/2 = (lambda + conicity)(e - shift)(1 + cubic (e - shift)^2)
#[derive(Clone, Copy)]
pub struct RollingRadius<P> {
    pub shift: P,
    pub conicity: P,
    pub cubic: P,
}

/// Adds to the terms of the rolling radius difference, times the amount alpha.
pub trait Rolling {
    fn roll<P: Part>(p: Numbers<'_>, alpha: P, gauge: P, s: f64, to: &mut RollingRadius<P>);
}

macro_rules! steps {
    (force { $($(#[$condition:meta])* $f:ident::$force:ident $(= $default:literal)? $(| $choice:ident = $word:literal)*,)* } creep { $($c:ident::$creep:ident,)* } rolling { $($r:ident::$roll:ident,)* }
     other { $($o:ident::$other:ident,)* }) => {
        impl Law {
            /// F of a force at the contact of a wheelset, with the gauge deviation there.
            #[inline(always)]
            pub fn at_contact<P: Part>(self, p: Numbers<'_>, e: P, v: P, s: f64, gauge: f64) -> P {
                match self {
                    $($(#[$condition])* Law::$force => <super::$f::$force as Force>::at_contact(p, e, v, s, gauge), $(Law::$choice => <super::$f::$choice as Force>::at_contact(p, e, v, s, gauge),)*)*
                    _ => P::zero(),
                }
            }

            /// Creep forces of a flange, and friction times creepage.
            #[inline(always)]
            pub fn friction<P: Part>(self, p: Numbers<'_>, of: &Flanging<P>) -> ([P; 2], P) {
                match self {
                    $($(#[$condition])* Law::$force => <super::$f::$force as Force>::friction(p, of), $(Law::$choice => <super::$f::$choice as Force>::friction(p, of),)*)*
                    _ => ([P::zero(); 2], P::zero()),
                }
            }

            /// T_x, T_y of N wheels; those of the linear law where this is none of creep.
            #[inline(always)]
            pub fn creep<P: Part, const N: usize>(self, p: Numbers<'_>, wheels: &[Creeping<P>; N]) -> [[P; 2]; N] {
                match self {
                    $(Law::$creep => creep_of::<super::$c::$creep, P, N>(p, wheels),)*
                    _ => linear_of(wheels),
                }
            }

            /// Contribution of a law of the rolling radii to their difference.
            #[inline(always)]
            pub fn roll<P: Part>(self, p: Numbers<'_>, alpha: P, gauge: P, s: f64, to: &mut RollingRadius<P>) {
                match self {
                    $(Law::$roll => <super::$r::$roll as Rolling>::roll(p, alpha, gauge, s, to),)*
                    _ => {}
                }
            }
        }
    };
}
laws!(steps);

#[inline(always)]
fn linear_of<P: Part, const N: usize>(wheels: &[Creeping<P>; N]) -> [[P; 2]; N] {
    let mut forces = [[P::zero(); 2]; N];
    for i in 0..N {
        forces[i] = [wheels[i].tx, wheels[i].ty];
    }
    forces
}

#[inline(always)]
fn creep_of<C: Creep, P: Part, const N: usize>(p: Numbers<'_>, wheels: &[Creeping<P>; N]) -> [[P; 2]; N] {
    let mut forces = linear_of(wheels);
    for i in 0..N {
        forces[i] = C::forces(p, &wheels[i]);
    }
    forces
}
