//! Bodies and elements to matrices, rows and ports.
use crate::effects::Law;
use crate::effects::effect::Site;
use crate::error::{Error, Result};
use crate::wheel_rail::coefficients::Wheelset;
use nalgebra::DMatrix;
use std::borrow::Cow;

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

/// A name, without a copy where it is that of a built-in kind.
pub type Name = Cow<'static, str>;

/// A named location of effects.
#[derive(Clone, Debug)]
pub struct Port {
    pub at: Name,
    /// The place of the catalogue that it is one of.
    pub class: &'static str,
    /// 0: the place belongs to no single wheelset.
    pub wheelset: u8,
    pub row: Row,
    pub inputs: Inputs,
    /// The row through which the force returns, where it is not the row of the motion.
    pub reaction: Option<Row>,
    pub site: Site,
}

impl Port {
    fn channel_name(&self, letter: &str) -> String {
        if self.wheelset == LINKAGE {
            return format!("{letter}.{}.linkage", self.at);
        }
        format!("{letter}.{}.{}", self.at, self.wheelset)
    }

    /// The motion here as a channel without a name.
    pub fn motion(&self, order: Order) -> Channel {
        let mut channel = Channel::new("", order, &self.row);
        if order == Order::Position {
            channel.inputs = self.inputs.clone();
        } else {
            channel.rates = self.inputs.iter().map(|(column, factor)| (column + 1, *factor)).collect();
        }
        channel
    }
}

/// A law that belongs to the vehicle itself: a stop, a spring and a damper in series.
#[derive(Clone, Debug)]
pub struct OwnLaw {
    pub law: Law,
    pub row: Row,
    pub inputs: Inputs,
    pub numbers: Vec<f64>,
}

/// Derivative of a row that a channel shows: position, velocity or acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Order {
    Position,
    Velocity,
    Acceleration,
}

