//! Bodies and elements to matrices, rows and ports.
use crate::effects::Law;
use crate::effects::effect::Site;
use crate::error::{Error, Result, expect_len};
use crate::wheelset::Wheelset;
use nalgebra::DMatrix;

/// A symmetric term at a port: its row, stiffness, damping.
pub type Term<'a> = (&'a [(usize, f64)], f64, f64);

/// A row of coefficients: z = sum of row x q, and a force returns through the same row.
pub type Row = Vec<(usize, f64)>;

/// Terms of the input table: (column, factor). The next column of a track quantity is its slope d/ds.
pub type Inputs = Vec<(usize, f64)>;

/// Forces of the input table: (degree of freedom, column, factor).
pub type Driven = Vec<(usize, usize, f64)>;

/// The number of the place between all wheelsets at once: the linkage.
pub const LINKAGE: u8 = u8::MAX;

/// A named place where effects may stand.
#[derive(Clone, Debug)]
pub struct Port {
    pub at: String,
    /// The place of the catalogue that it is one of.
    pub class: &'static str,
    /// 0: the place belongs to no single wheelset.
    pub wheelset: u8,
    pub row: Row,
    pub inputs: Inputs,
    pub site: Site,
}

/// A law that belongs to the vehicle itself: a stop, a spring and a damper in series.
#[derive(Clone, Debug)]
pub struct OwnLaw {
    pub law: Law,
    pub row: Row,
    pub inputs: Inputs,
    pub numbers: Vec<f64>,
}

/// What a channel shows of a row: position, velocity or acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    Position,
    Velocity,
    Acceleration,
}

/// A measured or wanted signal: a row of the motion plus columns of the input table.
#[derive(Clone, Debug)]
pub struct Channel {
    pub name: String,
    pub order: Order,
    pub row: Row,
    /// Further terms of the motion.
    pub also: Vec<(Order, Row)>,
    pub inputs: Inputs,
    /// Columns that the speed multiplies.
    pub rates: Inputs,
    /// The wheelset whose rail movement is taken off.
    pub rail: Option<usize>,
}

/// One vehicle: M q'' + C q' + K q = E u(t), wheelsets, ports, channels. M is diagonal: bodies are
/// described at their centres of mass.
#[derive(Clone, Debug)]
pub struct Assembly {
    pub dofs: Vec<String>,
    pub mass: Vec<f64>,
    pub stiffness: DMatrix<f64>,
    pub damping: DMatrix<f64>,
    pub wheelsets: Vec<Wheelset>,
    pub ports: Vec<Port>,
    /// (degree of freedom, column, factor): forces of the input table, and those that the speed multiplies.
    pub inputs: Driven,
    pub rates: Driven,
    pub laws: Vec<OwnLaw>,
    pub channels: Vec<Channel>,
    /// Beyond these the run counts as diverged: abs(e_i) and abs(psi_i), or abs(q) where there is no wheelset.
    pub limit: f64,
}

impl Assembly {
    /// Bodies alone, by name and mass: no springs, no ports yet.
    pub fn of(masses: &[(&str, f64)]) -> Self {
        let n = masses.len();
        Assembly {
            dofs: masses.iter().map(|b| b.0.to_string()).collect(),
            mass: masses.iter().map(|b| b.1).collect(),
            stiffness: DMatrix::zeros(n, n),
            damping: DMatrix::zeros(n, n),
            wheelsets: Vec::new(),
            ports: Vec::new(),
            inputs: Vec::new(),
            rates: Vec::new(),
            laws: Vec::new(),
            channels: Vec::new(),
            limit: 0.1,
        }
    }

    /// matrix += row^T value row
    fn element(matrix: &mut DMatrix<f64>, row: &[(usize, f64)], value: f64) {
        for &(i, a) in row {
            for &(j, b) in row {
                matrix[(i, j)] += a * value * b;
            }
        }
    }

    /// Every body has a mass above zero, or the first that has not is named.
    pub fn check_masses(&self) -> Result<()> {
        let Some(i) = self.mass.iter().position(|m| m.partial_cmp(&0.0) != Some(std::cmp::Ordering::Greater)) else {
            return Ok(());
        };
        Err(Error::Value { what: format!("mass of {}", self.dofs[i]), value: self.mass[i], rule: "positive" })
    }

