//! Number of RK4 steps per sample.
use crate::effects::effect::{Kind, Site, Slopes};
use crate::error::{Error, Result};
use crate::vehicle::assembly::{Assembly, Row, eigenvalues, radius_bound};
use crate::vehicle::structure::{Single, Structure, contact_site};
use crate::wheel_rail::coefficients::Wheelset;
use nalgebra::DMatrix;

/// Stability limit of RK4 on the negative real axis, and the share of it that a step may take.
const BOUND: f64 = 2.78;
const SHARE: f64 = 0.7;

/// Damping ratio from which a mode follows the forces on it without a resonance of its own.
const DAMPED: f64 = 0.7;

impl Structure {
    /// RK4 steps per sample: abs(lambda) h <= 1 for the linear vehicle (accuracy), `damped` for its modes of a damping
    /// ratio of 0.7 and more, and 0.7 of RK4's bound 2.78 with every effect's steepest slopes added (stability). Rounded
    /// up to 2^k or 3 2^k, so that few numbers occur.
    pub fn steps(&self, one: &Single<'_>, speeds: [f64; 2], dt: f64, damped: f64, limit: usize) -> Result<usize> {
        let [slowest, fastest] = speeds;
        let vehicle = self.assemble(one)?;
        let steepest = self.steepest(&vehicle, one, slowest)?;
        let more: Vec<_> = steepest.iter().map(|(row, s)| (row.as_slice(), s.stiffness, s.damping)).collect();
        let linear = |(re, im): &(f64, f64)| {
            let size = re.hypot(*im);
            if -re >= DAMPED * size { size / damped } else { size }
        };
        let stable = |(re, im): &(f64, f64)| re.hypot(*im) / (SHARE * BOUND);
        let mut needed: f64 = 1.0;
        for speed in if slowest < fastest { vec![slowest, fastest] } else { vec![slowest] } {
            let accurate = largest(vehicle.state_matrix(speed, &[]), |z| linear(z) * dt);
            let stable = largest(vehicle.state_matrix(speed, &more), |z| stable(z) * dt);
            needed = needed.max(accurate).max(stable);
        }
        let rate = steepest.iter().map(|(_, s)| s.rate).fold(0.0, f64::max);
        needed = needed.max(rate * dt / (SHARE * BOUND)).ceil();
        // what is far beyond the limit need not fit a whole number
        let steps = if needed <= limit as f64 { rounded_up(needed as usize) } else { usize::MAX };
        if steps > limit {
            let remedy = "raise the mass, soften the stiffest element or sample more often";
            return Err(Error::Stiff { needed, dt, limit, remedy });
        }
        Ok(steps)
    }

    /// The steepest slopes of everything that the linear vehicle lacks, each with the row through which it acts.
    fn steepest(&self, vehicle: &Assembly, one: &Single<'_>, slowest: f64) -> Result<Vec<(Row, Slopes)>> {
        let mut found = Vec::new();
        let slides = self.placed.iter().any(|placed| placed.law.record().kind == Kind::Creep);
        let creep_damping = |w: &Wheelset| 2.0 * w.kappa_y * w.n / slowest;
        for (i, placed, range) in self.acting() {
            let amount = one.amounts[i];
            let at = |site: &Site| {
                let s = placed.law.steepest_slopes(&one.effects[range.clone()], site);
                Slopes { stiffness: s.stiffness * amount, damping: s.damping * amount, rate: s.rate }
            };
            match placed.law.record().kind {
                Kind::Force if placed.at != "contact" => {
                    for port in self.ports(vehicle, placed)? {
                        found.push((port.row.clone(), at(&port.site)));
                    }
                }
                Kind::Force | Kind::Profile | Kind::Rail => {
                    for i in self.at_wheelsets(vehicle, placed)? {
                        let w = &vehicle.wheelsets[i];
                        // a wheel that slides does not damp the rail
                        let slides = slides && placed.law.record().kind == Kind::Rail;
                        let creep_damping = if slides { 0.0 } else { creep_damping(w) };
                        let site = Site { creep_damping, ..contact_site(vehicle, i) };
                        found.push((vec![(w.y, 1.0)], at(&site)));
                    }
                }
                Kind::Creep => {
                    for i in self.at_wheelsets(vehicle, placed)? {
                        let w = &vehicle.wheelsets[i];
                        let site = Site { creep_damping: creep_damping(w), ..contact_site(vehicle, i) };
                        let lateral = at(&site);
                        let yaw = Slopes { damping: lateral.damping * w.kappa_x / w.kappa_y * w.b * w.b, ..lateral };
                        found.extend([(vec![(w.y, 1.0)], lateral), (vec![(w.psi, 1.0)], yaw)]);
                    }
                }
                Kind::Rolling | Kind::Body | Kind::Sensor(_) => {}
            }
        }
        for own in &vehicle.laws {
            let mut slopes = own.law.steepest_slopes(&own.numbers, &Site::default());
            if own.law.record().states > 0 {
                // its slopes are in the matrix, with its own state
                slopes.stiffness = 0.0;
            }
            found.push((own.row.clone(), slopes));
        }
        Ok(found)
    }
}

/// Largest number of steps that an eigenvalue asks for, or an upper bound of it where that is one.
fn largest(matrix: DMatrix<f64>, steps: impl Fn(&(f64, f64)) -> f64) -> f64 {
    // a norm that bounds the eigenvalues is 20 times cheaper, and mostly enough for one step
    let bound = steps(&(0.0, radius_bound(matrix.clone())));
    if bound <= 1.0 {
        return bound;
    }
    let values = eigenvalues(matrix);
    // none where their iteration does not converge
    if values.is_empty() { bound } else { values.iter().map(steps).fold(0.0, f64::max) }
}

/// Smallest 2^k or 3 2^k that is no less.
fn rounded_up(needed: usize) -> usize {
    let power = needed.next_power_of_two();
    let between = power / 4 * 3;
    if power >= 4 && between >= needed { between } else { power }
}

#[cfg(test)]
mod tests {
    use super::rounded_up;

    #[test]
    fn steps_are_a_power_of_two_or_three_times_one() {
        let rounded: Vec<_> = [1, 2, 3, 4, 5, 6, 7, 9, 12, 13, 24, 25].map(rounded_up).into();
        assert_eq!(rounded, [1, 2, 3, 4, 6, 6, 8, 12, 12, 16, 24, 32]);
    }
}
