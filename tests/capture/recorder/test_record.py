"""Recordings over real pseudo-terminals, in processes of their own: nothing that was recorded is lost."""

from __future__ import annotations

import json
import os
import resource
import signal
import subprocess
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from railui.capture.formats import read_recordings
from railui.capture.protocol import wire
from railui.capture.protocol.frames import Channel
from railui.capture.recorder.replay import decode
from railui.capture.simulator.terminal import Terminal, play
from railui.io.table import read_table
from tests.capture.ports import PATIENCE, RAILUI, Feeder, demo_logger, recorder, small_logger, told, truth_of, until

KILLS, AT_ONCE = 50, 5
FRAME = 27  # bytes of a sample of the small logger


def same_runs(a: Path, b: Path) -> bool:
    names = sorted(p.name for p in a.glob("run_*.csv"))
    return names == sorted(p.name for p in b.glob("run_*.csv")) and all(
        (a / n).read_bytes() == (b / n).read_bytes() for n in names
    )


def ended(child: subprocess.Popen[str]) -> tuple[str, str]:
    """Ends a recorder as ctrl-c does."""
    child.send_signal(signal.SIGINT)
    return child.communicate(timeout=PATIENCE)


def rows(directory: Path) -> int:
    """Samples on the disk so far."""
    return sum(p.read_bytes().count(b"\n") - 4 for p in directory.glob("run_*.csv"))


