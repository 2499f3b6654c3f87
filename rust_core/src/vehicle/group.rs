//! A group of sixteen vehicles of one structure: the rate of change of its state.
use crate::effects::PlacedLaw;
use crate::effects::effect::Alteration;
use crate::effects::port::Port;
use crate::numeric::sparse_rows::Rows;
use crate::simd::{Lanes, Part};
use crate::vehicle::channels::Reading;
use crate::vehicle::plain_bogie::{PlainBogie, Suspension};
use crate::wheel_rail::coefficients::Contact;
use crate::wheel_rail::wheelset::{Contacts, WheelsetLanes};

/// Input of the step loop: sixteen vehicles of one structure.
#[derive(Clone, Debug)]
pub struct Group {
    pub dofs: usize,
    pub states: usize,
    pub columns: usize,
    /// -K and -C over x = [q, q'], and what the track moves of the suspension.
    pub matrix: Rows,
    pub inv_mass: Vec<Lanes>,
    pub wheelsets: Vec<WheelsetLanes>,
    pub forces: Vec<PlacedLaw>,
    pub speed_scale: Lanes,
    pub inv_speed_scale: Lanes,
    pub limit: f64,
    /// Set where the structure is a bogie with nothing but saturation and flange: its rate in one piece.
    pub plain: Option<PlainBogie<Lanes>>,
    /// Set where the structure is a bogie that the track moves through its contacts alone.
    pub suspension: Option<Suspension<Lanes>>,
    /// Set where another structure has no more at its contacts than that.
    pub contacts: Option<Vec<Contact<Lanes>>>,
    /// Own states that are clamped to a largest magnitude at the end of every step.
    pub clamped_states: Vec<(usize, Lanes)>,
    /// Contribution of the load transfer to the guiding forces of every wheelset; without terms where nothing rolls.
    pub leaning: Vec<Reading>,
    pub readings: Vec<Reading>,
    /// Sensor laws: what they alter, the channel, its number times the amount.
    pub sensors: Vec<(Alteration, String, Lanes)>,
}

impl Group {
    /// Does a creep force saturate or a flange touch anywhere?
    pub fn touches(&self) -> bool {
        self.wheelsets.iter().any(|w| !w.creeps.is_empty() || !w.laws.is_empty())
    }

    /// The plain bogie, where nothing acts except its contacts and these act in full.
    pub fn fully_plain(&self) -> Option<&PlainBogie<Lanes>> {
        self.plain.as_ref().filter(|bogie| bogie.acts_fully() && self.forces.is_empty())
    }

    /// Its contacts with any laws, of the lanes from `at` on.
    #[inline(always)]
    pub fn contacts<P: Part>(&self, at: usize) -> Contacts<'_, P> {
        Contacts::new(&self.wheelsets, [&self.speed_scale, &self.inv_speed_scale], at)
    }

    /// The laws at ports, whose forces go to `pushes`.
    #[inline(always)]
    pub fn ports<P: Part>(&self, at: usize, pushes: fn(&PlacedLaw) -> &[(usize, Lanes)]) -> Vec<Port<'_, P>> {
        self.forces.iter().map(|law| Port::new(law, pushes(law), self.dofs, &self.speed_scale, at)).collect()
    }
}