    /// A spring between the bodies of a row.
    pub fn spring(&mut self, row: &[(usize, f64)], stiffness: f64) {
        Self::element(&mut self.stiffness, row, stiffness);
    }

    /// A viscous damper between the bodies of a row.
    pub fn damper(&mut self, row: &[(usize, f64)], damping: f64) {
        Self::element(&mut self.damping, row, damping);
    }

    /// A port with the linear spring and damper that stand there already.
    fn port(&mut self, at: &'static str, wheelset: u8, row: &[(usize, f64)], stiffness: f64, damping: f64) {
        let site = Site::moving(stiffness, damping);
        let (row, inputs) = (row.to_vec(), Inputs::new());
        self.ports.push(Port { at: at.into(), class: at, wheelset, row, inputs, site });
    }

    /// A further signal of the motion of a row.
    pub fn channel(&mut self, name: &str, order: Order, row: &[(usize, f64)]) -> &mut Channel {
        let (also, inputs, rates) = (Vec::new(), Inputs::new(), Inputs::new());
        self.channels.push(Channel { name: name.into(), order, row: row.to_vec(), also, inputs, rates, rail: None });
        self.channels.last_mut().expect("just pushed")
    }

    /// The motion at every port as channels `z.PLACE.WHEELSET` and `v.PLACE.WHEELSET`.
    pub fn port_channels(&mut self) {
        for port in self.ports.clone() {
            let number = if port.wheelset == LINKAGE { "linkage".into() } else { port.wheelset.to_string() };
            let z = self.channel(&format!("z.{}.{number}", port.at), Order::Position, &port.row);
            z.inputs = port.inputs.clone();
            let v = self.channel(&format!("v.{}.{number}", port.at), Order::Velocity, &port.row);
            v.rates = port.inputs.iter().map(|(column, factor)| (column + 1, *factor)).collect();
        }
    }

    /// The ports of a place: of one wheelset, or with 0 of every wheelset.
    pub fn places(&self, at: &str, wheelset: u8) -> Vec<&Port> {
        self.ports
            .iter()
            .filter(|p| p.at == at && (p.wheelset == wheelset || (wheelset == 0 && p.wheelset != LINKAGE)))
            .collect()
    }

    /// A coach of one lateral mode above the frame, in the place of the declared secondary lateral terms; with
    /// amount alpha the frame feels alpha of it and (1 - alpha) of the declared terms.
    pub fn add_coach(&mut self, alpha: f64, mass: f64, k: f64, c: f64) {
        let Some(place) = self.ports.iter().position(|p| p.at == "secondary_lateral") else {
            return;
        };
        let (y, site) = (self.ports[place].row[0].0, self.ports[place].site);
        let coach = self.dofs.len();
        self.dofs.push("y_c".into());
        self.mass.push(mass);
        for (matrix, declared, new) in [(&mut self.stiffness, site.stiffness, k), (&mut self.damping, site.damping, c)]
        {
            let mut grown = matrix.clone().resize(coach + 1, coach + 1, 0.0);
            grown[(y, y)] += alpha * (new - declared);
            grown[(y, coach)] -= alpha * new;
            grown[(coach, y)] -= new;
            grown[(coach, coach)] += new;
            *matrix = grown;
        }
        self.ports[place].row.push((coach, -alpha));
        for channel in self.channels.iter_mut().filter(|c| c.name.contains(".secondary_lateral.")) {
            channel.row.push((coach, -alpha));
        }
    }

