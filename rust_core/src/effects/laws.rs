//! Properties of every effect, tested over the catalogue.
use super::effect::*;
use super::*;
use crate::numeric::profile_spline::steepest_angle;
use crate::numeric::profile_table::ShapeLanes;
use crate::simd::{LANES, Lanes, Portable};

const SITE: Site = Site {
    stiffness: 6e6,
    damping: 3e4,
    motion: 0.01,
    speed: 0.3,
    usual_speed: 0.02,
    wheel_load: 55e3,
    creep_damping: 4.5e5,
    creep_slopes: [7e6, 6.5e6],
    gravitational: 1e6,
    behind: 0.0,
};

/// Defaults of a law in SI at a place like the primary suspension.
fn defaults(record: &Record) -> Vec<f64> {
    if record.key == "measured_force" {
        return vec![3.0, -0.01, 0.0, 0.02, 500.0, 0.0, -900.0];
    }
    let scale = |times: &str| match times {
        "k" => SITE.stiffness,
        "c" => SITE.damping,
        "z" => 5e-3,
        "v" => 5e-2,
        "F" => SITE.stiffness * 5e-3,
        "k/z^2" => SITE.stiffness / 25e-6,
        "k/z" => SITE.stiffness / 5e-3,
        "c/v" => SITE.damping / 5e-2,
        "k/w" => SITE.stiffness / 10.0,
        "m" => 2900.0,
        "h" => 7e-3,
        "r" => 0.46,
        "1" => 1.0,
        other => panic!("a test must know the scale {other}"),
    };
    record.params.iter().map(|p| p.default * scale(p.times)).collect()
}

struct Ready {
    law: Law,
    record: &'static Record,
    raw: Vec<f64>,
    lanes: Vec<Lanes>,
}

fn forces() -> Vec<Ready> {
    CATALOGUE
        .iter()
        .filter(|law| law.record().kind == Kind::Force)
        .map(|law| {
            let raw = defaults(law.record());
            let lanes = law.prepare(&raw, &SITE).into_iter().map(Lanes::splat).collect();
            Ready { law: *law, record: law.record(), raw, lanes }
        })
        .collect()
}

/// F and x' at (z, v, x).
fn force(r: &Ready, z: f64, v: f64, x: f64) -> (f64, f64) {
    let numbers = Numbers { lanes: &r.lanes, at: 0 };
    let mut dx = Portable::zero();
    let f = r.law.force(numbers, Portable::splat(z), Portable::splat(v), 0.0, Portable::splat(x), &mut dx);
    let (mut a, mut b) = (Lanes::ZERO, Lanes::ZERO);
    f.store(&mut a, 0);
    dx.store(&mut b, 0);
    (a.0[0], b.0[0])
}

#[test]
fn keys_are_known_once_and_found_by_name() {
    for law in CATALOGUE {
        assert_eq!(Law::named(law.record().key), Some(*law));
        let record = law.record();
        assert!(!record.at.is_empty() && [record.source, record.title, record.law].iter().all(|text| !text.is_empty()));
    }
}

#[test]
fn a_force_or_a_rail_has_one_own_state_at_most() {
    for law in CATALOGUE {
        let record = law.record();
        assert!(record.states <= 1 || !matches!(record.kind, Kind::Force | Kind::Rail), "{}", record.key);
    }
}

#[test]
fn a_default_lies_in_its_range_and_names_its_origin() {
    for law in CATALOGUE {
        for p in law.record().params {
            assert!(p.minimum <= p.default && p.default <= p.maximum, "{} {}", law.record().key, p.key);
            assert!(!p.origin.is_empty());
        }
    }
}

#[test]
fn a_shape_gives_every_number_that_is_searched_for() {
    for law in CATALOGUE {
        let r = law.record();
        let searched = r.params.iter().filter(|p| !matches!(p.role, Role::Optional | Role::Run)).count();
        assert_eq!(r.candidate, !r.shapes.is_empty(), "{}", r.key);
        assert!(r.shapes.iter().all(|s| s.len() >= searched && s.len() <= r.params.len()), "{}", r.key);
    }
}

#[test]
fn every_force_but_an_outer_one_is_silent_at_rest() {
    for r in forces().iter().filter(|r| r.record.dissipates) {
        assert_eq!(force(r, 0.0, 0.0, 0.0).0.abs(), 0.0, "{}", r.record.key);
    }
}

#[test]
fn a_force_is_odd_exactly_where_its_record_says_so() {
    for r in forces().iter().filter(|r| r.record.dissipates) {
        let (f, g) = (force(r, 4e-3, 0.07, 0.3), force(r, -4e-3, -0.07, -0.3));
        let odd = (f.0 + g.0).abs() <= 1e-12 * f.0.abs() && (f.1 + g.1).abs() <= 1e-12 * f.1.abs();
        assert_eq!(odd, r.record.odd, "{}: {} {}", r.record.key, f.0, g.0);
    }
}

