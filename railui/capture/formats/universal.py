"""Universal file format, data set 58: time histories of modal test systems."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.capture.formats.time_base import Series, merge_series
from railui.capture.processing.recording import Recording

DATA_SET = 58
TIME_RESPONSE = 1
AXIS_FIELD_PARTS = ("spec_data_type", "len_unit_exp", "force_unit_exp", "temp_unit_exp")
AXIS_FIELDS = [f"{axis}_{part}" for axis in ("abscissa", "ordinate", "orddenom", "z_axis") for part in AXIS_FIELD_PARTS]
NUMBER_FIELDS = (*AXIS_FIELDS, "ver_num", "load_case_id", "z_axis_value", "num_pts")
TEXT_FIELDS = ("id2", "id3", "id4", "id5", "orddenom_axis_units_lab", "z_axis_axis_units_lab")
DIRECTIONS = {1: "+x", -1: "-x", 2: "+y", -2: "-y", 3: "+z", -3: "-z", 4: "+rx", 5: "+ry", 6: "+rz"}


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read every time response; its name is the first line of its header, else node and direction."""
    import pyuff

    sets: Any = pyuff.UFF(str(path)).read_sets()
    series = []
    for data in sets if isinstance(sets, list) else [sets]:
        if data.get("type") != DATA_SET or data.get("func_type") != TIME_RESPONSE:
            continue
        values = np.real(np.asarray(data["data"])).astype(float)
        title = str(data.get("id1", "")).strip()
        point = f"node{data.get('rsp_node', 0)}{DIRECTIONS.get(int(data.get('rsp_dir', 0)), '')}"
        unit = str(data.get("ordinate_axis_units_lab", "")).strip()
        name = title if title and title.upper() != "NONE" else point
        series.append(
            Series(name, unit if unit.upper() != "NONE" and unit else None, np.asarray(data["x"], float), values)
        )
    return [merge_series(path, series)]


def write(path: Path, recording: Recording) -> None:
    """Write one data set 58 per channel."""
    import pyuff

    path.unlink(missing_ok=True)
    sets = []
    for i, (name, x) in enumerate(recording.channels.items(), 1):
        data = pyuff.prepare_58(
            func_type=TIME_RESPONSE, rsp_node=i, rsp_dir=2, ref_dir=0, ref_node=0, data=x, x=recording.t, id1=name,
            ord_data_type=4, abscissa_spacing=1, abscissa_min=float(recording.t[0]), abscissa_inc=recording.interval,
            binary=0, rsp_ent_name="NONE", ref_ent_name="NONE",
            abscissa_axis_units_lab="s", ordinate_axis_units_lab=recording.units.get(name) or "NONE",
        )  # fmt: skip
        # pyuff also writes the fields that are not given, and requires numbers there
        full = dict.fromkeys(NUMBER_FIELDS, 0) | dict.fromkeys(TEXT_FIELDS, "NONE") | data
        sets.append(full)
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
