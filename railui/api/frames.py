"""Tables of results for pandas and xarray, which are optional dependencies."""

from __future__ import annotations

import importlib
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from railui.io.extras import install_extra

if TYPE_CHECKING:
    import pandas
    import xarray


def data_frame(
    columns: Mapping[str, ArrayLike], index: str | None = None, units: Mapping[str, str] | None = None
) -> pandas.DataFrame:
    """Return columns as a pandas.DataFrame, whose `attrs["units"]` has the unit of each column.

    Raises
    ------
    ImportError
        Without pandas; the message names the optional dependencies.
    """
    frame = optional_module("pandas").DataFrame(dict(columns))
    frame.attrs["units"] = dict(units or {})
    return frame if index is None else frame.set_index(index)


def frame_of_rows(rows: Sequence[Mapping[str, Any]], units: Mapping[str, str] | None = None) -> pandas.DataFrame:
    """Return rows of equal keys as a pandas.DataFrame; exceptions as `data_frame`."""
    frame = optional_module("pandas").DataFrame([dict(row) for row in rows])
    frame.attrs["units"] = dict(units or {})
    return frame


def data_set(
    columns: Mapping[str, ArrayLike],
    index: str,
    units: Mapping[str, str],
    attributes: Mapping[str, Any] | None = None,
) -> xarray.Dataset:
    """Return columns as an xarray.Dataset over one of them; each variable has its unit as attribute `units`.

    Raises
    ------
    ImportError
        Without xarray; the message names the optional dependencies.
    """
    xr = optional_module("xarray")
    values = {name: np.asarray(x) for name, x in columns.items()}
    variables = {name: (index, x, {"units": units.get(name, "")}) for name, x in values.items() if name != index}
    coordinates = {index: (index, values[index], {"units": units.get(index, "")})}
    return xr.Dataset(variables, coordinates, dict(attributes or {}))


def grid_data_set(
    values: Mapping[str, ArrayLike], axes: Mapping[str, ArrayLike], units: Mapping[str, str], title: str
) -> xarray.Dataset:
    """Return arrays over several axes, in their order, as an xarray.Dataset; exceptions as `data_set`."""
    variables = {name: (tuple(axes), np.asarray(x), {"units": units.get(name, "")}) for name, x in values.items()}
    coordinates = {name: (name, np.asarray(x), {"units": units.get(name, "")}) for name, x in axes.items()}
    return optional_module("xarray").Dataset(variables, coordinates, {"title": title})


def optional_module(name: str) -> Any:
    """Import pandas or xarray; ImportError with the remedy where it is not installed."""
    try:
        return importlib.import_module(name)
    except ImportError:
        raise ImportError(f"this needs {name}, which is not installed: {install_extra('frames')}", name=name) from None