#[test]
fn no_energy_is_made_over_a_closed_cycle_by_a_law_that_dissipates() {
    for r in forces().iter().filter(|r| r.record.dissipates) {
        let (amplitude, w, n) = (6e-3, 12.0, 40_000);
        let h = 2.0 * std::f64::consts::PI / w / n as f64;
        let (mut x, mut work, mut scale) = (0.0, 0.0, 0.0);
        // the second turn, when the state of the law has settled
        for k in 0..2 * n {
            let phase = w * h * k as f64;
            let (z, v) = (amplitude * phase.sin(), amplitude * w * phase.cos());
            let (f, dx) = force(r, z, v, x);
            x += h * dx;
            if k >= n {
                work += f * v * h;
                scale += (f * v * h).abs();
            }
        }
        assert!(work <= 1e-3 * scale, "{} makes {work} J of {scale}", r.record.key);
    }
}

#[test]
fn the_steepest_slope_bounds_finite_differences() {
    for r in forces().iter().filter(|r| r.record.dissipates && r.record.supersedes == Supersedes::Nothing) {
        let slopes = r.law.steepest_slopes(&r.raw, &SITE);
        let (mut dz, mut dv): (f64, f64) = (0.0, 0.0);
        for i in -20..=20 {
            for j in -20..=20 {
                let (z, v) = (SITE.motion * f64::from(i) / 20.0, SITE.speed * f64::from(j) / 20.0);
                let (a, b) = (1e-7 * SITE.motion, 1e-7 * SITE.speed);
                dz = dz.max(-(force(r, z + a, v, 0.2).0 - force(r, z - a, v, 0.2).0) / (2.0 * a));
                dv = dv.max(-(force(r, z, v + b, 0.2).0 - force(r, z, v - b, 0.2).0) / (2.0 * b));
            }
        }
        assert!(dz <= slopes.stiffness * 1.001 + 1e-3, "{} dF/dz {dz} {}", r.record.key, slopes.stiffness);
        assert!(dv <= slopes.damping * 1.001 + 1e-3, "{} dF/dv {dv} {}", r.record.key, slopes.damping);
    }
}

#[test]
fn two_laws_at_a_location_differ() {
    // laws with a state of their own answer to a history, not to a point
    let all: Vec<_> = forces().into_iter().filter(|r| r.record.states == 0).collect();
    let points: Vec<_> = (0..60)
        .map(|i| (9e-3 * (i as f64 * 0.7).sin(), 0.2 * (i as f64 * 1.1).cos(), 0.5 * (i as f64).sin()))
        .collect();
    let curve = |r: &Ready| points.iter().map(|(z, v, x)| force(r, *z, *v, *x).0).collect::<Vec<_>>();
    for (i, a) in all.iter().enumerate() {
        for b in &all[..i] {
            let shared = a.record.at.iter().any(|at| b.record.at.contains(at) && *at == "primary_lateral");
            if !shared || a.record.key == "measured_force" || b.record.key == "measured_force" {
                continue;
            }
            let (x, y) = (curve(a), curve(b));
            let dot = |p: &[f64], q: &[f64]| p.iter().zip(q).map(|(s, t)| s * t).sum::<f64>();
            let cosine = dot(&x, &y) / (dot(&x, &x) * dot(&y, &y)).sqrt();
            assert!(cosine.abs() < 0.999, "{} and {}: {cosine}", a.record.key, b.record.key);
        }
    }
}

#[test]
fn friction_saturates_at_its_force() {
    let r = forces().into_iter().find(|r| r.record.key == "dry_friction").expect("in the list");
    assert!((force(&r, 0.0, 10.0, 0.0).0 + r.raw[0]).abs() < 1e-9 * r.raw[0]);
}

#[test]
fn free_play_and_the_declared_spring_make_nothing_inside_and_a_spring_beyond() {
    let r = forces().into_iter().find(|r| r.record.key == "free_play").expect("in the list");
    let net_force = |z: f64| force(&r, z, 0.0, 0.0).0 - SITE.stiffness * z;
    let h = r.raw[0];
    assert!(net_force(0.9 * h).abs() < 1e-9 * SITE.stiffness * h);
    assert!((net_force(3.0 * h) + SITE.stiffness * 2.0 * h).abs() < 1e-9 * SITE.stiffness * h);
}

#[test]
fn the_creep_factor_follows_the_cubic_and_then_the_friction_limit() {
    // q = T/(mu N): 1 - q/3 + q^2/27 at q = 1.5, 1/q at q = 6
    let mu = 0.3;
    let factor = |q: f64| {
        let t = q * mu * SITE.wheel_load;
        let [x, y] = Law::CreepSaturation.creep_of_one(&[mu], &SITE, [0.6 * t, 0.8 * t, 0.0, 40.0]);
        assert!((x / (0.6 * t) - y / (0.8 * t)).abs() < 1e-12);
        x / (0.6 * t)
    };
    assert!((factor(1.5) - (1.0 - 0.5 + 2.25 / 27.0)).abs() < 1e-12);
    assert!((factor(6.0) - 1.0 / 6.0).abs() < 1e-12);
}

