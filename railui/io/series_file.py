"""Files of time series: CSV, compressed CSV and Parquet."""

from __future__ import annotations

import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Final

from numpy.typing import ArrayLike

from railui.io.atomic import check_file_writable, write_bytes
from railui.io.extras import install_extra
from railui.io.problems import file_problem
from railui.io.table import write_table

SUFFIXES: Final = (".csv", ".csv.gz", ".parquet")
PARQUET: Final = ".parquet"


def check_series_file(path: str | Path) -> None:
    """Check that a file of time series can be written.

    Raises
    ------
    ValueError
        For a name with another suffix.
    FileProblems
        For Parquet where pyarrow is not installed; the remedy names the optional dependencies.
    OSError
        Where the file cannot be written.
    """
    if not str(path).lower().endswith(SUFFIXES):
        names = " or ".join(SUFFIXES)
        raise ValueError(f"{str(path)!r} is not a file of time series: write a name that ends in {names}")
    if str(path).lower().endswith(PARQUET):
        try:
            import pyarrow.parquet  # noqa: F401
        except ImportError:
            raise file_problem(
                path, "Parquet needs pyarrow, which is not installed", install_extra("parquet")
            ) from None
    check_file_writable(path)


def write_series(path: str | Path, columns: Mapping[str, ArrayLike], comments: Sequence[str] = ()) -> Path:
    """Write columns by their header `name [unit]` atomically, in the format of the file name; see `check_series_file`.

    CSV has nine significant digits, Parquet the doubles; its metadata has the comments under the key `railui`.
    """
    check_series_file(path)
    if not str(path).lower().endswith(PARQUET):
        return write_table(path, columns, comments)
    import pyarrow
    import pyarrow.parquet

    table = pyarrow.table(dict(columns)).replace_schema_metadata({"railui": "\n".join(comments)})
    out = io.BytesIO()
    pyarrow.parquet.write_table(table, out)
    return write_bytes(path, out.getvalue())
