"""Atomic writing of files, canonical JSON and content hashes."""

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

ELSEWHERE: Final = ", name a directory that you may write to"
REMEDIES: Final = {
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.EEXIST), ELSEWHERE),
    errno.ENOSPC: ", make room there, or name another disk",
    errno.EISDIR: ", name a file",
}
STREAM_DIRECTORIES: Final = (Path("/dev"), Path("/dev/fd"), Path("/proc/self/fd"))  # devices and open streams


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Write a file atomically: into a temporary file in the same directory, which then replaces the target.

    A symbolic link remains one, and permissions are kept. A device or a pipe is written to directly.

    Raises
    ------
    OSError
        With the system's error number and the given path.
    """
    path = Path(path)
    try:
        if _is_stream(path):
            path.write_bytes(data)
        else:
            _replace(Path(os.path.realpath(path)), data)
    except OSError as error:
        raise write_error(error, path) from error
    return path


def _is_stream(path: Path) -> bool:
    """True if a path is a device, a pipe or an open stream."""
    return path.absolute().parent in STREAM_DIRECTORIES or (path.exists() and not path.is_file() and not path.is_dir())


def _refuse_directory(path: Path) -> None:
    if path.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))


def _replace(path: Path, data: bytes) -> None:
    _refuse_directory(path)
    temporary = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with temporary.open("xb") as file:
            if path.exists():
                os.fchmod(file.fileno(), stat.S_IMODE(path.stat().st_mode))
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.replace(path)
    finally:
        temporary.unlink(missing_ok=True)


def check_file_writable(path: str | Path) -> None:
    """Raise OSError if `write_bytes` could not write a file; leave nothing behind."""
    path = Path(path)
    try:
        _refuse_directory(path)
    except OSError as error:
        raise write_error(error, path) from None
    if not _is_stream(path):
        check_directory_writable(Path(os.path.realpath(path)).parent)


def check_directory_writable(directory: str | Path) -> None:
    """Raise OSError if a directory, existing or not, could not be written to; leave nothing behind."""
    there = Path(directory).absolute()
    while not there.exists():
        there = there.parent
    probe = there / f".{secrets.token_hex(4)}.part"
    try:
        probe.touch(exist_ok=False)
    except OSError as error:
        raise write_error(error, directory) from error
    finally:
        with contextlib.suppress(OSError):
            probe.unlink()


def write_error(error: OSError, path: str | Path) -> OSError:
    """Return an error with the given path and a remedy."""
    remedy = REMEDIES.get(error.errno or 0, "")
    return OSError(error.errno, f"cannot be written ({error.strerror or error}){remedy}", str(path))


def write_text(path: str | Path, text: str) -> Path:
    """Write a text atomically in UTF-8; compress it, reproducibly, if the name ends in .gz."""
    data = text.encode("utf-8")
    if str(path).endswith(".gz"):
        data = gzip.compress(data, compresslevel=6, mtime=0)
    return write_bytes(path, data)


def relative_path(path: str | Path, home: str | Path) -> str:
    """Return a path relative to the directory `home`.

    >>> relative_path("designs/coach.yaml", "designs/studies")
    '../coach.yaml'
    """
    return Path(os.path.relpath(Path(path).resolve(), Path(home).resolve())).as_posix()


def canonical_json(value: object) -> str:
    """Return canonical JSON: sorted keys, no spaces, shortest digits; raise ValueError for NaN.

    >>> canonical_json({"b": 1.5, "a": [True, None]})
    '{"a":[true,null],"b":1.5}'
    """
    return json.dumps(value, sort_keys=True, separators=(",", ":"), ensure_ascii=False, allow_nan=False)


def sha256(data: bytes | str) -> str:
    """Return the SHA-256 of bytes or text, in hexadecimal."""
    return hashlib.sha256(data.encode("utf-8") if isinstance(data, str) else data).hexdigest()


def sha256_file(path: str | Path) -> str:
    """Return the SHA-256 of a file's bytes, in hexadecimal."""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def to_json_value(value: Any) -> Any:
    """Convert a value for JSON: arrays to lists, non-finite numbers to None, paths to text.

    >>> to_json_value({"a": (1, float("nan")), "b": True})
    {'a': [1, None], 'b': True}
    """
    if isinstance(value, Mapping):
        return {str(key): to_json_value(item) for key, item in value.items()}
    if hasattr(value, "tolist"):  # numpy arrays and scalars
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [to_json_value(item) for item in value]
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, float) and not (-1.8e308 < value < 1.8e308):
        return None
    return value
