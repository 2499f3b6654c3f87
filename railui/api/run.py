"""Run: measured columns, read from a file or built of arrays."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
from numpy.typing import ArrayLike

from railui.api.display import Summarised, SummaryRow, draw_on
from railui.api.units import check_unit_names
from railui.arrays import FloatArray
from railui.io.atomic import sha256
from railui.io.problems import NO_POSITION, Findings, file_problem
from railui.io.series_file import PARQUET, write_series
from railui.io.table import Table, table_text, write_table
from railui.runs.columns import RIG_FORMS, Form, columns_of
from railui.runs.run import Run as MeasuredRun
from railui.runs.run import detect_kind, load_run, run_of_table
from railui.vehicle.design import Design as VehicleDesign

if TYPE_CHECKING:
    import pandas
    import xarray
    from matplotlib.axes import Axes


@dataclass(frozen=True, eq=False)
class Run(MeasuredRun, Summarised):
    """Measured run: columns in SI with the checks of a run file.

    It is built by `load`, `from_arrays`, `from_frame` or `from_xarray`.

    Attributes
    ----------
    file : Path
        File of the run, or its name where it was built of arrays.
    columns : mapping
        Arrays [row] by name in SI (rig: in the units of the run), NaN for missing values.
    units : mapping
        Unit of each column as given.
    rate : float
        Sampling rate [Hz].
    segments : tuple of slice
        Rows without gaps or missing values.
    responses : tuple of str
        Measured motions.
    notes : tuple of str
    warnings : tuple of Problem
        Implausible values.
    table : Table or None
        The columns as given, of a run that was built of arrays.
    conditions : mapping
        Conditions of the run by name, such as {"current": "0.5 A"}.

    Examples
    --------
    >>> t = np.arange(0.0, 20.0, 0.01)
    >>> run = Run.from_arrays(t=t, u=np.sin(9.0 * t), z=1e3 * np.sin(9.0 * t - 0.5), units={"z": "mm"})
    >>> run.kind, run.responses, len(run), run.rate
    ('rig', ('z',), 2000, 100.0)
    """

    table: Table | None = field(default=None, repr=False)
    conditions: Mapping[str, str] = field(default_factory=dict)

    @classmethod
    def of(cls, run: MeasuredRun) -> Self:
        """Return a run as this class."""
        if isinstance(run, cls):
            return run
        return cls(**{item.name: getattr(run, item.name) for item in fields(MeasuredRun)})

    @classmethod
    def load(cls, path: str | Path, *, design: VehicleDesign | None = None) -> Self:
        """Read a run.

        Parameters
        ----------
        path : str or Path
        design : Design, optional
            Vehicle whose columns the run has; detected from the columns by default.

        Raises
        ------
        FileProblems
            With every problem of the file.
        """
        return cls.of(load_run(path, None if design is None else design.run_form))

    @classmethod
    def from_arrays(
        cls,
        columns: Mapping[str, ArrayLike] | None = None,
        /,
        *,
        units: Mapping[str, str] | None = None,
        name: str = "run",
        design: VehicleDesign | None = None,
        conditions: Mapping[str, Any] | None = None,
        **arrays: ArrayLike,
    ) -> Self:
        """Build a run of arrays.

        Parameters
        ----------
        columns : mapping, optional
            Arrays [row] by column name, for names that are no keywords.
        units : mapping, optional
            Units by column; by default SI, of a rig none but s of the time.
        name : str
            Name of the run in problems and reports.
        design : Design, optional
            Vehicle whose columns the run has; detected from the columns by default.
        conditions : mapping, optional
            Conditions of the run by name, such as {"current": "0.5 A"}.
        **arrays : array_like
            Arrays [row] by column name; NaN for missing values.

        Raises
        ------
        FileProblems
            With every problem, as of a run file: columns, units, sampling, implausible magnitudes.
        ValueError
            For arrays that differ in length.
        """
        given = {**(columns or {}), **arrays}
        form: Form = detect_kind(tuple(given)) if design is None else design.run_form
        table = _table(given, units, name, form)
        run = cls.of(run_of_table(table, sha256(_text(table)), form))
        return replace(run, table=table, conditions={key: str(value) for key, value in (conditions or {}).items()})

    @classmethod
    def from_frame(
        cls,
        frame: pandas.DataFrame,
        *,
        units: Mapping[str, str] | None = None,
        name: str = "run",
        design: VehicleDesign | None = None,
        conditions: Mapping[str, Any] | None = None,
    ) -> Self:
        """Build a run of the columns of a frame; t may be the index.

        Units by default as in `frame.attrs["units"]`; parameters and exceptions as `from_arrays`.
        """
        table = frame.reset_index() if frame.index.name is not None else frame
        columns = {str(key): table[key].to_numpy() for key in table.columns}
        stated = units if units is not None else frame.attrs.get("units")
        return cls.from_arrays(columns, units=stated, name=name, design=design, conditions=conditions)

    @classmethod
    def from_xarray(
        cls,
        dataset: xarray.Dataset,
        *,
        units: Mapping[str, str] | None = None,
        name: str = "run",
        design: VehicleDesign | None = None,
        conditions: Mapping[str, Any] | None = None,
    ) -> Self:
        """Build a run of the variables and coordinates of a dataset of one dimension.

        Units by default as in the attribute `units` of each variable; parameters and exceptions as `from_arrays`.
        """
        variables = {str(key): dataset[key] for key in (*dataset.coords, *dataset.data_vars)}
        columns = {key: variable.to_numpy() for key, variable in variables.items()}
        stated = {key: str(v.attrs["units"]) for key, v in variables.items() if v.attrs.get("units")}
        used = stated if units is None else units
        return cls.from_arrays(columns, units=used, name=name, design=design, conditions=conditions)

    @property
    def name(self) -> str:
        """Name of the file, or that given."""
        return self.file.name

    @property
    def column_units(self) -> dict[str, str]:
        """Unit of each column of `columns`: SI, of a rig those of the run."""
        known = columns_of(self.kind)
        return {name: self.units.get(name, "") if self.kind in RIG_FORMS else known[name].unit for name in self.columns}

    def save(self, path: str | Path) -> Path:
        """Write the run as CSV, gzipped if the name ends in .gz, or as Parquet, with all digits; return the path.

        Raises
        ------
        FileProblems
            For Parquet without pyarrow.
        """
        units = self.column_units
        columns = {f"{n} [{units[n]}]" if units[n] else n: x for n, x in self.columns.items()}
        columns = columns if self.table is None else _by_header(self.table)
        if str(path).lower().endswith(PARQUET):
            return write_series(path, columns)
        return write_table(path, columns, digits=None)

    def to_frame(self) -> pandas.DataFrame:
        """Return the columns as a pandas.DataFrame over t; ImportError without pandas."""
        from railui.api.frames import data_frame

        return data_frame(self.columns, "t", self.column_units)

    def to_xarray(self) -> xarray.Dataset:
        """Return the columns as an xarray.Dataset over t, with units; ImportError without xarray."""
        from railui.api.frames import data_set

        return data_set(self.columns, "t", self.column_units, {"title": self.name})

    def plot(self, name: str, ax: Axes | None = None) -> Axes:
        """Draw a column against time; return the axes."""
        from railui.report.figures.drawing import BLUE, axis_label

        def draw(on: Axes) -> None:
            on.plot(self.columns["t"], self.columns[name], lw=0.7, color=BLUE)
            on.set_xlabel("time [s]")
            on.set_ylabel(axis_label(name, self.column_units[name]))

        return draw_on(ax, draw)

    def summary_title(self) -> str:
        """Return name and kind."""
        return f"run {self.name} ({self.kind})"

    def summary_rows(self) -> list[SummaryRow]:
        """Return rate, rows, usable segments and the standard deviation of every measured motion."""
        rows = [
            SummaryRow("sampling rate", self.rate, "Hz"),
            SummaryRow("rows", len(self)),
            SummaryRow("usable segments", len(self.segments)),
        ]
        units = self.column_units
        return [*rows, *(SummaryRow(f"sd {n}", float(np.nanstd(self.columns[n])), units[n]) for n in self.responses)]

    def summary_notes(self) -> list[str]:
        """Return notes and warnings."""
        return [*self.notes, *map(str, self.warnings)]


def _table(columns: Mapping[str, ArrayLike], units: Mapping[str, str] | None, name: str, form: Form) -> Table:
    """Return arrays as the table of a run."""
    findings = Findings(name)
    given = check_unit_names(columns, units, findings)
    findings.raise_errors()
    arrays = {key: np.asarray(values, dtype=np.float64) for key, values in columns.items()}
    shapes = {key: array.shape for key, array in arrays.items()}
    if len(set(shapes.values())) > 1 or any(len(shape) != 1 for shape in shapes.values()):
        text = ", ".join(f"{key} {shape}" for key, shape in shapes.items())
        raise ValueError(f"{name}: the arrays of a run have one dimension and one length: {text}")
    if not arrays or not next(iter(arrays.values())).size:
        raise file_problem(name, "has no row", "give one value per sample")
    known = columns_of(form)
    labels = tuple(given.get(key, known[key].unit if key in known else None) for key in arrays)
    rows = np.column_stack(list(arrays.values()))
    return Table(name, tuple(arrays), labels, rows, (), NO_POSITION, (0,) * len(arrays))


def _by_header(table: Table) -> dict[str, FloatArray]:
    headers = (f"{n} [{unit}]" if unit else n for n, unit in zip(table.names, table.units, strict=True))
    return {header: table.rows[:, i] for i, header in enumerate(headers)}


def _text(table: Table) -> str:
    """Return the content of the file that `Run.save` would write."""
    return table_text(_by_header(table), digits=None)
