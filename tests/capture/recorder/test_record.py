"""Recordings over real pseudo-terminals in separate processes: complete, exact, robust."""

from __future__ import annotations

import errno
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

import railui
from railui.capture.formats import read_recordings
from railui.capture.protocol import wire
from railui.capture.protocol.link import LinkStatistics
from railui.capture.protocol.messages import Channel
from railui.capture.recorder.link_watch import MAX_SILENCE, MAX_UNDECODED_BYTES, LinkWatch
from railui.capture.recorder.record import Recorder
from railui.capture.recorder.replay import decode
from railui.capture.simulator.terminal import PseudoTerminal, play
from railui.io.problems import FileProblems
from railui.io.table import read_table
from tests.capture.ports import (
    RAILUI,
    TIMEOUT,
    LoggerPlayer,
    capture_report,
    counts_sent_by,
    running_logger,
    small_logger,
    start_recorder,
    wait_until,
)

KILLS = 50
PARALLEL = 5
FRAME_BYTES = 27  # of a sample of the small logger


def has_same_runs(a: Path, b: Path) -> bool:
    names = sorted(p.name for p in a.glob("run_*.csv"))
    return names == sorted(p.name for p in b.glob("run_*.csv")) and all(
        (a / n).read_bytes() == (b / n).read_bytes() for n in names
    )


def interrupt(child: subprocess.Popen[str]) -> tuple[str, str]:
    """End a recorder as ctrl-c does."""
    child.send_signal(signal.SIGINT)
    return child.communicate(timeout=TIMEOUT)


def row_count(directory: Path) -> int:
    """Return the number of samples on the disk so far."""
    return sum(p.read_bytes().count(b"\n") - 4 for p in directory.glob("run_*.csv"))


