"""Wheel on rail: rolling radii, contact angles, creepages and creep forces, (3.2)-(3.5) and (3.8), per wheel.

Arrays run [wheelset, vehicle]; the wheels of a wheelset are two names, 1 on the right and 2 on the left.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tests.truth.laws import Array, beyond, creep_forces, saturation, saturation_slope
from tests.truth.road import Point


class Seen(NamedTuple):
    """Position of a wheelset relative to its rails: e and e' (without u'), y', psi, psi', and the rail's own u."""

    e: Array
    ed: Array
    yd: Array
    psi: Array
    psid: Array
    u: Array | None


class Contact:
    """The contact chain of a batch; `letters` are the vehicle's, `effects` come from contact_fields."""

    def __init__(self, letters: Mapping[str, Array], effects: Mapping[str, Array]) -> None:
        self.b, self.r, self.N, self.delta, self.lam = (letters[x] for x in ("b", "r", "N", "delta", "lam"))
        self.creep = tuple(letters[x] * self.N for x in ("kappa_x", "kappa_y", "kappa_s"))
        self.eb, self.sb = letters["epsilon"] / self.b, letters["sigma"] / self.b
        self.behind = np.array([[0.0], [2.0]]) * letters["a"]  # distance from the leading wheelset
        self.c = c = dict(effects)
        self.limit = c["mu"] * self.N
        # what no vehicle of the batch has is skipped
        self.saturates = bool(np.isfinite(c["mu"]).any())
        self.flanges = bool(np.isfinite(c["h"]).any())
        self.rubs = bool((c["mu_f"] > 0.0).any())
        self.only_saturation = not (c["law"] != 0.0).any()  # creep_saturation everywhere
        self.shapes, self.lines = c.pop("shape"), c.pop("line")
        self.yields = bool(c["yields"].any())
        self.curved = any((c[name] != 0.0).any() for name in ("lam_g", "l3"))
        self.along = any((c[name] != 0.0).any() for name in ("e_0", "sway", "drift", "depth"))

    def rolling(self, e: Array, p: Point) -> Array:
        """(r_i1 - r_i2)/2 = (lambda + lambda_g g)(e - e_0)(1 + l3 (e - e_0)^2)."""
        c, lam, x = self.c, self.lam, e
        if self.along:
            s = p.s - self.behind
            lam = lam * (1.0 + c["drift"] * s / 1000.0)
            x = e - c["e_0"] - c["sway"] * np.sin(2.0 * np.pi * s / c["wavelength"] + c["phase"])
        for (row, k), line in self.lines.items():
            x = x.copy()
            x[row, k] -= np.interp(np.broadcast_to(p.s - self.behind, x.shape)[row, k], line["place"], line["offset"])
        rolled = self.shaped(x, "radius") + p.g * self.shaped(x, "radius_per_gauge", 0.0)
        if not self.curved:
            return lam * rolled
        return (lam + c["lam_g"] * p.g) * rolled * (1.0 + c["l3"] * x * x)

    def shaped(self, x: Array, curve: str, plain: float = 1.0) -> Array:
        """A curve of the profiles at x, straight beyond its ends; `plain` times x where there are none."""
        if not self.shapes:
            return plain * x
        y = plain * x
        for (row, k), curves in self.shapes.items():
            spline = curves[curve]
            inside = np.clip(x[row, k], *spline.x[[0, -1]])
            y[row, k] = spline(inside) + spline(inside, 1) * (x[row, k] - inside)
        return y

    def coefficients(self, p: Point) -> tuple[Array, ...]:
        """kappa_x N, kappa_y N, kappa_s N, smaller where patches of the rail are wet."""
        if not self.along:
            return self.creep
        s, c = p.s - self.behind, self.c
        dry = 1.0 - c["depth"] * (0.5 - 0.5 * np.cos(2.0 * np.pi * s / c["patch"]))
        return tuple(k * dry for k in self.creep)

    def flange(self, e: Array) -> Array:
        """Lateral force of the flanges on the wheelset beyond the clearance."""
        return -self.c["k_f"] * beyond(e, self.c["h"])

    def forces(self, w: Seen, p: Point, other: Array) -> tuple[Array, Array, Array | None]:
        """Q_yi, Q_psii of the rails on each wheelset, and u_i' of rails that yield to them and to `other`."""
        V, b, r, N = p.V, self.b, self.r, self.N
        kxN, kyN, ksN = self.coefficients(p)
        half, tilt, turn = self.rolling(w.e, p), self.eb * self.shaped(w.e, "angle") - p.phiw, w.psid / V
        r_1, r_2 = r + half, r - half  # (3.8)
        gamma_1, gamma_2 = self.delta + tilt, self.delta - tilt
        phi, phid = p.phiw - self.sb * w.e, p.phiwd - self.sb * w.ed

        # creep and spin (3.5)
        u_x1, u_x2 = (r - r_1) / r - b * turn, (r - r_2) / r + b * turn
        u_n1, u_n2 = (-gamma_1 - phi) / r + turn, (gamma_2 - phi) / r + turn
        u_y = (w.yd - r * phid) / V - w.psi
        T_x1, T_x2, spin_1, spin_2 = kxN * u_x1, kxN * u_x2, ksN * u_n1, ksN * u_n2

        # the wheel of the flange that presses also slides there, on a larger radius and an inclined plane
        F_x1 = F_x2 = F_y1 = F_y2 = np.zeros_like(half)
        if self.rubs:
            flange, (kx, ky) = self.flange(w.e), (kxN / N, kyN / N)
            F_x1, F_y1 = self.rub(np.maximum(-flange, 0.0), kx * (u_x1 - self.c["d"] / r), ky * u_y)
            F_x2, F_y2 = self.rub(np.maximum(flange, 0.0), kx * (u_x2 - self.c["d"] / r), ky * u_y)

        # the rail's u' takes (1 + r sigma/b) u'/V off the lateral creep: through y' - u' and through phi'
        ud = None
        if w.u is not None:
            share = (1.0 + r * self.sb) / V
            still = other - N * (gamma_1 - gamma_2) - F_y1 - F_y2 + self.c["k_r"] * w.u
            ud = self.rail(still, ((T_x1, u_x1, spin_1), (T_x2, u_x2, spin_2)), kyN, u_y, share, V)
            u_y = u_y - share * ud

        # creep forces (3.2)-(3.4), saturated together
        T_y1, T_y2 = kyN * u_y + spin_1, kyN * u_y + spin_2
        if self.saturates:
            T_x1, T_y1 = creep_forces(self.c, N, T_x1, T_y1, spin_1, V * np.hypot(u_x1, u_y))
            T_x2, T_y2 = creep_forces(self.c, N, T_x2, T_y2, spin_2, V * np.hypot(u_x2, u_y))
        Y_1, Y_2 = N * gamma_1 + T_y1 + F_y1, -N * gamma_2 + T_y2 + F_y2
        return -Y_1 - Y_2, b * (T_x1 + F_x1 - T_x2 - F_x2) + b * w.psi * (Y_1 - Y_2), ud

    def rub(self, lateral: Array, along: Array, across: Array) -> tuple[Array, Array]:
        """Forces on the rail, along it and across, of a flange that presses with a lateral force.

        `along`, `across`: linear creep forces per unit of load, across before the division by cos gamma.
        """
        mu, gamma = np.maximum(self.c["mu_f"], 1e-9), self.c["gamma"]
        load, inclined = lateral / np.sin(gamma), across / np.cos(gamma)
        f = load * saturation(np.hypot(along, inclined) / mu) * (self.c["mu_f"] > 0.0)
        return f * along, f * inclined * np.cos(gamma)

    def rail(
        self,
        still: Array,
        wheels: tuple[tuple[Array, Array, Array], ...],
        kyN: Array,
        u_y: Array,
        share: Array,
        V: float | Array,
    ) -> Array:
        """u' from k_r u + c_r u' + Q_y(u') + flange = 0; `still` is all of it that does not know u'.

        Newton's steps are kept between 0 and the root for a slope of c_r/2: creep forces may fall with the creepage.
        """
        c_r = self.c["c_r"]
        steepest = 2.0 * kyN * share

        def force(ud: Array) -> tuple[Array, Array]:
            total, slope = still + c_r * ud, c_r
            for T_x, u_x, spin in wheels:
                across = u_y - share * ud
                T_y = kyN * across + spin
                if not self.only_saturation:
                    nudge = 1e-6
                    there = [
                        creep_forces(self.c, self.N, T_x, kyN * v + spin, spin, V * np.hypot(u_x, v))[1]
                        for v in (across, across - share * nudge)
                    ]
                    total, slope = total - there[0], slope + (there[0] - there[1]) / nudge
                    continue
                if not self.saturates:
                    total, slope = total - T_y, slope + kyN * share
                    continue
                T = np.maximum(np.sqrt(T_x * T_x + T_y * T_y), 1e-300)
                f = saturation(T / self.limit)
                bend = saturation_slope(T / self.limit) * T_y * T_y / (T * self.limit)
                total, slope = total - f * T_y, slope + (f + bend) * kyN * share
            return total, slope

        at_rest, _ = force(np.zeros_like(still))
        ud, far = -at_rest / (c_r + steepest), -2.0 * at_rest / np.maximum(c_r, 1e-9 * steepest)
        low, high = np.minimum(0.0, far), np.maximum(0.0, far)
        for _ in range(60 if self.saturates else 0):
            total, slope = force(ud)
            low, high = np.where(total < 0.0, ud, low), np.where(total > 0.0, ud, high)
            step = ud - total / slope
            step = np.where((step < low) | (step > high), 0.5 * (low + high), step)
            if (np.abs(step - ud) <= 1e-13 * (np.abs(step) + 1e-6)).all():
                break
            ud = step
        return ud * self.c["yields"]
