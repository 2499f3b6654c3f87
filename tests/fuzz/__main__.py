"""Fuzzing of all commands and of the wire: no traceback, hang, raw warning, NaN in JSON, or memory above 2 GB.

python -m tests.fuzz --cases 10000 --frames 1000000 --seed 1      all; failures into target/fuzz
python -m tests.fuzz --only 4711                                  one case again
"""

from __future__ import annotations

import argparse
import contextlib
import json
import os
import resource
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from types import FrameType

import numpy as np

TIME_LIMIT = 30  # s of a command
KILL_AFTER = 60  # s of silence of the process
MEMORY_LIMIT = 2_000_000_000  # bytes of address space
FAILURES = Path("target/fuzz")
EXIT_CODES = (0, 1, 2, 3, 4)
FORGED_STREAMS = 60


class TimeExceeded(BaseException):
    """A command takes longer than the limit."""


def run_case(home: Path, seed: int, number: int) -> dict[str, object]:
    """Run a mutated case; return its command line and fault, "" without one."""
    from tests.fuzz.commands import FITS, SHARE_OF_FITS, TEMPLATES
    from tests.fuzz.mutations import mutate, mutate_words

    random = np.random.default_rng([seed, number])
    templates = FITS if random.random() < SHARE_OF_FITS else TEMPLATES
    file, template = templates[int(random.integers(len(templates)))]
    words, path = list(template), home / file
    original = path.read_bytes()
    try:
        if random.random() < 0.75:
            path.write_bytes(mutate(original, random))
        else:
            words = mutate_words(words, random)
            if words[0] == "optimise" and "--dry-run" not in words:
                words.append("--dry-run")  # a search may take hours
        start = time.perf_counter()
        code, fault = run_command(words)
        seconds = time.perf_counter() - start
        if fault:
            kept = FAILURES.absolute() / str(number)
            kept.mkdir(parents=True, exist_ok=True)
            shutil.copy(path, kept)
            (kept / "HOW").write_text(f"{words}\nmutated: {file}\n{fault}\n")
    finally:
        path.write_bytes(original)
    return {"number": number, "words": words, "file": file, "code": code, "fault": fault, "seconds": seconds}


def run_command(words: list[str]) -> tuple[int, str]:
    """Run a command in this process; return its exit code and fault."""
    from click.testing import CliRunner

    from railui.cli import cli

    signal.alarm(TIME_LIMIT)
    try:
        result = CliRunner().invoke(cli, [*words, "--json", "-"])
    except TimeExceeded:
        return -1, f"more than {TIME_LIMIT} s"
    finally:
        signal.alarm(0)
        shutil.rmtree("decoded", ignore_errors=True)
        Path("out.csv").unlink(missing_ok=True)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        import traceback

        return result.exit_code, "".join(traceback.format_exception(result.exception))[-3000:]
    if result.exit_code not in EXIT_CODES:
        return result.exit_code, f"exit code {result.exit_code}"
    if "Warning: " in result.stderr:
        return result.exit_code, f"raw warning: {result.stderr[-500:]}"
    if result.exit_code and not (result.stderr + result.stdout).strip():
        return result.exit_code, "fails without a word"
    if result.exit_code == 0 and result.stdout.lstrip().startswith("{"):
        try:
            json.loads(result.stdout, parse_constant=_refuse_constant)
        except ValueError as error:
            return result.exit_code, f"JSON: {error}"
    return result.exit_code, ""


def _refuse_constant(word: str) -> None:
    raise ValueError(f"{word} in the document")


def work(seed: int, first: int, last: int) -> None:
    """Run the cases of a range; print a JSON line before and after each."""

    def stop(number: int, frame: FrameType | None) -> None:
        raise TimeExceeded

    signal.signal(signal.SIGALRM, stop)
    from tests.fuzz.commands import write_files

    os.environ["COLUMNS"] = "200"
    start = Path.cwd()
    with tempfile.TemporaryDirectory() as directory:
        home = Path(directory) / "files"
        write_files(home)
        resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
        global FAILURES
        FAILURES = start / FAILURES
        os.chdir(home)
        for number in range(first, last):
            print(json.dumps({"begins": number}), flush=True)
            print(json.dumps(run_case(home, seed, number)), flush=True)
        os.chdir(start)


