"""File of a functional mock-up unit: description, kernel and vehicle in one archive, equal bytes for equal contents."""

from __future__ import annotations

import io
import json
import zipfile
from pathlib import Path
from typing import Final

from railui import __version__
from railui.core import kernel_library
from railui.documents.fmu_description import model_description, model_identifier
from railui.io.atomic import sha256, write_bytes
from railui.io.elf import library_machine, with_optional_symbols
from railui.vehicle.fmu_vehicle import FmuVehicle

SUFFIX: Final = ".fmu"
EPOCH: Final = (1980, 1, 1, 0, 0, 0)  # the earliest date of an archive
EXECUTABLE: Final = 0o755 << 16
READABLE: Final = 0o644 << 16


def check_fmu_file(path: str | Path) -> None:
    """Raise ValueError for a name that does not end in .fmu."""
    if not str(path).lower().endswith(SUFFIX):
        raise ValueError(f"{str(path)!r} is not a file of an FMU: write a name that ends in {SUFFIX}")


def write_fmu(path: str | Path, vehicle: FmuVehicle) -> Path:
    """Write a vehicle as an FMU for co-simulation on this platform, atomically.

    Raises
    ------
    ValueError
        For a name that does not end in .fmu, and where the kernel is no library of Linux.
    """
    check_fmu_file(path)
    library = _kernel()
    token = sha256(json.dumps(vehicle.data, sort_keys=True) + sha256(library))
    contents = {
        "modelDescription.xml": (model_description(vehicle, token, f"railui {__version__}"), READABLE),
        f"binaries/{library_machine(library)}-linux/{model_identifier(vehicle.name)}.so": (library, EXECUTABLE),
        "resources/vehicle.json": (json.dumps({"token": token, **vehicle.data}, indent=1).encode(), READABLE),
    }
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, (content, attributes) in contents.items():
            entry = zipfile.ZipInfo(name, EPOCH)
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, attributes
            archive.writestr(entry, content)
    return write_bytes(path, out.getvalue())


def _kernel() -> bytes:
    """Return the kernel's library, which loads without Python: the functions of FMI do not call it."""
    library = kernel_library().read_bytes()
    try:
        return with_optional_symbols(library, lambda name: name.lstrip("_").startswith("Py"))
    except ValueError as error:
        raise ValueError(f"an FMU is a copy of the kernel, which is {error} here") from None
