"""Written files appear whole or not at all; canonical JSON and content hashes."""

from __future__ import annotations

import contextlib
import errno
import gzip
import hashlib
import json
import os
import secrets
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final

ELSEWHERE: Final = ", name a place that you may write"
REMEDIES: Final = {
    **dict.fromkeys((errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT), ELSEWHERE),
    errno.ENOSPC: ", make room there, or name another disk",
}


def write_bytes(path: str | Path, data: bytes) -> Path:
    """Writes beside the file, then renames; a file that stood there is replaced whole. Returns the path.

    OSError, with the number that the system gave and the path that was asked for.
    """
    path = Path(path)
    beside = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with beside.open("xb") as file:
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        beside.replace(path)
    except OSError as error:
        raise unwritten(error, path) from error
    finally:
        beside.unlink(missing_ok=True)
    return path


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


def beside(path: str | Path, home: str | Path) -> str:
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
