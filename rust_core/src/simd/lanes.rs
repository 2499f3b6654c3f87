//! Numbers of the vehicles of a group, and structs of such numbers.

/// Vehicles in one group.
pub const LANES: usize = 16;

/// One number per vehicle of a group.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Lanes(pub [f64; LANES]);

impl Lanes {
    pub const ZERO: Lanes = Lanes([0.0; LANES]);

    pub fn splat(x: f64) -> Self {
        Lanes([x; LANES])
    }

    pub fn from_fn(f: impl FnMut(usize) -> f64) -> Self {
        Lanes(std::array::from_fn(f))
    }

    pub fn is_zero(&self) -> bool {
        self.0.iter().all(|x| *x == 0.0)
    }
}

/// A struct of coefficients from one list of its fields: of one vehicle (`f64`), of sixteen ([`Lanes`]), of a part of these.
macro_rules! coefficients {
    ($(#[$about:meta])* $vis:vis struct $name:ident { $($(#[$doc:meta])* $field_vis:vis $field:ident,)* }) => {
        $(#[$about])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        $vis struct $name<T> { $($(#[$doc])* $field_vis $field: T,)* }

        impl $name<$crate::simd::Lanes> {
            /// The coefficients of one vehicle per lane.
            $vis fn of_lanes(one: impl FnMut(usize) -> $name<f64>) -> Self {
                let all: [_; $crate::simd::LANES] = std::array::from_fn(one);
                $name { $($field: $crate::simd::Lanes::from_fn(|l| all[l].$field),)* }
            }

            /// The lanes from `at` on, side by side in memory.
            #[inline(always)]
            $vis fn part<P: $crate::simd::Part>(&self, at: usize) -> $name<P> {
                $name { $($field: P::load(&self.$field, at),)* }
            }
        }
    };
}
pub(crate) use coefficients;