def test_a_whole_recording_with_markers_is_rebuilt_from_its_raw_bytes(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with demo_logger(tmp_path / "port", "--seconds", "12", "--pace", "8", "--once") as logger:
        child = recorder(tmp_path / "port", out)
        until(lambda: rows(out) > 500)
        assert child.stdin is not None
        child.stdin.write("bridge at km 12\n")
        child.stdin.flush()
        sent = truth_of(logger)
        until(lambda: rows(out) >= sent["samples"])
    text, _ = ended(child)
    assert child.returncode == 0 and "recording" in text
    found = told(out)
    assert found["schema"] == "railui.capture/1" and found["inputs"][0]["file"].endswith("raw.bin")
    assert (found["samples"], found["frames"], found["lost"]) == (sent["samples"], sent["frames"], 0)
    assert found["crc_errors"] == found["gaps"] == found["reconnects"] == 0
    marker = found["markers"][0]
    assert marker["text"] == "bridge at km 12" and 2.5 < marker["t"] < 12.0
    again = tmp_path / "again"
    subprocess.run([*RAILUI, "capture", "decode", str(out / "raw.bin"), "-o", str(again), "-q"], check=True, stdout=-3)
    assert same_runs(out, again)
    rest = {key: x for key, x in told(again).items() if key not in ("inputs", "highest_queue")}
    assert rest == {key: found[key] for key in rest}


def test_a_misbehaving_logger_is_counted_exactly(tmp_path: Path) -> None:
    out = tmp_path / "out"
    wrong = "damage=0.02,drop=0.01,junk=0.01,repeat=0.01,restart=6,seed=4"
    words = ("--seconds", "14", "--pace", "6", "--once", "--misbehave", wrong)
    with demo_logger(tmp_path / "port", *words) as logger:
        child = recorder(tmp_path / "port", out)
        sent = truth_of(logger)
    ended(child)
    found = told(out)
    assert found["restarts"] == 1 and len(found["segments"]) == 2
    assert found["lost"] >= 0.9 * (sent["dropped"] + sent["damaged"]) > 0  # those last before the restart show nowhere
    assert found["lost"] <= sent["dropped"] + sent["damaged"]
    assert found["frames"] == sent["frames"] - sent["damaged"] + found["repeated"]
    assert found["crc_errors"] >= sent["damaged"]
    total = found["samples"] + found["missing_samples"]
    assert sent["samples"] - 10 <= total <= sent["samples"]


def test_a_cable_pulled_and_put_in_again_begins_a_segment(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("--seconds", "20", "--pace", "5", "--once", "--misbehave", "unplug=8")
    with demo_logger(tmp_path / "port", *words) as logger:
        child = recorder(tmp_path / "port", out)
        truth_of(logger)
    _, narration = ended(child)
    found = told(out)
    assert found["reconnects"] == 1 and [s["why"] for s in found["segments"]] == ["begin", "reconnect"]
    assert "is gone" in narration and "there again" in narration
    first, second = found["segments"]
    assert second["first"] > first["last"] and found["lost"] > 0
    joined = read_recordings(out)
    assert len(joined) == 1 and joined[0].t.size == found["samples"] and np.all(np.diff(joined[0].t) > 0)
    decode(out / "raw.bin", tmp_path / "again")
    assert same_runs(out, tmp_path / "again")


def test_killed_at_fifty_random_moments_at_most_the_last_second_is_missing(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    read: list[int] = []  # rows of the segments that were held against the truth
    with Feeder(tmp_path) as feeder:

        def one(number: int, wait: float) -> None:
            out = tmp_path / f"out{number}"
            port = feeder.add(f"port{number}", small_logger(600.0, number, damage=0.005))
            child = recorder(port, out, "-q")
            until(lambda: (out / "raw.bin").exists() and (out / "raw.bin").stat().st_size > 0)
            time.sleep(wait)
            received = (out / "raw.bin").stat().st_size
            os.kill(child.pid, signal.SIGKILL)
            child.communicate()
            last, unread = feeder.halt(port.name)
            again = tmp_path / f"again{number}"
            replay = decode(out / "raw.bin", again)
            assert replay.at >= received
            for segment in replay.assembly.segments:
                counted, t = (read_table(again / f"run_{segment.number:03d}.csv").column(n) for n in ("count", "t"))
                assert np.array_equal(np.rint((t - t[0]) * 200), counted - counted[0])
                assert counted[-1] >= 200 * (last - 1.0) - unread / FRAME, "more than the last second is missing"
                read.append(counted.size)
            for live in out.glob("run_*.csv"):
                written = read_recordings(live)[0].t
                assert np.array_equal(written, read_table(again / live.name).column("t")[: written.size])

        for begin in range(0, KILLS, AT_ONCE):
            waits = random.uniform(0.0, 1.2, AT_ONCE)
            failures: list[BaseException] = []

            def guarded(number: int, wait: float, failures: list[BaseException] = failures) -> None:
                try:
                    one(number, wait)
                except BaseException as error:
                    failures.append(error)

            threads = [threading.Thread(target=guarded, args=(begin + i, w)) for i, w in enumerate(waits)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            if failures:
                raise failures[0]
    assert len(read) > KILLS / 2 and sum(read) > 50 * KILLS  # a fifth is killed before the logger has said its name


def test_a_full_disk_loses_nothing_when_there_is_room_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with Feeder(tmp_path) as feeder:
        child = recorder(feeder.add("port", small_logger()), out)
        until(lambda: rows(out) > 100)
        # no file may grow any more: for the process that is a full disk
        resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
        size = (out / "raw.bin").stat().st_size
        time.sleep(1.5)
        assert (out / "raw.bin").stat().st_size - size < 2000
        resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        until(lambda: (out / "raw.bin").stat().st_size > size + 8000)
        _, narration = ended(child)
    found = told(out)
    assert child.returncode == 0 and "the disk is full" in narration and "room again" in narration
    assert found["lost"] == found["gaps"] == found["crc_errors"] == found["dropped_bytes"] == 0
    decode(out / "raw.bin", tmp_path / "again")
    assert same_runs(out, tmp_path / "again")


def test_a_wrong_baud_rate_is_doubted_and_nothing_is_taken_for_data(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with Feeder(tmp_path) as feeder:
        logger = small_logger(rate=2000.0, garble=0.001)
        child = recorder(feeder.add("port", logger), out, "--baud", "9600")
        until(lambda: (out / "raw.bin").exists() and (out / "raw.bin").stat().st_size > 20_000)
        _, narration = ended(child)
    assert "9600 baud" in narration and told(out)["samples"] == 0 and not list(out.glob("run_*"))
    assert any("baud rate" in note for note in told(out)["notes"])


def test_a_port_that_is_not_there_may_be_tried_later(tmp_path: Path) -> None:
    done = subprocess.run(
        [*RAILUI, "capture", str(tmp_path / "none"), "-o", str(tmp_path / "out")], capture_output=True, text=True
    )
    assert done.returncode == 3 and "does not open" in done.stderr and not (tmp_path / "out").exists()


def test_a_directory_that_holds_a_recording_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "raw.bin").write_bytes(b"precious")
    done = subprocess.run(
        [*RAILUI, "capture", "/dev/null", "-o", str(tmp_path / "out")], capture_output=True, text=True
    )
    assert done.returncode == 2 and "give another -o" in done.stderr
    assert (tmp_path / "out" / "raw.bin").read_bytes() == b"precious"


def test_the_demo_records_itself_for_so_many_seconds(tmp_path: Path) -> None:
    words = [*RAILUI, "capture", "--demo", "-o", str(tmp_path / "demo"), "--seconds", "2", "--json", "-", "-q"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=PATIENCE, stdin=subprocess.DEVNULL)
    found = json.loads(done.stdout)
    assert done.returncode == 0 and found["samples"] > 100 and len(found["segments"][0]["channels"]) == 12


def test_raw_bytes_that_something_else_stored_are_decoded_too(tmp_path: Path) -> None:
    raw = tmp_path / "minicom.cap"
    raw.write_bytes(b"\x17\x42junk" + b"".join(data for _, data in small_logger(5.0).sent()))
    replay = decode(raw, tmp_path / "out")
    assert replay.assembly.counts.samples >= 999
    assert [r.t.size for r in read_recordings(tmp_path / "out")] == [replay.assembly.counts.samples]


def test_a_logger_that_restarts_again_and_again_does_not_use_up_the_open_files(tmp_path: Path) -> None:
    channels, raw, restarts = (Channel("a", "m"),), b"", 200
    for boot in range(restarts):
        body = wire.hello_body(boot, 100.0, "x", "1", channels)
        raw += wire.hello(0, body) + wire.sample(wire.layout_of(body), 1, 1000, b"\1\0")
    (tmp_path / "raw.bin").write_bytes(raw)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 20, hard))
    try:
        decoded = decode(tmp_path / "raw.bin", tmp_path / "runs")
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert len(decoded.files.names) == restarts
    assert all(read_table(tmp_path / "runs" / name).rows.shape == (1, 2) for name in decoded.files.names)


def test_a_line_that_a_power_cut_left_unfinished_is_taken_off(tmp_path: Path) -> None:
    raw = tmp_path / "raw.bin"
    raw.write_bytes(b"".join(data for _, data in small_logger(5.0).sent()))
    decode(raw, tmp_path)
    run = tmp_path / "run_001.csv"
    run.write_bytes(run.read_bytes()[:-7])
    assert read_recordings(tmp_path)[0].t.size == 999


def test_play_goes_at_the_pace_it_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    ours = SimpleNamespace(monotonic=lambda: clock[0], sleep=lambda seconds: clock.append(clock.pop() + seconds))
    monkeypatch.setattr("railui.capture.simulator.terminal.time", ours)
    terminal = Terminal(tmp_path / "port")
    threading.Thread(target=lambda: [os.read(terminal.slave, 4096) for _ in iter(int, 1)], daemon=True).start()
    play(small_logger(2.0), terminal, pace=4.0)
    assert clock[0] == pytest.approx(2.0 / 4.0, abs=0.01)


@pytest.mark.parametrize(
    ("words", "code", "state"),
    [
        (["--channels", "12", "--rate", "500"], 4, "refused"),
        (["--channels", "12", "--rate", "500", "--block", "100"], 4, "refused"),
        (["--channels", "12", "--rate", "200", "--block", "16", "--baud", "57600"], 0, "narrow"),
        (["--channels", "12", "--rate", "500", "--baud", "921600"], 0, "fits"),
    ],
)
def test_check_computes_the_load_of_a_line(words: list[str], code: int, state: str) -> None:
    done = subprocess.run([*RAILUI, "capture", "--check", *words, "--json", "-"], capture_output=True, text=True)
    found = json.loads(done.stdout)
    assert done.returncode == code and found["state"] == state
    assert ("whatever the framing" in done.stderr) == (found["value_bytes_per_second"] > found["passes"])
