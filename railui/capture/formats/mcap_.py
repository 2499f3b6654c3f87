"""MCAP of robotics: the numbers in messages of JSON, ROS 1, ROS 2 and Protobuf, one channel per field of a topic."""

from __future__ import annotations

import json
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from railui.capture.formats.time_base import Series, check_size, is_discrete, merge_series
from railui.capture.processing.recording import Recording

DECODERS = ("mcap_ros1.decoder", "mcap_ros2.decoder", "mcap_protobuf.decoder")
NANOSECONDS = 1e9
MAX_ELEMENTS = 64  # of a list of numbers that become channels
MAX_DEPTH = 8
MIN_MESSAGES = 4
STAMP_FIELDS = ("header", "stamp", "timestamp")
SECONDS, FRACTIONS = ("sec", "secs", "seconds"), ("nanosec", "nsec", "nsecs", "nanos")


def read(path: Path, clock: str | None, rate: float | None) -> list[Recording]:
    """Read every number of every topic; its time is that of the message's header, else of its publication.

    `clock` and `rate` are not used. A file without its end (power cut) is read as far as it goes.
    """
    times: dict[str, list[float]] = {}
    values: dict[str, dict[str, dict[int, Any]]] = {}
    notes: list[str] = []
    for topic, stamp, message in _messages(path, notes):
        name = topic.strip("/")
        row = len(times.setdefault(name, []))
        times[name].append(_header_time(message) or stamp)
        fields = values.setdefault(name, {})
        for field, value in _numbers(message):
            fields.setdefault(field, {})[row] = value
    series = [
        _series(f"{topic}.{field}", np.array(times[topic]), rows)
        for topic, fields in values.items()
        for field, rows in fields.items()
        if len(times[topic]) >= MIN_MESSAGES
    ]
    return [merge_series(path, series, notes)]


def _series(name: str, t: np.ndarray, rows: dict[int, Any]) -> Series:
    x = np.full(t.size, np.nan)
    x[list(rows)] = [float(value) for value in rows.values()]
    kinds = {type(value) for value in rows.values()}
    whole = len(rows) == t.size and kinds <= {bool, int}
    return Series(name, None, t, x, whole and is_discrete(x.astype(np.int64)))


def _messages(path: Path, notes: list[str]) -> Iterator[tuple[str, float, Any]]:
    """Yield topic, time [s] and decoded content of the messages."""
    from mcap.exceptions import McapError
    from mcap.reader import NonSeekingReader, make_reader

    with path.open("rb") as stream:
        try:
            reader: Any = make_reader(stream, validate_crcs=True)
            summary = reader.get_summary()
            check_size(path, "messages", summary.statistics.message_count if summary and summary.statistics else 0)
            is_whole = True
        except McapError:
            stream.seek(0)
            reader, is_whole = NonSeekingReader(stream, validate_crcs=True), False
        factories = _decoder_factories()
        decoders: dict[int, Any] = {}
        skipped: dict[str, str] = {}
        try:
            for schema, channel, message in reader.iter_messages(log_time_order=is_whole):
                if channel.id not in decoders:
                    decoders[channel.id] = _decoder(channel.message_encoding, schema, factories)
                decode = decoders[channel.id]
                if decode is None:
                    skipped[channel.topic] = channel.message_encoding
                else:
                    yield channel.topic, (message.publish_time or message.log_time) / NANOSECONDS, decode(message.data)
        except McapError as error:
            if is_whole:
                raise
            notes.append(f"the file has no end ({type(error).__name__}): read as far as it goes")
        for topic, encoding in skipped.items():
            notes.append(f"{topic.strip('/')} is encoded as {encoding or 'unknown'}, which cannot be read: left out")


def _decoder_factories() -> list[Any]:
    factories = []
    for module in DECODERS:
        try:
            factories.append(import_module(module).DecoderFactory())
        except ImportError:
            continue
    return factories


def _decoder(encoding: str, schema: Any, factories: list[Any]) -> Any:
    """Return the function that decodes a message of an encoding, None without one."""
    if encoding == "json":
        return json.loads
    return next((found for factory in factories if (found := factory.decoder_for(encoding, schema))), None)


def _fields(value: Any) -> Iterator[tuple[str, Any]]:
    """Yield the fields of a decoded message: a mapping, a Protobuf message, an object of ROS."""
    if isinstance(value, dict):
        yield from value.items()
    elif hasattr(value, "DESCRIPTOR"):
        yield from ((field.name, getattr(value, field.name)) for field in value.DESCRIPTOR.fields)
    else:
        yield from ((name, getattr(value, name)) for name in getattr(value, "__slots__", ()))


def _numbers(value: Any, prefix: str = "", depth: int = 0) -> Iterator[tuple[str, float | int | bool]]:
    """Yield the numbers of a message by their dotted path, without its header.

    >>> list(_numbers({"header": {"seq": 1}, "a": {"x": 1.5, "name": "left"}, "b": [2, 3]}))
    [('a.x', 1.5), ('b.0', 2), ('b.1', 3)]
    """
    if isinstance(value, bool | int | float):
        yield prefix, value
    elif isinstance(value, list | tuple | np.ndarray) and len(value) <= MAX_ELEMENTS:
        for i, item in enumerate(value):
            yield from _numbers(item, f"{prefix}.{i}" if prefix else str(i), depth + 1)
    elif depth < MAX_DEPTH and not isinstance(value, str | bytes | None):
        for name, item in _fields(value):
            if depth or name not in STAMP_FIELDS:
                yield from _numbers(item, f"{prefix}.{name}" if prefix else name, depth + 1)


def _header_time(message: Any) -> float | None:
    """Return the time stamp in a message's header [s], None without one.

    >>> _header_time({"header": {"stamp": {"sec": 12, "nanosec": 500000000}}})
    12.5
    """
    for name, value in _fields(message):
        if name == "header":
            return _header_time(value)
        if name in STAMP_FIELDS and not isinstance(value, str | bytes | int | float):
            parts = dict(_fields(value))
            seconds = next((parts[key] for key in SECONDS if key in parts), None)
            fraction = next((parts[key] for key in FRACTIONS if key in parts), 0)
            if isinstance(seconds, int) and (seconds or fraction):
                return float(seconds + fraction / NANOSECONDS)
    return None
