"""Universal file format, data set 58: time histories of modal test systems."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.capture.formats.clocks import Series, one_clock
from railui.capture.processing.recording import Recording

TIME_RESPONSE = 1
PARTS = ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
OF_AXES = [f"{axis}_{part}" for axis in ("abscissa", "ordinate", "orddenom", "z_axis") for part in PARTS]
NUMBERS = (*OF_AXES, "ver_num", "load_case_id", "z_axis_value", "num_pts")
TEXTS = ("id2", "id3", "id4", "id5", "orddenom_axis_units_lab", "z_axis_axis_units_lab")
DIRECTIONS = {1: "+x", -1: "-x", 2: "+y", -2: "-y", 3: "+z", -3: "-z", 4: "+rx", 5: "+ry", 6: "+rz"}


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Every time response; its name is the first line of its header, else node and direction."""
    import pyuff

    sets: Any = pyuff.UFF(str(path)).read_sets()
    series = []
    for one in sets if isinstance(sets, list) else [sets]:
        if one.get("type") != 58 or one.get("func_type") != TIME_RESPONSE:
            continue
        values = np.real(np.asarray(one["data"])).astype(float)
        named = str(one.get("id1", "")).strip()
        place = f"node{one.get('rsp_node', 0)}{DIRECTIONS.get(int(one.get('rsp_dir', 0)), '')}"
        unit = str(one.get("ordinate_axis_units_lab", "")).strip()
        name = named if named and named.upper() != "NONE" else place
        series.append(
            Series(name, unit if unit.upper() != "NONE" and unit else None, np.asarray(one["x"], float), values)
        )
    return [one_clock(path, series)]


def write(path: Path, recording: Recording) -> None:
    """One data set 58 per channel."""
    import pyuff

    path.unlink(missing_ok=True)
    sets = []
    for i, (name, x) in enumerate(recording.channels.items(), 1):
        one = pyuff.prepare_58(
            func_type=TIME_RESPONSE, rsp_node=i, rsp_dir=2, ref_dir=0, ref_node=0, data=x, x=recording.t, id1=name,
            ord_data_type=4, abscissa_spacing=1, abscissa_min=float(recording.t[0]), abscissa_inc=recording.interval,
            binary=0, rsp_ent_name="NONE", ref_ent_name="NONE",
            abscissa_axis_units_lab="s", ordinate_axis_units_lab=recording.units.get(name) or "NONE",
        )  # fmt: skip
        # pyuff writes the fields that were not given too, and asks for numbers there
        full = dict.fromkeys(NUMBERS, 0) | dict.fromkeys(TEXTS, "NONE") | one
        sets.append(full)
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
