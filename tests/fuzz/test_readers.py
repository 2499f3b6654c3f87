"""Every reader reads a file or raises FileProblems: corpus, randomly changed bytes, random bytes."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from railui.campaign.campaign import load_campaign
from railui.capture.formats import read_recordings
from railui.capture.processing.sensor_map import load_map
from railui.capture.protocol import wire
from railui.capture.protocol.link import Link
from railui.capture.protocol.messages import Channel
from railui.contact.contact_points import find_contacts
from railui.contact.geometry import ContactGeometry
from railui.contact.profile import ProfileError
from railui.contact.profile_reader import read_profile
from railui.contact.radius_table_reader import read_radius_table
from railui.contact.wheelset_on_track import WheelRailPair
from railui.io.problems import FileProblems
from railui.optimisation.study_reader import load_study
from railui.runs.run import load_run
from railui.track.reader import load_track
from railui.vehicle.design_reader import load_design

CORPUS = Path(__file__).parent / "corpus"
DESIGNS = Path(__file__).parents[2] / "designs"


def contacts_of(wheel: Path, rail: Path) -> ContactGeometry | None:
    """Return the contacts of a wheel on a rail; None if the profiles do not fit."""
    pair = read_profile(wheel, "wheel"), read_profile(rail, "rail")
    try:
        return find_contacts(WheelRailPair(*pair, inclination=0.025), step=1e-3)
    except ProfileError as fault:
        assert fault.message and fault.remedy
        return None


READERS: dict[str, Callable[[Path], object]] = {
    "wheel": lambda path: contacts_of(path, DESIGNS / "profiles" / "60e1.txt"),
    "rail": lambda path: contacts_of(DESIGNS / "profiles" / "s1002.txt", path),
    "delta_r": read_radius_table,
    "design": load_design,
    "campaign": load_campaign,
    "study": load_study,
    "map": load_map,
    "run": load_run,
    "track": load_track,
    "delimited": read_recordings,
}
VALID_FILES = {
    "wheel": DESIGNS / "profiles" / "s1002.txt",
    "rail": DESIGNS / "profiles" / "60e1.txt",
    "delta_r": CORPUS / "delta_r" / "whole.csv",
    "design": DESIGNS / "test_bogie.yaml",
    "campaign": DESIGNS / "campaigns" / "worn_axle_box" / "campaign.yaml",
    "study": DESIGNS / "studies" / "test_bogie.yaml",
    "map": DESIGNS / "maps" / "demo_logger.yaml",
    "run": CORPUS / "run" / "comma.csv",
    "track": CORPUS / "track" / "uneven.csv",
    "delimited": CORPUS / "delimited" / "semicolon_latin.csv",
}
quick = settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
byte_edits = st.lists(st.tuples(st.floats(0, 1), st.integers(0, 9), st.binary(max_size=6)), min_size=1, max_size=4)
ByteEdits = list[tuple[float, int, bytes]]


def read_or_rejected(kind: str, path: Path) -> None:
    try:
        READERS[kind](path)
    except FileProblems as error:
        assert error.problems
        assert all(problem.message and problem.file for problem in error.problems)


def with_edits(data: bytes, edits: ByteEdits) -> bytes:
    """Return the bytes with some of them replaced."""
    for where, length, piece in edits:
        i = int(where * len(data))
        data = data[:i] + piece + data[i + length :]
    return data


@pytest.mark.parametrize(
    "path", [p for kind in READERS for p in sorted((CORPUS / kind).iterdir())], ids=lambda p: p.name
)
def test_files_of_the_corpus_are_read_or_rejected(path: Path) -> None:
    read_or_rejected(path.parent.name, path)


@pytest.mark.parametrize("kind", READERS)
@quick
@given(edits=byte_edits)
def test_a_whole_file_with_bytes_changed_at_random_is_read_or_rejected(
    kind: str, tmp_path: Path, edits: ByteEdits
) -> None:
    whole = VALID_FILES[kind]
    path = tmp_path / whole.name
    path.write_bytes(with_edits(whole.read_bytes(), edits))
    read_or_rejected(kind, path)


@pytest.mark.parametrize("ending", [".mf4", ".uff", ".h5", ".mat", ".csv.gz"])
@settings(parent=quick, max_examples=15)
@given(data=st.binary(max_size=200))
def test_invalid_files_of_other_programs_are_rejected(ending: str, tmp_path: Path, data: bytes) -> None:
    path = tmp_path / f"bench{ending}"
    path.write_bytes(data)
    read_or_rejected("delimited", path)


@pytest.mark.parametrize("name", ["run_1.csv", "capture.json"])
@quick
@given(data=st.binary(max_size=120))
def test_a_recording_whose_files_were_damaged_is_read_or_rejected(name: str, tmp_path: Path, data: bytes) -> None:
    (tmp_path / "run_1.csv").write_text("t [s],a [m/s^2]\n" + "".join(f"{0.01 * i:.2f},{i}\n" for i in range(50)))
    (tmp_path / "capture.json").write_text('{"segments": [{"file": "run_1.csv", "boot": 1, "channels": []}]}')
    (tmp_path / name).write_bytes(data)
    read_or_rejected("delimited", tmp_path)


CHANNELS = [Channel("a", "m/s^2", "h", 0.001, 0.0)]
BODY = wire.hello_body(1, 100.0, "logger", "1", CHANNELS)
STREAM = wire.encode_hello(0, BODY) + b"".join(
    wire.encode_sample(wire.layout_hash(BODY), i, 10 * i, bytes([i, 0])) for i in range(1, 20)
)


@quick
@given(edits=byte_edits)
def test_frames_with_bytes_changed_at_random_are_counted(edits: ByteEdits) -> None:
    link = Link()
    link.feed(with_edits(STREAM, edits))
    statistics = link.close()
    # nine bytes belong to two frames at most
    assert 20 - 2 * len(edits) <= statistics.frames <= 20


@pytest.mark.parametrize("path", sorted((CORPUS / "frames").iterdir()), ids=lambda p: p.name)
def test_bytes_that_are_no_frames_make_none(path: Path) -> None:
    link = Link()
    assert link.feed(path.read_bytes()) == []
    assert link.close().frames == 0


@quick
@given(payload=st.binary(max_size=300))
def test_any_body_with_a_valid_crc_is_a_frame_or_rejected(payload: bytes) -> None:
    """Channel counts and lengths in a frame are checked, not trusted."""
    link = Link()
    link.feed(wire.encode_frame(payload))
    line = payload.replace(b"\n", b" ")
    link = Link()
    link.feed(line + b"*%08x\n" % zlib.crc32(line))
    assert link.close().frames <= 1


def test_the_corpus_is_there_for_every_reader() -> None:
    assert {p.name for p in CORPUS.iterdir()} == {*READERS, "frames"}