/// A measured or wanted signal: a row of the motion plus columns of the input table.
#[derive(Clone, Debug)]
pub struct Channel {
    pub name: Name,
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

impl Channel {
    /// The motion of a row alone.
    pub fn new(name: impl Into<Name>, order: Order, row: &[(usize, f64)]) -> Self {
        let (also, inputs, rates) = (Vec::new(), Inputs::new(), Inputs::new());
        Channel { name: name.into(), order, row: row.to_vec(), also, inputs, rates, rail: None }
    }
}

/// One vehicle: M q'' + C q' + K q = E u(t), wheelsets, ports, channels. M is diagonal: bodies are
/// described at their centres of mass.
#[derive(Clone, Debug)]
pub struct Assembly {
    pub dofs: Vec<Name>,
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
    /// Contribution of the load transfer to the guiding force of every wheelset; empty where nothing rolls.
    pub leaning: Vec<Channel>,
    /// Beyond these the run counts as diverged: abs(e_i) and abs(psi_i), or abs(q) where there is no wheelset.
    pub limit: f64,
    /// Distance of the positions of a line with curves behind the first wheelset [m]; empty on straight track.
    pub positions: Vec<f64>,
}

impl Assembly {
    /// Bodies alone, by name and mass: no springs, no ports yet.
    pub fn of<N: Into<Name>>(masses: Vec<(N, f64)>) -> Self {
        let n = masses.len();
        let (dofs, mass) = masses.into_iter().map(|(name, mass)| (name.into(), mass)).unzip();
        Assembly {
            dofs,
            mass,
            stiffness: DMatrix::zeros(n, n),
            damping: DMatrix::zeros(n, n),
            wheelsets: Vec::new(),
            ports: Vec::new(),
            inputs: Vec::new(),
            rates: Vec::new(),
            laws: Vec::new(),
            channels: Vec::new(),
            leaning: Vec::new(),
            limit: 0.1,
            positions: Vec::new(),
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
        Err(Error::VehicleNumber { what: format!("mass of {}", self.dofs[i]), value: self.mass[i], rule: "positive" })
    }

    /// A spring between the bodies of a row.
    pub fn spring(&mut self, row: &[(usize, f64)], stiffness: f64) {
        Self::element(&mut self.stiffness, row, stiffness);
    }

    /// A viscous damper between the bodies of a row.
    pub fn damper(&mut self, row: &[(usize, f64)], damping: f64) {
        Self::element(&mut self.damping, row, damping);
    }

    /// A port with the linear spring and damper at the same location.
    pub fn port(&mut self, at: &'static str, wheelset: u8, row: &[(usize, f64)], stiffness: f64, damping: f64) {
        let site = Site::moving(at, stiffness, damping);
        let (row, inputs) = (row.to_vec(), Inputs::new());
        self.ports.push(Port { at: at.into(), class: at, wheelset, row, inputs, reaction: None, site });
    }

    /// A further signal of the motion of a row.
    pub fn channel(&mut self, name: impl Into<Name>, order: Order, row: &[(usize, f64)]) -> &mut Channel {
        self.channels.push(Channel::new(name, order, row));
        self.channels.last_mut().expect("just pushed")
    }

    /// Names of all channels; the last are those of the motion at every port, `z.PLACE.WHEELSET` and `v.PLACE.WHEELSET`.
    pub fn channel_names(&self) -> Vec<String> {
        let own = self.channels.iter().map(|channel| channel.name.to_string());
        own.chain(self.ports.iter().flat_map(|port| ["z", "v"].map(|letter| port.channel_name(letter)))).collect()
    }

    /// The port and the order of a channel of the motion there.
    pub fn port_channel(&self, name: &str) -> Option<(usize, Order)> {
        let (letter, _) = name.split_once('.')?;
        let order = match letter {
            "z" => Order::Position,
            "v" => Order::Velocity,
            _ => return None,
        };
        Some((self.ports.iter().position(|port| port.channel_name(letter) == name)?, order))
    }

    /// The ports of a place: of one wheelset, or with 0 of every wheelset.
    pub fn places(&self, at: &str, wheelset: u8) -> Vec<&Port> {
        self.ports
            .iter()
            .filter(|p| p.at == at && (p.wheelset == wheelset || (wheelset == 0 && p.wheelset != LINKAGE)))
            .collect()
    }

    /// A body of mass, spring and damper behind a port, in the place of the declared terms there; with amount alpha the port
    /// feels alpha of it and (1 - alpha) of the declared terms. It is the co-ordinate `y_c`: that of the coach.
    pub fn add_body(&mut self, at: &str, alpha: f64, [mass, k, c]: [f64; 3]) {
        let Some(place) = self.ports.iter().position(|p| p.at == at) else {
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
    }

    /// State matrix of x = [q, q', states of own laws] at a speed, with further symmetric terms at ports: (port row, k, c).
    pub fn state_matrix(&self, speed: f64, more: &[Term<'_>]) -> DMatrix<f64> {
        let n = self.dofs.len();
        let (mut k, mut c) = (self.stiffness.clone(), self.damping.clone());
        for w in &self.wheelsets {
            for (i, [by_y, by_psi, by_vy, by_vpsi]) in [w.y, w.psi].into_iter().zip(w.force_slopes(speed)) {
                for (j, per_motion, per_rate) in [(w.y, by_y, by_vy), (w.psi, by_psi, by_vpsi)] {
                    k[(i, j)] -= per_motion;
                    c[(i, j)] -= per_rate;
                }
            }
        }
        for (row, stiffness, damping) in more {
            Self::element(&mut k, row, *stiffness);
            Self::element(&mut c, row, *damping);
        }
        let own: Vec<_> = self.laws.iter().filter(|own| own.law.record().states > 0).collect();
        let mut a = DMatrix::zeros(2 * n + own.len(), 2 * n + own.len());
        for i in 0..n {
            a[(i, n + i)] = 1.0;
            for j in 0..n {
                a[(n + i, j)] = -k[(i, j)] / self.mass[i];
                a[(n + i, n + j)] = -c[(i, j)] / self.mass[i];
            }
        }
        for (at, own) in own.iter().enumerate() {
            let (state, [force, rate]) = (2 * n + at, own.law.slopes_at_rest(&own.numbers));
            for (first, by_force, by_rate) in [(0, force.z, rate.z), (n, force.v, rate.v)] {
                for &(j, share) in &own.row {
                    own.row.iter().for_each(|&(i, arm)| a[(n + i, first + j)] += arm * by_force * share / self.mass[i]);
                    a[(state, first + j)] += by_rate * share;
                }
            }
            own.row.iter().for_each(|&(i, arm)| a[(n + i, state)] += arm * force.x / self.mass[i]);
            a[(state, state)] = rate.x;
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

/// Upper bound of the magnitude of the eigenvalues of a real matrix: the smaller of two norms of the balanced matrix.
pub fn radius_bound(mut a: DMatrix<f64>) -> f64 {
    nalgebra::linalg::balancing::balance_parlett_reinsch(&mut a);
    let largest = |sums: Vec<f64>| sums.into_iter().fold(0.0, f64::max);
    let rows = largest(a.row_iter().map(|row| row.iter().map(|x| x.abs()).sum()).collect());
    let columns = largest(a.column_iter().map(|column| column.iter().map(|x| x.abs()).sum()).collect());
    rows.min(columns)
}
