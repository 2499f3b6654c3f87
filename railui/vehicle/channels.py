"""Channels of a vehicle and their units."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Final

from railui.io.problems import suggest_name
from railui.runs.columns import COLUMNS
from railui.vehicle.effects import ROTATION_SUFFIXES
from railui.vehicle.model import Model

# by the first word of a name without its number; numbered names as in a run: e3, ay4, psi2
UNITS: Final = {
    **{"e": "m", "d": "m", "y": "m", "ay": "m/s^2", "ayf": "m/s^2", "floor": "m/s^2"},
    **{"psi": "rad", "phi": "rad", "rf": "rad/s", "apsi": "rad/s^2", "aphi": "rad/s^2"},
    **{"Y": "N", "Q": "N", "dQ": "N"},
}
LOCAL_MOTIONS: Final = {"z": ("m", "rad"), "v": ("m/s", "rad/s")}  # of a displacement, of a rotation


def channel_unit(name: str) -> str:
    """Return the SI unit of a channel of a vehicle.

    Raises
    ------
    ValueError
        For a name that is not of a channel.

    Examples
    --------
    >>> channel_unit("e3"), channel_unit("v.primary_yaw.1"), channel_unit("Y1.right"), channel_unit("apsi.body")
    ('m', 'rad/s', 'N', 'rad/s^2')
    """
    if name in COLUMNS:
        return COLUMNS[name].unit
    quantity, _, rest = name.partition(".")
    if quantity in LOCAL_MOTIONS and rest:
        return LOCAL_MOTIONS[quantity][rest.rpartition(".")[0].endswith(ROTATION_SUFFIXES)]
    word = re.sub(r"\d+\Z", "", quantity)
    if word not in UNITS:
        raise ValueError(f"{name!r} is not a channel of a vehicle")
    return UNITS[word]


def all_channels(model: Model) -> list[str]:
    """Return the channels of a vehicle, the guiding forces of its wheelsets (Y1) and wheels (Y1.right) last."""
    names = model.vehicles().channel_names(model.single_batch())
    wheelsets = range(1, len(model.wheelset_distances()) + 1) if model.design.kind != "rig" else ()
    return [*names, *(f"Y{i}{side}" for i in wheelsets for side in ("", ".right", ".left"))]


def check_channels(model: Model, names: Sequence[str]) -> None:
    """Raise ValueError, with the nearest known name, for a channel that the vehicle does not have."""
    known = all_channels(model)
    for name in names:
        if name not in known:
            raise ValueError(f"no channel {name!r}, {suggest_name(name, known)}")
