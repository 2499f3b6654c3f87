//! The linear vehicles against published and hand-worked values.
use proptest::prelude::*;
use railui_core::vehicle::kinds::VehicleKind;

/// The bogie of the model's check values, no secondary spring.
fn check_bogie() -> Vec<f64> {
    let mut p = vec![2900.0, 3300.0, 1850.0, 1050.0, 120.0, 1.28, 0.75, 1.0, 0.46, 55e3, 3e6, 8e6, 0.0, 0.0, 3e4, 3e4];
    for _ in 0..2 {
        p.extend([0.18, 130.0, 120.0, 8.0, 0.05, 0.05]);
    }
    p.extend([0.25, 7e-3]);
    p
}

fn least_damped(speed: f64) -> (f64, f64, f64) {
    let z = VehicleKind::Bogie.assemble(&check_bogie(), &[], None).expect("a bogie").eigenvalues(speed);
    let oscillation = z.iter().find(|z| z.1 > 0.0).expect("it oscillates");
    (oscillation.0, oscillation.1, z.iter().map(|z| z.0).fold(f64::INFINITY, f64::min))
}

#[test]
fn the_bogie_has_the_eigenvalues_of_the_model() {
    for (speed, real, frequency, fastest) in [
        (10.0, -2.28035, 5.38976, -738.406),
        (20.0, -4.13918, 10.98602, -350.940),
        (40.0, -4.41556, 22.55234, -147.747),
        (60.0, -0.34808, 30.17447, -89.564),
    ] {
        let (re, im, low) = least_damped(speed);
        assert!((re - real).abs() < 1e-5 && (im - frequency).abs() < 1e-5 && (low - fastest).abs() < 1e-3, "{speed}");
    }
}

#[test]
fn the_bogie_turns_unstable_at_its_critical_speed() {
    let (mut low, mut high) = (60.0, 63.0);
    while high - low > 1e-7 {
        let middle = 0.5 * (low + high);
        if least_damped(middle).0 < 0.0 { low = middle } else { high = middle }
    }
    assert!((low - 61.64024).abs() < 1e-5, "{low}");
}

/// One wheelset on springs: f11 longitudinal, f22 lateral creep, s_y and s_psi stiffnesses.
#[derive(Clone, Copy, Debug)]
struct Wheel {
    m: f64,
    i: f64,
    f11: f64,
    f22: f64,
    b: f64,
    lambda: f64,
    r: f64,
    s_y: f64,
    s_psi: f64,
}

impl Wheel {
    /// V_c and w at neutral stability, in closed form.
    fn neutral(self) -> (f64, f64) {
        let Wheel { m, i, f11, f22, b, lambda, r, s_y, s_psi } = self;
        let w2 = (f22 * s_psi + f11 * b * b * s_y) / (f22 * i + f11 * b * b * m);
        let v2 = 4.0 * f11 * f22 * b * b * w2 / (4.0 * f11 * f22 * lambda * b / r + (s_y - m * w2) * (s_psi - i * w2));
        (v2.sqrt(), w2.sqrt())
    }

    /// Has the assembled wheelset this eigenvalue?
    fn has(self, speed: f64, (re, im): (f64, f64)) -> bool {
        let z = VehicleKind::Wheelset.assemble(&self.numbers(), &[], None).expect("a wheelset").eigenvalues(speed);
        z.iter().any(|z| (z.0 - re).hypot(z.1 - im) < 1e-6 * im)
    }

    fn numbers(self) -> Vec<f64> {
        let n = 50e3;
        let Wheel { m, i, f11, f22, b, lambda, r, s_y, s_psi } = self;
        vec![m, i, 0.0, b, r, n, s_y, s_psi, lambda, f11 / n, f22 / n, 0.0, 0.0, 0.0, 0.0]
    }
}

#[test]
fn the_published_wheelset_has_its_critical_speed() {
    let f = 6.563e6;
    let wheel = Wheel {
        m: 1022.0,
        i: 678.0,
        f11: f / 0.60252,
        f22: f / 0.54219,
        b: 0.7163,
        lambda: 0.05,
        r: 0.4572,
        s_y: 1.823e5,
        s_psi: 768_800.0,
    };
    let (v, w) = wheel.neutral();
    assert!((v - 69.83360931998).abs() < 1e-8 && (w / std::f64::consts::TAU - 4.334738642).abs() < 1e-8);
    assert!(wheel.has(v, (0.0, w)));
}

proptest! {
    #[test]
    fn a_wheelset_on_springs_is_neutral_at_the_closed_form_speed(
        m in 600.0..2500.0f64, i in 300.0..1500.0f64, f11 in 2e6..2e7f64, f22 in 2e6..2e7f64, lambda in 0.03..0.4f64,
        s_y in 1e5..1e6f64, s_psi in 2e5..4e6f64,
    ) {
        let wheel = Wheel { m, i, f11, f22, b: 0.75, lambda, r: 0.46, s_y, s_psi };
        let (v, w) = wheel.neutral();
        prop_assume!(v.is_finite() && v > 1.0 && v < 500.0);
        prop_assert!(wheel.has(v, (0.0, w)), "{v} {w}");
    }
}
