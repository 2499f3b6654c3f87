"""A rig of one mass, simulated by scipy: the data of a scientist who has arrays and no files."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy import signal

MASS, STIFFNESS, DAMPING = 95.0, 40e3, 300.0  # kg, N/m, N*s/m
DECLARED = {"mass": MASS, "gain": 1.0, "stiffness": 30e3, "damping": 500.0, "preload": 0.0}
NOISE = 2e-5  # m
UNITS = {"u": "N", "z": "m"}
FINE = 10  # steps of the simulation per sample, between which scipy interpolates the force linearly


def arrays(seed: int, seconds: float = 30.0, rate: float = 200.0) -> dict[str, Any]:
    """Return t [s], u [N] and z [m]: a random force up to 15 Hz on the mass, z with white noise."""
    random = np.random.default_rng(seed)
    t = np.arange(round(seconds * rate) * FINE) / (rate * FINE)
    low_pass = signal.butter(4, 15.0, fs=rate * FINE, output="sos")
    u = 2000.0 * signal.sosfilt(low_pass, random.standard_normal(t.size))
    _, z, _ = signal.lsim(signal.lti([1.0], [MASS, DAMPING, STIFFNESS]), u, t)
    t, u, z = (x[::FINE] for x in (t, u, z))
    return {"t": t, "u": u, "z": z + NOISE * random.standard_normal(t.size)}