    /// State matrix of x = [q, q', forces of springs and dampers in series] at a speed, with further symmetric terms at ports: (port row, k, c).
    pub fn state_matrix(&self, speed: f64, more: &[Term<'_>]) -> DMatrix<f64> {
        let n = self.dofs.len();
        let (mut k, mut c) = (self.stiffness.clone(), self.damping.clone());
        for w in &self.wheelsets {
            let (kw, cw) = w.linear(speed);
            for (a, i) in [w.y, w.psi].into_iter().enumerate() {
                for (b, j) in [w.y, w.psi].into_iter().enumerate() {
                    k[(i, j)] += kw[a][b];
                    c[(i, j)] += cw[a][b];
                }
            }
        }
        for (row, stiffness, damping) in more {
            Self::element(&mut k, row, *stiffness);
            Self::element(&mut c, row, *damping);
        }
        let series: Vec<_> = self.laws.iter().filter(|own| own.law == Law::MaxwellDamper).collect();
        let mut a = DMatrix::zeros(2 * n + series.len(), 2 * n + series.len());
        for i in 0..n {
            a[(i, n + i)] = 1.0;
            for j in 0..n {
                a[(n + i, j)] = -k[(i, j)] / self.mass[i];
                a[(n + i, n + j)] = -c[(i, j)] / self.mass[i];
            }
        }
        for (at, own) in series.iter().enumerate() {
            // f' = k v - (k/c) f, F = -f
            let (f, k, c) = (2 * n + at, own.numbers[0], own.numbers[1]);
            for &(i, share) in &own.row {
                a[(f, n + i)] += k * share;
                a[(n + i, f)] -= share / self.mass[i];
            }
            a[(f, f)] = -k / c;
        }
        a
    }

    /// Eigenvalues of the linear vehicle at a speed, least damped first.
    pub fn eigenvalues(&self, speed: f64) -> Vec<(f64, f64)> {
        eigenvalues(self.state_matrix(speed, &[]))
    }
}

/// Eigenvalues of a real matrix, largest real part first.
pub fn eigenvalues(a: DMatrix<f64>) -> Vec<(f64, f64)> {
    let Some(schur) = nalgebra::linalg::Schur::try_new(a, f64::EPSILON, 10_000) else {
        return Vec::new();
    };
    let mut values: Vec<_> = schur.complex_eigenvalues().iter().map(|z| (z.re, z.im)).collect();
    values.sort_by(|a, b| b.0.total_cmp(&a.0).then(b.1.total_cmp(&a.1)));
    values
}

/// What no eigenvalue of a real matrix exceeds in magnitude: the smaller of two norms of the balanced matrix.
pub fn radius_bound(mut a: DMatrix<f64>) -> f64 {
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut a);
    let largest = |sums: Vec<f64>| sums.into_iter().fold(0.0, f64::max);
    let rows = largest(a.row_iter().map(|row| row.iter().map(|x| x.abs()).sum()).collect());
    let columns = largest(a.column_iter().map(|column| column.iter().map(|x| x.abs()).sum()).collect());
    rows.min(columns)
}

/// The kinds of vehicles and the numbers that each is assembled from, by their paths in a design.
pub fn parameters(kind: &str) -> Result<&'static [&'static str]> {
    match kind {
        "bogie" => Ok(&BOGIE),
        "wheelset" => Ok(&WHEELSET),
        "rig" => Ok(&RIG),
        _ => Err(Error::Vehicle(kind.into())),
    }
}

/// Columns of the input table that a kind of vehicle reads.
pub fn columns(kind: &str) -> usize {
    match kind {
        "bogie" => 14,
        "wheelset" => 7,
        _ => 5,
    }
}

/// Assemble one vehicle; `measured` names the forces of the coach that the input table holds (Qy, Qpsi).
pub fn assemble(kind: &str, p: &[f64], measured: &[String]) -> Result<Assembly> {
    let names = parameters(kind)?;
    expect_len(&format!("numbers of a {kind}"), p.len(), names.len())?;
    for (name, value) in names.iter().zip(p) {
        if !value.is_finite() {
            return Err(Error::Value { what: (*name).into(), value: *value, rule: "finite" });
        }
    }
    let mut vehicle = match kind {
        "bogie" => bogie(p, measured),
        "wheelset" => wheelset_on_springs(p),
        _ => rig(p),
    };
    vehicle.check_masses()?;
    vehicle.port_channels();
    Ok(vehicle)
}