def test_recording_with_markers_is_rebuilt_from_its_raw_bytes(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with running_logger(tmp_path / "port", "--seconds", "12", "--pace", "8", "--once") as logger:
        child = start_recorder(tmp_path / "port", out)
        wait_until(lambda: row_count(out) > 501)  # of 5 ms: beyond 2.5 s
        assert child.stdin is not None
        child.stdin.write("bridge at km 12\n")
        child.stdin.flush()
        sent = counts_sent_by(logger)
        wait_until(lambda: row_count(out) >= sent["samples"])
    text, _ = interrupt(child)
    assert child.returncode == 0 and "recording" in text
    report = capture_report(out)
    assert report["schema"] == "railui.capture/1" and report["inputs"][0]["file"].endswith("raw.bin")
    assert (report["samples"], report["frames"], report["lost"]) == (sent["samples"], sent["frames"], 0)
    assert report["crc_errors"] == report["gaps"] == report["reconnects"] == 0
    marker = report["markers"][0]
    assert marker["text"] == "bridge at km 12" and 2.5 < marker["t"] < 12.0
    again = tmp_path / "again"
    subprocess.run([*RAILUI, "capture", "decode", str(out / "raw.bin"), "-o", str(again), "-q"], check=True, stdout=-3)
    assert has_same_runs(out, again)
    again_report = {key: x for key, x in capture_report(again).items() if key not in ("inputs", "highest_queue")}
    assert again_report == {key: report[key] for key in again_report}


def test_faults_of_a_logger_are_counted_exactly(tmp_path: Path) -> None:
    out = tmp_path / "out"
    faults = "damage=0.02,drop=0.01,junk=0.01,repeat=0.01,restart=6,seed=4"
    words = ("--seconds", "14", "--pace", "6", "--once", "--misbehave", faults)
    with running_logger(tmp_path / "port", *words) as logger:
        child = start_recorder(tmp_path / "port", out)
        sent = counts_sent_by(logger)
    interrupt(child)
    report = capture_report(out)
    assert report["restarts"] == 1 and len(report["segments"]) == 2
    assert (
        report["lost"] >= 0.9 * (sent["dropped"] + sent["damaged"]) > 0
    )  # the last ones before the restart leave no trace
    assert report["lost"] <= sent["dropped"] + sent["damaged"]
    assert report["frames"] == sent["frames"] - sent["damaged"] + report["repeated"]
    assert report["crc_errors"] >= sent["damaged"]
    total = report["samples"] + report["missing_samples"]
    assert sent["samples"] - 10 <= total <= sent["samples"]


def test_a_terminated_logger_takes_its_files_away(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TMPDIR", str(tmp_path))
    with running_logger(tmp_path / "port", "--seconds", "1") as logger:
        assert list(tmp_path.glob("railui-logger-*")) and (tmp_path / "port").is_symlink()
    assert logger.returncode == 130 and not list(tmp_path.iterdir())


def test_cable_unplugged_and_plugged_in_begins_a_segment(tmp_path: Path) -> None:
    out = tmp_path / "out"
    words = ("--seconds", "20", "--pace", "5", "--once", "--misbehave", "unplug=8")
    with running_logger(tmp_path / "port", *words) as logger:
        child = start_recorder(tmp_path / "port", out)
        counts_sent_by(logger)
    _, narration = interrupt(child)
    report = capture_report(out)
    assert report["reconnects"] == 1 and [s["why"] for s in report["segments"]] == ["begin", "reconnect"]
    assert "is gone" in narration and "there again" in narration
    first, second = report["segments"]
    assert second["first"] > first["last"] and report["lost"] > 0
    joined = read_recordings(out)
    assert len(joined) == 1 and joined[0].t.size == report["samples"] and np.all(np.diff(joined[0].t) > 0)
    decode(out / "raw.bin", tmp_path / "again")
    assert has_same_runs(out, tmp_path / "again")


def test_at_most_the_last_second_is_missing_after_a_kill(tmp_path: Path) -> None:
    random = np.random.default_rng(7)
    checked_rows: list[int] = []  # of every session compared with what was sent
    with LoggerPlayer(tmp_path) as player:

        def kill_and_check(number: int, wait: float) -> None:
            out = tmp_path / f"out{number}"
            port = player.add(f"port{number}", small_logger(600.0, number, damage=0.005))
            child = start_recorder(port, out, "-q")
            wait_until(lambda: (out / "raw.bin").exists() and (out / "raw.bin").stat().st_size > 0)
            time.sleep(wait)
            received = (out / "raw.bin").stat().st_size
            os.kill(child.pid, signal.SIGKILL)
            child.communicate()
            last, unread = player.halt(port.name)
            again = tmp_path / f"again{number}"
            replay = decode(out / "raw.bin", again)
            assert replay.position >= received
            for segment in replay.assembler.sessions:
                counted, t = (read_table(again / f"run_{segment.number:03d}.csv").column(n) for n in ("count", "t"))
                assert np.array_equal(np.rint((t - t[0]) * 200), counted - counted[0])
                assert counted[-1] >= 200 * (last - 1.0) - unread / FRAME_BYTES, "more than the last second is missing"
                checked_rows.append(counted.size)
            for live in (f for f in out.glob("run_*.csv") if f.stat().st_size):  # others: killed at once
                written = read_recordings(live)[0].t
                assert np.array_equal(written, read_table(again / live.name).column("t")[: written.size])

        for begin in range(0, KILLS, PARALLEL):
            waits = random.uniform(0.0, 1.2, PARALLEL)
            failures: list[BaseException] = []

            def guarded(number: int, wait: float, failures: list[BaseException] = failures) -> None:
                try:
                    kill_and_check(number, wait)
                except BaseException as error:
                    failures.append(error)

            threads = [threading.Thread(target=guarded, args=(begin + i, w)) for i, w in enumerate(waits)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
            if failures:
                raise failures[0]
    assert len(checked_rows) > KILLS / 2 and sum(checked_rows) > 50 * KILLS  # a fifth is killed before the first hello


def test_full_disk_loses_nothing_if_there_is_room_again_in_time(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with LoggerPlayer(tmp_path) as player:
        child = start_recorder(player.add("port", small_logger()), out)
        wait_until(lambda: row_count(out) > 100)
        # a limit of the file size is a full disk for the process
        resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (1000, resource.RLIM_INFINITY))
        size = (out / "raw.bin").stat().st_size
        time.sleep(1.5)
        assert (out / "raw.bin").stat().st_size - size < 2000
        resource.prlimit(child.pid, resource.RLIMIT_FSIZE, (resource.RLIM_INFINITY, resource.RLIM_INFINITY))
        wait_until(lambda: (out / "raw.bin").stat().st_size > size + 8000)
        _, narration = interrupt(child)
    report = capture_report(out)
    assert child.returncode == 0 and "the disk is full" in narration and "room again" in narration
    assert report["lost"] == report["gaps"] == report["crc_errors"] == report["dropped_bytes"] == 0
    decode(out / "raw.bin", tmp_path / "again")
    assert has_same_runs(out, tmp_path / "again")


def test_a_failing_disk_is_no_full_disk_and_is_reported_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    master, slave = os.openpty()
    messages: list[str] = []
    recorder = Recorder(os.ttyname(slave), 115200, tmp_path / "out", messages.append)
    write, raw = os.write, recorder._raw

    def fail(fd: int, data: bytes) -> int:
        if fd == raw:
            raise OSError(errno.EIO, os.strerror(errno.EIO))
        return write(fd, data)

    monkeypatch.setattr(os, "write", fail)
    for _ in range(3):
        recorder._store(b"bytes")
    list(recorder.run(0.0))
    os.close(master)
    os.close(slave)
    assert len(messages) == 1 and messages[0].startswith("the disk fails (Input/output error)")
    assert recorder.disk_error is not None and recorder.replay.dropped_bytes == 15


def test_wrong_baud_rate_gives_a_warning_and_no_data(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with LoggerPlayer(tmp_path) as player:
        logger = small_logger(rate=2000.0, garble=0.001)
        child = start_recorder(player.add("port", logger), out, "--baud", "9600")
        wait_until(lambda: (out / "raw.bin").exists() and (out / "raw.bin").stat().st_size > 20_000)
        _, narration = interrupt(child)
    assert child.returncode == 3 and "no sample was decoded" in narration
    assert "9600 baud" in narration and capture_report(out)["samples"] == 0 and not list(out.glob("run_*"))
    assert any("baud rate" in note for note in capture_report(out)["notes"])


def test_link_that_becomes_unreadable_is_reported(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with running_logger(tmp_path / "port", "--seconds", "20", "--pace", "6", "--misbehave", "garble=3"):
        child = start_recorder(tmp_path / "port", out)
        wait_until(lambda: (out / "raw.bin").exists() and (out / "raw.bin").stat().st_size > 80_000)
        _, narration = interrupt(child)
    report = capture_report(out)
    assert child.returncode == 0 and report["samples"] > 0 and "warning: the link has become unreadable" in narration
    assert report["undecoded_bytes"] > 40_000 and any("in a row without a valid" in note for note in report["notes"])
    assert decode(out / "raw.bin", tmp_path / "again").report()["undecoded_bytes"] == report["undecoded_bytes"]


def test_link_that_falls_silent_is_reported(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with LoggerPlayer(tmp_path) as player:
        child = start_recorder(player.add("port", small_logger()), out)
        wait_until(lambda: row_count(out) > 100)
        with player._lock:
            time.sleep(MAX_SILENCE + 1.5)
        wait_until(lambda: row_count(out) > 300)
        _, narration = interrupt(child)
    report = capture_report(out)
    assert child.returncode == 0 and "warning: the link is silent" in narration
    assert report["silent_seconds"] > MAX_SILENCE and any("no byte came for" in note for note in report["notes"])
    assert decode(out / "raw.bin", tmp_path / "again").report()["silent_seconds"] == report["silent_seconds"]


def test_a_sound_link_has_no_fault(tmp_path: Path) -> None:
    messages: list[str] = []
    with LoggerPlayer(tmp_path) as player:
        port = player.add("port", small_logger(damage=0.05))
        report = railui.record(str(port), tmp_path / "out", seconds=2.5, on_message=messages.append)
    assert report["samples"] > 100 and 0 < report["undecoded_bytes"] < 500 and report["silent_seconds"] == 0.0
    assert not messages and not report["notes"]


def test_watch_reports_silence_and_unreadable_bytes_of_slow_loggers() -> None:
    watch, link = LinkWatch("/dev/x", 115200), LinkStatistics(frames=5)
    assert watch.check(500, link, 0.1, 0.0) is None
    assert watch.check(500, link, MAX_SILENCE + 0.1, 5.0) == (
        "the link is silent: no byte has come in 5 s: is the logger on, and is /dev/x its port?"
    )
    link.undecoded = 30
    assert "silent" in (watch.check(530, link, 90.0, 99.9) or "")
    assert watch.check(530, link, 0.1, 100.0) is None and watch.check(560, link, 0.1, 109.0) is None
    assert "unreadable" in (watch.check(800, link, 0.1, 111.0) or "")
    link.frames, link.undecoded = 6, 12
    assert watch.check(900, link, 0.1, 112.0) is None
    link.undecoded = MAX_UNDECODED_BYTES + 1
    assert "unreadable" in (watch.check(20_000, link, 0.1, 113.0) or "")


def test_missing_port_gives_the_exit_code_retry_later(tmp_path: Path) -> None:
    done = subprocess.run(
        [*RAILUI, "capture", str(tmp_path / "none"), "-o", str(tmp_path / "out")], capture_output=True, text=True
    )
    assert done.returncode == 3 and "does not open" in done.stderr and not (tmp_path / "out").exists()


def test_directory_with_a_recording_is_not_overwritten(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "raw.bin").write_bytes(b"precious")
    done = subprocess.run(
        [*RAILUI, "capture", "/dev/null", "-o", str(tmp_path / "out")], capture_output=True, text=True
    )
    assert done.returncode == 2 and "give another -o" in done.stderr
    assert (tmp_path / "out" / "raw.bin").read_bytes() == b"precious"


def test_demo_is_recorded_for_a_given_time(tmp_path: Path) -> None:
    words = [*RAILUI, "capture", "--demo", "-o", str(tmp_path / "demo"), "--seconds", "2", "--json", "-", "-q"]
    done = subprocess.run(words, capture_output=True, text=True, timeout=TIMEOUT, stdin=subprocess.DEVNULL)
    report = json.loads(done.stdout)
    assert done.returncode == 0 and report["samples"] > 100 and len(report["segments"][0]["channels"]) == 12


def test_recordings_of_python_have_a_capture_report(tmp_path: Path) -> None:
    report = railui.record(None, tmp_path / "demo", seconds=1.5)
    assert report == capture_report(tmp_path / "demo") and report["schema"] == "railui.capture/1"
    assert read_recordings(tmp_path / "demo")[0].device == report["segments"][0]["device"] != ""
    again = railui.decode_recording(tmp_path / "demo", tmp_path / "again")
    assert again == capture_report(tmp_path / "again") and again["frames"] == report["frames"]


def test_raw_bytes_of_another_program_are_decoded(tmp_path: Path) -> None:
    raw = tmp_path / "minicom.cap"
    raw.write_bytes(b"\x17\x42junk" + b"".join(data for _, data in small_logger(5.0).transmit()))
    replay = decode(raw, tmp_path / "out")
    assert replay.assembler.counts.samples >= 999
    assert [r.t.size for r in read_recordings(tmp_path / "out")] == [replay.assembler.counts.samples]


def test_many_restarts_do_not_exhaust_the_open_files(tmp_path: Path) -> None:
    channels, raw, restarts = (Channel("a", "m"),), b"", 200
    for boot in range(restarts):
        body = wire.hello_body(boot, 100.0, "x", "1", channels)
        raw += wire.encode_hello(0, body) + wire.encode_sample(wire.layout_hash(body), 1, 1000, b"\1\0")
    (tmp_path / "raw.bin").write_bytes(raw)
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    resource.setrlimit(resource.RLIMIT_NOFILE, (len(os.listdir("/proc/self/fd")) + 20, hard))
    try:
        decoded = decode(tmp_path / "raw.bin", tmp_path / "runs")
    finally:
        resource.setrlimit(resource.RLIMIT_NOFILE, (soft, hard))
    assert len(decoded.files.file_names) == restarts
    assert all(read_table(tmp_path / "runs" / name).rows.shape == (1, 2) for name in decoded.files.file_names)


def test_unfinished_last_line_is_removed(tmp_path: Path) -> None:
    raw = tmp_path / "raw.bin"
    raw.write_bytes(b"".join(data for _, data in small_logger(5.0).transmit()))
    decode(raw, tmp_path)
    run = tmp_path / "run_001.csv"
    run.write_bytes(run.read_bytes()[:-7])
    assert read_recordings(tmp_path)[0].t.size == 999


def test_a_file_that_a_killed_recorder_left_empty_is_no_recording(tmp_path: Path) -> None:
    (tmp_path / "run_001.csv").write_text("t [s],e1 [m]\n0,1\n0.01,2\n0.02,3\n")
    (tmp_path / "run_002.csv").touch()
    (recording,) = read_recordings(tmp_path)
    assert recording.channels["e1"].tolist() == [1.0, 2.0, 3.0]
    (tmp_path / "run_001.csv").unlink()
    (tmp_path / "raw.bin").touch()
    with pytest.raises(FileProblems, match="capture decode RAW rebuilds"):
        read_recordings(tmp_path)


def test_logger_plays_at_the_given_pace(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    clock = [0.0]
    fake_time = SimpleNamespace(monotonic=lambda: clock[0], sleep=lambda seconds: clock.append(clock.pop() + seconds))
    monkeypatch.setattr("railui.capture.simulator.terminal.time", fake_time)
    terminal = PseudoTerminal(tmp_path / "port")
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
    report = json.loads(done.stdout)
    assert done.returncode == code and report["state"] == state
    assert ("whatever the framing" in done.stderr) == (report["value_bytes_per_second"] > report["passes"])


@pytest.mark.parametrize("content", [b"", bytes(range(256)) * 8])
def test_decoding_bytes_without_a_sample_has_exit_code_3(content: bytes, tmp_path: Path) -> None:
    raw = tmp_path / "raw.bin"
    raw.write_bytes(content)
    command = [*RAILUI, "capture", "decode", str(raw), "-o", str(tmp_path / "again"), "-q"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 3 and f"no sample was decoded of {len(content)} bytes" in done.stderr
