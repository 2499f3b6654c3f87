"""Universal file format, data set 58: time histories of modal test systems."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from railui.arrays import FloatArray
from railui.capture.formats.clocks import axis_factor
from railui.capture.formats.time_base import Series, merge_series
from railui.capture.processing.recording import Recording

DATA_SET = 58
NAME_WIDTH, UNIT_WIDTH = 80, 20  # characters of the fields
MAX_TIME_ERROR = 1e-9  # s
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
        point = f"node{data.get('rsp_node', 0)}{DIRECTIONS.get(int(data.get('rsp_dir', 0)), '')}"
        name = _label(data, "id1") or point
        factor = axis_factor(path, f"abscissa of {name}", _label(data, "abscissa_axis_units_lab"), "s")
        t = np.asarray(data["x"], float) * factor
        series.append(Series(name, _label(data, "ordinate_axis_units_lab"), t, values))
    return [merge_series(path, series)]


def _label(data: dict[str, Any], field: str) -> str | None:
    """Return a text field, None if it is empty or NONE."""
    text = str(data.get(field, "")).strip()
    return text if text and text.upper() != "NONE" else None


def write(path: Path, recording: Recording) -> None:
    """Write one binary data set 58 per channel; time stamps that six digits of an interval cannot give one by one.

    Raises
    ------
    ValueError
        If the recording is one against distance, or a name or unit is longer than its field.
    """
    import pyuff

    if recording.abscissa != "t":
        raise ValueError("a time response cannot hold rows against distance: write .h5, .mat or .csv")
    path.unlink(missing_ok=True)
    is_even = _has_exact_interval(recording.t)
    sets = []
    for i, (name, x) in enumerate(recording.columns().items()):
        if name == recording.abscissa:
            continue
        unit = recording.unit(name) or "NONE"
        if len(name) > NAME_WIDTH or len(unit) > UNIT_WIDTH:
            raise ValueError(f"{name!r} in {unit} does not fit a universal file: {NAME_WIDTH} and {UNIT_WIDTH} letters")
        data = pyuff.prepare_58(
            func_type=TIME_RESPONSE, rsp_node=i, rsp_dir=2, ref_dir=0, ref_node=0, data=x, x=recording.t, id1=name,
            ord_data_type=4, abscissa_spacing=int(is_even), abscissa_min=float(recording.t[0]),
            abscissa_inc=float(recording.t[1] - recording.t[0]),
            binary=1, rsp_ent_name="NONE", ref_ent_name="NONE",
            abscissa_axis_units_lab="s", ordinate_axis_units_lab=unit,
        )  # fmt: skip
        # pyuff also writes the fields that are not given, and requires numbers there
        full = dict.fromkeys(NUMBER_FIELDS, 0) | dict.fromkeys(TEXT_FIELDS, "NONE") | data
        sets.append(full)
    pyuff.UFF(str(path)).write_sets(sets, mode="add")  # "overwrite" would cut off the header of a binary set


def _has_exact_interval(t: FloatArray) -> bool:
    """Return True if start and interval with six digits, as the header holds them, give the time stamps."""
    start, step = (float(f"{value:.5e}") for value in (t[0], t[1] - t[0]))
    return bool(np.max(np.abs(start + step * np.arange(t.size) - t)) < MAX_TIME_ERROR)
