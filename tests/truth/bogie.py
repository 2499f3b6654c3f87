"""Bogie with six degrees of freedom, wheel by wheel: equations (3.1)-(3.10) of Broersen, Delft 1976.

Inside, the state of a vehicle is y, psi, y1, y2, psi1, psi2, their rates, then what its effects carry; arrays
run [wheelset, vehicle].
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields

import numpy as np
from numpy.typing import NDArray

from tests.truth.contact import Contact, Seen
from tests.truth.effects import Effect, check_together
from tests.truth.laws import Array
from tests.truth.placed import Group, contact_fields, grouped
from tests.truth.road import WIDTH, Point

Pair = tuple[float, float]
ORDER = [0, 1, 2, 4, 3, 5]  # from the model's y, psi, y1, psi1, y2, psi2 to the order inside, and back
ROWS = {
    "frame": slice(0, 1),
    "frame_yaw": slice(1, 2),
    "wheelset": slice(2, 4),
    "wheelset_yaw": slice(4, 6),
    "linkage": slice(4, 6),
}  # outer forces among the generalised ones
SINGLE = ("secondary_lateral", "secondary_yaw", "frame", "frame_yaw", "linkage")  # places of one row


@dataclass(frozen=True)
class Vehicle:
    """A bogie in SI units under the letters of the thesis; pairs are (leading, trailing)."""

    m_b: float = 2900.0
    I_zb: float = 3300.0
    m_a: float = 1850.0
    I_za: float = 1050.0
    I_ya: float = 120.0
    a: float = 1.28
    b: float = 0.75
    b_c: float = 1.0
    r: float = 0.46
    N: float = 55e3
    c_y: float = 3.0e6
    c_x: float = 8.0e6
    c_sy: float = 0.0
    c_spsi: float = 0.0
    k_y: float = 3.0e4
    k_psi: float = 3.0e4
    lam: Pair = (0.18, 0.18)
    kappa_x: Pair = (130.0, 130.0)
    kappa_y: Pair = (120.0, 120.0)
    epsilon: Pair = (8.0, 8.0)
    delta: Pair = (0.05, 0.05)
    sigma: Pair = (0.05, 0.05)
    kappa_s: float = 0.25
    clearance: float = 7.0e-3

    def declared(self, place: str) -> Pair:
        """Spring and damper of the declaration at a place [N/m, N*s/m; at a yaw N*m/rad, N*m*s/rad]."""
        return {
            "primary_lateral": (2.0 * self.c_y, 0.0),
            "primary_yaw": (2.0 * self.c_x * self.b_c**2, 0.0),
            "secondary_lateral": (self.c_sy, self.k_y),
            "secondary_yaw": (self.c_spsi, self.k_psi),
        }.get(place, (0.0, 0.0))


CHECK = Vehicle()  # the vehicle of the check values


class Bogie:
    """A batch of bogies, each with its own numbers and effects.

    `drives` names per vehicle the measured coach forces ("y", "psi", "y psi") that stand for its secondary.
    """

    def __init__(
        self,
        vehicles: Sequence[Vehicle],
        effects: Sequence[Sequence[Effect]] | None = None,
        drives: Sequence[str] | None = None,
    ) -> None:
        n = len(vehicles)
        batch = [list(e) for e in effects] if effects is not None else [[] for _ in range(n)]
        for one in batch:
            check_together(one)
        values = {f.name: np.array([getattr(v, f.name) for v in vehicles], float).T for f in fields(Vehicle)}
        at = {name: np.ascontiguousarray(np.broadcast_to(x, (2, n))) for name, x in values.items()}
        self.vehicles, self.count = tuple(vehicles), n
        self.contact = Contact(at, contact_fields(batch, values["clearance"]))
        self.a = at["a"][0]
        self.arms = np.stack([self.a, -self.a])
        self.k_lateral, self.k_yaw = -2.0 * at["c_y"], -2.0 * at["c_x"] * at["b_c"] ** 2  # signs: F = k z
        self.gyro = at["I_ya"] * at["sigma"] / (at["b"] * at["r"])  # G_i = I_ya V sigma_i/(b r)
        self.inertia = np.stack([at["m_b"][0], at["I_zb"][0], *at["m_a"], *at["I_za"]])
        self.k_sec = -np.stack([at["c_sy"][0], at["c_spsi"][0]])
        self.c_sec = -np.stack([at["k_y"][0], at["k_psi"][0]])
        self._add_coaches(batch)
        words = [d.split() for d in drives or [""] * n]
        self.own = np.array([[float("y" not in w) for w in words], [float("psi" not in w) for w in words]])
        self.driven = bool((self.own == 0.0).any())
        self.groups = grouped(batch, lambda k, place: vehicles[k].declared(place))
        self._lay_out()

    def _add_coaches(self, batch: Sequence[Sequence[Effect]]) -> None:
        """A coach that moves brings its own spring and damper in place of the declared ones."""
        self.coach_mass = np.full(self.count, np.inf)
        for k, effects in enumerate(batch):
            for p in (e.parameters for e in effects if e.kind == "coach_mode"):
                self.coach_mass[k] = p["mass"]
                self.k_sec[0, k], self.c_sec[0, k] = -p["stiffness"], -p["damping"]
        self.coached = bool(np.isfinite(self.coach_mass).any())

    def _lay_out(self) -> None:
        """Rows of the state: 12 motions, rails u_1 u_2, coach y_c y_c', then the states of each group."""
        end = 12
        self.rails = slice(end, end := end + 2 * self.contact.yields)
        self.coach = slice(end, end := end + 2 * self.coached)
        for g in self.groups:
            states, rows, _ = g.shape
            g.states = slice(end, end := end + states * rows)
        self.size = end

    def motion(self, place: str, q: Array, coach: Array | float = 0.0) -> Array:
        """Motion (of rates: rate) at a place [row, vehicle]."""
        result: Array
        if place == "primary_lateral":
            result = q[2:4] - q[0] - self.arms * q[1]
            return result
        if place == "primary_yaw":
            result = q[4:6] - q[1]
            return result
        if place == "linkage":
            return q[4:5] + q[5:6]
        if place == "secondary_lateral":
            return q[0:1] - coach
        return q[1:2] if place == "secondary_yaw" else q[ROWS[place]]

    def forces(self, x: Array, p: Point) -> tuple[Array, Array, Array]:
        """Generalised forces [6, vehicle], rates of the effects' states, coach's forces on the frame [2]."""
        q, v = x[:6], x[6:12]
        y_c, v_c = x[self.coach] if self.coached else (0.0, 0.0)

        # how the wheelsets stand between the rails: e = y - y_w - r phi_w - u
        u = x[self.rails] if self.contact.yields else None
        e = q[2:4] - p.rest
        e = e if u is None else e - u
        w = Seen(e, v[2:4] - p.restd, v[2:4], q[4:6], v[4:6], u)

        # forces by place, the suspension (3.1) first, then the effects
        lateral, yaw = self.motion("primary_lateral", q), self.motion("primary_yaw", q)
        at = {"primary_lateral": self.k_lateral * lateral, "primary_yaw": self.k_yaw * yaw}
        sec = self.k_sec * q[0:2] + self.c_sec * v[0:2]
        if self.coached:
            sec[0] -= self.k_sec[0] * y_c + self.c_sec[0] * v_c
        at["secondary_lateral"], at["secondary_yaw"] = sec[0:1], sec[1:2]
        at["contact"] = self.contact.flange(e) if self.contact.flanges else np.zeros((2, self.count))
        known = {("primary_lateral", False): lateral, ("primary_yaw", False): yaw}
        known["contact", False], known["contact", True] = e, w.ed
        inner = np.zeros((self.size - 12, self.count))

        def look(place: str, rates: bool) -> Array:
            if (place, rates) not in known:
                known[place, rates] = self.motion(place, v if rates else q, v_c if rates else y_c)
            return known[place, rates]

        for g in self.groups:
            self._act(g, x, p, look, at, inner)

        # rails (3.9), gyroscopic couple (3.1), and what a moving coach and yielding rails do
        Q_y, Q_psi, ud = self.contact.forces(w, p, at["contact"])
        if ud is not None:
            inner[0:2] = ud
        if self.coached:
            inner[self.coach.start - 12], inner[self.coach.start - 11] = v_c, -sec[0] / self.coach_mass
        if self.driven:  # a measured coach force is the whole of it
            sec = self.own * sec + p.Q
        G = self.gyro * p.V
        F = np.empty((6, self.count))
        lateral, yaw = at["primary_lateral"], at["primary_yaw"]
        F[0] = sec[0] - lateral[0] - lateral[1]
        F[1] = sec[1] - self.a * (lateral[0] - lateral[1]) - yaw[0] - yaw[1]
        F[2:4] = lateral + Q_y + at["contact"] + G * w.psid
        F[4:6] = yaw + Q_psi - G * w.yd
        for place in at.keys() & ROWS.keys():
            F[ROWS[place]] += at[place]
        return F, inner, sec

    def _act(
        self,
        g: Group,
        x: Array,
        p: Point,
        look: Callable[[str, bool], Array],
        at: dict[str, Array],
        inner: Array,
    ) -> None:
        """One group of effects: adds its forces by place, and the rates of its states."""
        who = g.vehicles
        states = x[g.states][:, who].reshape(g.shape)
        parameters = {**g.p, "s": p.s[who]}

        def rows(place: str) -> slice:
            return slice(0, 1) if place in SINGLE else g.rows

        def push(place: str, force: Array) -> None:
            if place not in at:
                at[place] = np.zeros((1 if place in SINGLE else 2, self.count))
            at[place][rows(place), who] += force

        def z(place: str) -> Array:
            return look(place, False)[rows(place)][:, who]

        def v(place: str) -> Array:
            return look(place, True)[rows(place)][:, who]

        rate = None
        if g.kind.law is not None:
            motion = z(g.at)
            force, rate = g.kind.law(parameters, motion, v(g.at) if g.kind.rates else motion, states, p.t)
            push(g.at, force)
        elif g.kind.many is not None:
            rate = g.kind.many(parameters, z, v, push, states, p.t)
        if rate is not None:
            inner[g.states.start - 12 : g.states.stop - 12, who] = rate.reshape(-1, rate.shape[-1])

    def rate(self, x: Array, p: Point) -> Array:
        """Rate of change of the state [row, vehicle]."""
        F, inner, _ = self.forces(x, p)
        return np.concatenate([x[6:12], F / self.inertia, inner])

    def settle(self, x: Array) -> None:
        """Holds what must not overshoot within a step: a blown-off damper at its limit."""
        for g in (g for g in self.groups if "blow_off" in g.p):
            limit, part = g.p["blow_off"], x[g.states][:, g.vehicles]
            x[g.states, g.vehicles] = np.minimum(np.maximum(part, -limit), limit)

    def jacobian(self, V: float | Array, x: Array | None = None) -> Array:
        """Derivative of the rate after the state on level track [vehicle, row, row], by differences."""
        row = np.zeros((WIDTH, self.count))
        row[10:12] = V
        here, p = np.zeros((self.size, self.count)) if x is None else x, Point(0.0, row)
        columns = []
        for k in range(self.size):
            up, down = here.copy(), here.copy()
            up[k] += 1e-7
            down[k] -= 1e-7
            columns.append((self.rate(up, p) - self.rate(down, p)) / 2e-7)
        return np.transpose(np.stack(columns), (2, 1, 0))

    def eigenvalues(self, V: float | Array) -> NDArray[np.complex128]:
        """Eigenvalues of small motions at rest [vehicle, row], 1/s."""
        return np.linalg.eigvals(self.jacobian(V)).astype(complex)