pub const BOGIE: [&str; 30] = [
    "vehicle.frame.mass",
    "vehicle.frame.yaw_inertia",
    "vehicle.wheelset.mass",
    "vehicle.wheelset.yaw_inertia",
    "vehicle.wheelset.spin_inertia",
    "vehicle.geometry.half_wheelbase",
    "vehicle.geometry.half_gauge",
    "vehicle.geometry.half_spring_base",
    "vehicle.geometry.rolling_radius",
    "vehicle.wheel_load",
    "vehicle.primary.lateral_stiffness",
    "vehicle.primary.longitudinal_stiffness",
    "vehicle.secondary.lateral_stiffness",
    "vehicle.secondary.yaw_stiffness",
    "vehicle.secondary.lateral_damping",
    "vehicle.secondary.yaw_damping",
    "contact.leading.conicity",
    "contact.leading.longitudinal_creep",
    "contact.leading.lateral_creep",
    "contact.leading.gravitational_stiffness",
    "contact.leading.contact_angle",
    "contact.leading.roll",
    "contact.trailing.conicity",
    "contact.trailing.longitudinal_creep",
    "contact.trailing.lateral_creep",
    "contact.trailing.gravitational_stiffness",
    "contact.trailing.contact_angle",
    "contact.trailing.roll",
    "contact.spin_creep",
    "contact.flange_clearance",
];

/// The bogie of docs/theory.md: q = [y, psi, y1, psi1, y2, psi2], (3.1) and (3.10).
fn bogie(p: &[f64], measured: &[String]) -> Assembly {
    let [m_b, i_zb, m_a, i_za, i_ya, a, b, b_c, r, n] = p[..10].try_into().expect("ten numbers");
    let [c_y, c_x, mut c_sy, mut c_spsi, mut k_y, mut k_psi] = p[10..16].try_into().expect("six numbers");
    let (drives_y, drives_psi) = (measured.iter().any(|q| q == "Qy"), measured.iter().any(|q| q == "Qpsi"));
    if drives_y {
        (c_sy, k_y) = (0.0, 0.0);
    }
    if drives_psi {
        (c_spsi, k_psi) = (0.0, 0.0);
    }
    let mut v = Assembly::of(&[("y", m_b), ("psi", i_zb), ("y1", m_a), ("psi1", i_za), ("y2", m_a), ("psi2", i_za)]);
    let lateral = [[(2, 1.0), (0, -1.0), (1, -a)], [(4, 1.0), (0, -1.0), (1, a)]];
    let yaw = [[(3, 1.0), (1, -1.0)], [(5, 1.0), (1, -1.0)]];
    let yaw_stiffness = 2.0 * c_x * b_c * b_c;
    v.spring(&[(0, 1.0)], c_sy);
    v.damper(&[(0, 1.0)], k_y);
    v.spring(&[(1, 1.0)], c_spsi);
    v.damper(&[(1, 1.0)], k_psi);
    v.port("secondary_lateral", 0, &[(0, 1.0)], c_sy, k_y);
    v.port("secondary_yaw", 0, &[(1, 1.0)], c_spsi, k_psi);
    for i in 0..2 {
        let number = i as u8 + 1;
        v.spring(&lateral[i], 2.0 * c_y);
        v.spring(&yaw[i], yaw_stiffness);
        v.port("primary_lateral", number, &lateral[i], 2.0 * c_y, 0.0);
        v.port("primary_yaw", number, &yaw[i], yaw_stiffness, 0.0);
        v.port("wheelset", number, &[(2 + 2 * i, 1.0)], 0.0, 0.0);
        v.port("wheelset_yaw", number, &[(3 + 2 * i, 1.0)], 0.0, 0.0);
        let c = &p[16 + 6 * i..22 + 6 * i];
        v.wheelsets.push(Wheelset {
            y: 2 + 2 * i,
            psi: 3 + 2 * i,
            column: 2 + 5 * i,
            lambda: c[0],
            kappa_x: c[1],
            kappa_y: c[2],
            epsilon: c[3],
            delta: c[4],
            sigma: c[5],
            kappa_s: p[28],
            n,
            r,
            b,
            i_ya,
        });
    }
    // the linkage between the two wheelsets
    v.port("wheelset_yaw", LINKAGE, &[(3, 1.0), (5, 1.0)], 0.0, 0.0);
    v.port("frame", 0, &[(0, 1.0)], 0.0, 0.0);
    v.port("frame_yaw", 0, &[(1, 1.0)], 0.0, 0.0);
    for (drives, dof) in [(drives_y, 0), (drives_psi, 1)] {
        if drives {
            v.inputs.push((dof, 12 + dof, 1.0));
        }
    }
    for i in 0..2 {
        let column = 2 + 5 * i;
        let e = v.channel(&format!("e{}", i + 1), Order::Position, &[(2 + 2 * i, 1.0)]);
        e.inputs = vec![(column, -1.0), (column + 2, -r)];
        e.rail = Some(i);
    }
    v.channel("ay1", Order::Acceleration, &[(2, 1.0)]);
    v.channel("ay2", Order::Acceleration, &[(4, 1.0)]);
    v.channel("ayf", Order::Acceleration, &[(0, 1.0)]);
    v.channel("rf", Order::Velocity, &[(1, 1.0)]);
    v.channel("d1", Order::Position, &lateral[0]);
    v.channel("d2", Order::Position, &lateral[1]);
    v.channel("psi1", Order::Position, &[(3, 1.0)]);
    v.channel("psi2", Order::Position, &[(5, 1.0)]);
    v
}

