"""Written files appear whole or not at all; canonical JSON and content hashes."""

from __future__ import annotations

import contextlib
import errno
import gzip
import hashlib
import json
import os
import secrets
import stat
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

ELSEWHERE: Final = ", name a place that you may write"
REMEDIES: Final = {
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.EEXIST), ELSEWHERE),
    errno.ENOSPC: ", make room there, or name another disk",
    errno.EISDIR: ", name a file",
}
STREAMS: Final = (Path("/dev"), Path("/dev/fd"), Path("/proc/self/fd"))  # names of what is open already, devices


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Writes beside the file, then renames; a file that stood there is replaced whole. Returns the path.

    A link stays one, rights stay as they were; a device or a pipe is written to, never replaced.
    OSError, with the number that the system gave and the path that was asked for.
    """
    path = Path(path)
    try:
        if _flows(path):
            path.write_bytes(data)
        else:
            _replace(Path(os.path.realpath(path)), data)
    except OSError as error:
        raise unwritten(error, path) from error
    return path


def _flows(path: Path) -> bool:
    """Is a path a device, a pipe or a stream that is open already?"""
    return path.absolute().parent in STREAMS or (path.exists() and not path.is_file() and not path.is_dir())


def _no_directory(path: Path) -> None:
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))


def _replace(path: Path, data: bytes) -> None:
    _no_directory(path)
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with beside.open("xb") as file:
            if path.exists():
                os.fchmod(file.fileno(), stat.S_IMODE(path.stat().st_mode))
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    finally:
        beside.unlink(missing_ok=True)


def check_file(path: str | Path) -> None:
    """Raises OSError where `write_bytes` could not write a file; leaves nothing."""
    path = Path(path)
    try:
        _no_directory(path)
    except OSError as error:
        raise unwritten(error, path) from None
    if not _flows(path):
        check_writable(Path(os.path.realpath(path)).parent)


def check_writable(directory: str | Path) -> None:
    """Raises OSError where nothing could be written into a directory, there or still to be made; leaves nothing."""
    there = Path(directory).absolute()
    while not there.exists():
        there = there.parent
    probe = there / f".{secrets.token_hex(4)}.part"
    try:
        probe.touch(exist_ok=False)
    except OSError as error:
        raise unwritten(error, directory) from error
    finally:
        with contextlib.suppress(OSError):
            probe.unlink()


def unwritten(error: OSError, path: str | Path) -> OSError:
    """The same error with the path that was asked for and what to do."""
    remedy = REMEDIES.get(error.errno or 0, "")
    return OSError(error.errno, f"cannot be written ({error.strerror or error}){remedy}", str(path))


def write_text(path: str | Path, text: str) -> Path:
    """As write_bytes, in UTF-8; compressed (and always to the same bytes) where the name ends in .gz."""
    data = text.encode("utf-8")
    if str(path).endswith(".gz"):
        data = gzip.compress(data, compresslevel=6, mtime=0)
    return write_bytes(path, data)


def relative_path(path: str | Path, home: str | Path) -> str:
    """A path as a file that stands in the directory `home` names it.

    >>> beside("designs/coach.yaml", "designs/studies")
    '../coach.yaml'
    """
    return Path(os.path.relpath(Path(path).resolve(), Path(home).resolve())).as_posix()


def canonical_json(value: object) -> str:
    """JSON of which there is one form only: keys sorted, no spaces, shortest digits; NaN is a ValueError.

    >>> canonical_json({"b": 1.5, "a": [True, None]})
    '{"a":[true,null],"b":1.5}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def sha256(data: bytes | str) -> str:
    """The content hash of bytes or text, in hexadecimal."""
    return hashlib.sha256(data.encode("utf-8") if isinstance(data, str) else data).hexdigest()


def sha256_file(path: str | Path) -> str:
    """The content hash of a file as it lies on the disk."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def finite(value: Any) -> Any:
    """A value as JSON may hold it: arrays as lists, numbers that are not finite as None.

    >>> finite({"a": (1, float("nan")), "b": True})
    {'a': [1, None], 'b': True}
    """
    if isinstance(value, Mapping):
        return {str(key): finite(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # arrays and numbers of numpy
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [finite(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not (-1.8e308 < value < 1.8e308):
        return None
    return value