def fuzz_commands(seed: int, first: int, last: int) -> list[dict[str, object]]:
    """Run cases in a process of their own, which is started anew if it dies; return the outcomes."""
    outcomes: list[dict[str, object]] = []
    number = first
    while number < last:
        words = [sys.executable, "-m", "tests.fuzz", "--work", str(number), str(last), "--seed", str(seed)]
        process = subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert process.stdout is not None
        os.set_blocking(process.stdout.fileno(), False)
        pending, heard = "", time.monotonic()
        while process.poll() is None or pending:
            with contextlib.suppress(TypeError, BlockingIOError):
                pending += process.stdout.read() or ""
            *lines, pending = pending.split("\n") if "\n" in pending else [pending]
            for line in lines:
                heard = time.monotonic()
                record = json.loads(line)
                if "words" in record:
                    outcomes.append(record)
                    number = record["number"] + 1
                    if record["fault"] or number % 500 == 0:
                        print(f"{number}: {record['words']} {str(record['fault'])[-200:]}", flush=True)
            if time.monotonic() - heard > KILL_AFTER:
                process.kill()
            if process.poll() is not None and not lines:
                break
            time.sleep(0.05)
        if number < last:
            fault = f"the process ended with {process.wait()}"
            outcomes.append({"number": number, "words": [], "file": "", "code": -2, "fault": fault, "seconds": 0.0})
            print(f"{number}: {fault}", flush=True)
            number += 1
    return outcomes


def forged_streams(seed: int) -> int:
    """Feed streams of valid CRC and random content to the recorder; return the number that raise an exception."""
    from railui.capture.protocol import wire
    from railui.capture.recorder.session_assembler import SessionAssembler
    from tests.fuzz.commands import raw_stream

    faults = 0
    for number in range(FORGED_STREAMS):
        random = np.random.default_rng([seed, 1, number])
        assembler = SessionAssembler()
        try:
            for frame in raw_stream().split(b"\0"):
                if random.random() < 0.2:
                    size = int(random.integers(1, 200))
                    kind = bytes([int(random.integers(0, 7))])
                    assembler.feed(wire.encode_frame(kind + random.bytes(size)))
                assembler.feed(frame + b"\0")
                if random.random() < 0.005:
                    assembler.reconnect()
            assembler.close()
        except Exception as error:  # every exception is a fault
            print(f"forged stream {number}: {type(error).__name__}: {error}")
            faults += 1
    return faults


def main() -> int:
    """Run the fuzzing; return 1 with a fault."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cases", type=int, default=10_000)
    parser.add_argument("--frames", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--only", type=int)
    parser.add_argument("--work", type=int, nargs=2, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.work:
        work(options.seed, *options.work)
        return 0
    first, last = (options.only, options.only + 1) if options.only is not None else (0, options.cases)
    start = time.monotonic()
    outcomes = fuzz_commands(options.seed, first, last)
    faults = [o for o in outcomes if o["fault"]]
    codes = dict(sorted(Counter(o["code"] for o in outcomes).items(), key=str))
    print(f"{len(outcomes)} commands in {time.monotonic() - start:.0f} s, exit codes {codes}: {len(faults)} faults")
    forged = forged_streams(options.seed)
    print(f"{FORGED_STREAMS} forged streams: {forged} exceptions")
    wrong = 0
    if options.only is None:
        from tests.capture.soak import soak

        result = soak(options.frames, options.seed)
        wrong = result.wrong
        print(f"{result.frames} damaged frames: {wrong} accepted")
    return 1 if faults or forged or wrong else 0


if __name__ == "__main__":
    sys.exit(main())