pub const WHEELSET: [&str; 15] = [
    "mass",
    "yaw_inertia",
    "spin_inertia",
    "half_gauge",
    "rolling_radius",
    "wheel_load",
    "lateral_stiffness",
    "yaw_stiffness",
    "conicity",
    "longitudinal_creep",
    "lateral_creep",
    "gravitational_stiffness",
    "contact_angle",
    "roll",
    "spin_creep",
];

/// One wheelset on springs to the ground.
fn wheelset_on_springs(p: &[f64]) -> Assembly {
    let [m, i_z, i_ya, b, r, n, s_y, s_psi] = p[..8].try_into().expect("eight numbers");
    let c = &p[8..];
    let mut v = Assembly::of(&[("y1", m), ("psi1", i_z)]);
    v.spring(&[(0, 1.0)], s_y);
    v.spring(&[(1, 1.0)], s_psi);
    v.port("primary_lateral", 1, &[(0, 1.0)], s_y, 0.0);
    v.port("primary_yaw", 1, &[(1, 1.0)], s_psi, 0.0);
    v.wheelsets.push(Wheelset {
        y: 0,
        psi: 1,
        column: 2,
        lambda: c[0],
        kappa_x: c[1],
        kappa_y: c[2],
        epsilon: c[3],
        delta: c[4],
        sigma: c[5],
        kappa_s: c[6],
        n,
        r,
        b,
        i_ya,
    });
    let e = v.channel("e1", Order::Position, &[(0, 1.0)]);
    e.inputs = vec![(2, -1.0), (4, -r)];
    e.rail = Some(0);
    v.channel("ay1", Order::Acceleration, &[(0, 1.0)]);
    v.channel("psi1", Order::Position, &[(1, 1.0)]);
    v
}

pub const RIG: [&str; 5] =
    ["vehicle.rig.mass", "vehicle.rig.stiffness", "vehicle.rig.damping", "vehicle.rig.gain", "vehicle.rig.input"];

/// One mass on a test bench: m z'' + c z' + k z + effects = gain u; input 0 force, 1 base displacement,
/// 2 base acceleration. With a moving base the co-ordinate is the deflection, which the suspension feels.
fn rig(p: &[f64]) -> Assembly {
    let [m, k, c, gain, input] = p.try_into().expect("five numbers");
    let mut v = Assembly::of(&[("z", m)]);
    v.spring(&[(0, 1.0)], k);
    v.damper(&[(0, 1.0)], c);
    v.port("rig", 0, &[(0, 1.0)], k, c);
    // columns: 2 u, 3 u', 4 u''
    v.inputs.push(match input as u8 {
        0 => (0, 2, gain),
        1 => (0, 4, -m * gain),
        _ => (0, 2, -m * gain),
    });
    for (name, order, column) in [("z", Order::Position, 2), ("vz", Order::Velocity, 3), ("az", Order::Acceleration, 4)]
    {
        let channel = v.channel(name, order, &[(0, 1.0)]);
        if input as u8 == 1 {
            channel.inputs = vec![(column, gain)];
        }
    }
    v.limit = 1e12;
    v
}