#[test]
fn every_creep_law_starts_linear_is_odd_and_ends_at_or_below_the_friction_limit() {
    for law in CATALOGUE.iter().filter(|law| law.record().kind == Kind::Creep) {
        let (p, key) = (defaults(law.record()), law.record().key);
        let limit = p[0] * SITE.wheel_load;
        let at = |q: f64| law.creep_of_one(&p, &SITE, [0.6 * q * limit, 0.8 * q * limit, 0.0, 40.0]);
        let size = |[x, y]: [f64; 2]| x.hypot(y) / limit;
        assert!((size(at(1e-6)) / 1e-6 - 1.0).abs() < 1e-5, "{key} begins with {}", size(at(1e-6)) / 1e-6);
        assert!(size(at(1e3)) <= 1.0 + 1e-12 && size(at(30.0)) > 0.95, "{key} ends at {}", size(at(1e3)));
        let (f, g) = (at(0.7), at(-0.7));
        assert!((f[0] + g[0]).abs() + (f[1] + g[1]).abs() < 1e-9 * limit, "{key} is not odd");
        // rising all the way: no law of the list falls where friction does not
        assert!(
            (1..60).all(|k| size(at(0.1 * f64::from(k))) > size(at(0.1 * f64::from(k - 1)))
                || size(at(0.1 * f64::from(k))) > 1.0 - 1e-12),
            "{key} falls"
        );
    }
}

#[test]
fn polach_follows_his_formula() {
    // F = (2 mu Q/pi)(kA e/(1 + (kA e)^2) + atan(kS e)), e = (pi/4) T/(mu Q); kA 0.8, kS 0.4; friction falls with slip
    let (load, t) = (SITE.wheel_load, 31e3);
    let site = Site { creep_slopes: [150.0 * load, 150.0 * load], ..SITE };
    let slip: f64 = 40.0 * t / (150.0 * load);
    let mu = 0.4 * ((1.0 - 0.4) * (-0.6 * slip).exp() + 0.4);
    let e = std::f64::consts::FRAC_PI_4 * t / (mu * load);
    let expected = 2.0 * mu * load / std::f64::consts::PI * (0.8 * e / (1.0 + 0.64 * e * e) + (0.4 * e).atan());
    let [x, y] = Law::Polach.creep_of_one(&[0.4, 0.8, 0.4, 0.4, 0.6], &site, [0.6 * t, 0.8 * t, 0.0, 40.0]);
    assert!((x.hypot(y) / expected - 1.0).abs() < 1e-12, "{} {expected}", x.hypot(y));
    assert!((y / x - 0.8 / 0.6).abs() < 1e-12);
}

#[test]
fn vermeulen_and_johnson_leave_spin_out() {
    let with = Law::VermeulenJohnson.creep_of_one(&[0.3, 1.0, 1.0], &SITE, [3e3, 5e3 + 900.0, 900.0, 40.0]);
    let without = Law::CreepSaturation.creep_of_one(&[0.3], &SITE, [3e3, 5e3, 0.0, 40.0]);
    assert!((with[0] - without[0]).abs() + (with[1] - without[1]).abs() < 1e-9);
}

#[test]
fn a_profile_that_is_a_straight_line_is_the_linear_conicity() {
    let line = [0.0, -4e-3, 1e-3, -4e-3, -3e-3, -2e-3, -1e-3, 0.0, 1e-3];
    let mut raw = vec![6.0, line[1], line[2]];
    raw.extend(&line[3..]);
    raw.extend([0.0; 6]);
    raw.extend(&line[3..]);
    let shape = ShapeLanes::new(&[&raw[..]; LANES], Lanes::splat(1.0));
    for d in [-9e-3, -3.4e-3, 0.0, 2.7e-4, 8e-3] {
        let (s, t) = shape.at(0, Portable::splat(d), Portable::splat(1e-3), Portable::splat(d));
        let (mut a, mut b) = (Lanes::ZERO, Lanes::ZERO);
        s.store(&mut a, 0);
        t.store(&mut b, 0);
        assert!((a.0[0] - d).abs() < 1e-15 && (b.0[0] - d).abs() < 1e-15, "{d}: {} {}", a.0[0], b.0[0]);
    }
}

#[test]
fn the_steepest_contact_angle_is_that_of_a_fine_look() {
    let mut raw = vec![6.0, 0.0, 1e-3];
    raw.extend([0.0; 12]);
    raw.extend([0.0, 1e-4, 9e-4, 3e-3, 3.3e-3, 3.4e-3]);
    let shape = ShapeLanes::new(&[&raw[..]; LANES], Lanes::splat(1.0));
    let angle = |e: f64| {
        let (_, t) = shape.at(0, Portable::zero(), Portable::zero(), Portable::splat(e));
        let mut out = Lanes::ZERO;
        t.store(&mut out, 0);
        out.0[0]
    };
    let slopes = (1..5000).map(|k| 1e-6 * f64::from(k)).map(|e| (angle(e + 1e-7) - angle(e - 1e-7)) / 2e-7);
    let looked = slopes.fold(0.0, f64::max);
    assert!((steepest_angle(&raw) / looked - 1.0).abs() < 1e-6, "{} {looked}", steepest_angle(&raw));
}
