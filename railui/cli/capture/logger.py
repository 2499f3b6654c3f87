"""railui capture logger: simulated logger on a pseudo-terminal."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import click

from railui.cli.invocation import Invocation, common_options, usage_error, usage_errors
from railui.cli.quantities import option_callback, parse_speed

if TYPE_CHECKING:
    from railui.capture.simulator.logger import Faults, SimulatedLogger

SAMPLING_RATE = 200.0  # Hz


@click.command("logger")
@click.option("--link", metavar="PATH", help="Name of the port; that of the system by default.")
@click.option("--design", metavar="DESIGN", help="Vehicle; by default a bogie with worn axle boxes.")
@click.option("--track", default="erri_b176_low", metavar="SPEC", help="Track without its length.")
@click.option(
    "--speed", default="40", callback=option_callback(parse_speed), metavar="SPEED", help='Such as 40, or "144 km/h".'
)
@click.option("--seconds", default=600.0, show_default=True, type=click.FloatRange(1), help="Duration of the run.")
@click.option(
    "--pace", default=1.0, show_default=True, type=click.FloatRange(0, min_open=True), help="Times real time."
)
@click.option("--block", default=1, show_default=True, type=click.IntRange(1, 255), help="Samples per frame.")
@click.option("--text", is_flag=True, help="Lines of text instead of binary frames.")
@click.option("--noise", default=1.0, show_default=True, type=click.FloatRange(0), help="Times the usual noise.")
@click.option("--misbehave", metavar="NAME=VALUE,...", default="", help="drop=0.01,damage=0.01,unplug=5,restart=8, ...")
@click.option("--once", is_flag=True, help="Play once; by default the run is repeated.")
@click.option("--now", is_flag=True, help="Begin at once, not when the port is opened (as loggers that reset then).")
@click.option("--until-eof", is_flag=True, hidden=True, help="End when stdin is closed.")
@common_options
def command(
    link: str | None,
    design: str | None,
    track: str,
    speed: float,
    seconds: float,
    pace: float,
    block: int,
    text: bool,
    noise: float,
    misbehave: str,
    once: bool,
    now: bool,
    until_eof: bool,
    call: Invocation,
) -> None:
    """Play a simulated run as a logger on the bogie would send it, until ctrl-c.

    \b
    railui capture logger --link /tmp/logger --misbehave damage=0.01,unplug=5
    railui capture /tmp/logger -o monday

    Shares of frames: drop, damage, junk, repeat. Once, at a time [s]: restart, relayout (other channels), unplug,
    pause, huge_hello (claims 65535 channels), garble (as at a wrong baud rate). seed: seed of the random faults.
    """
    import json
    import math
    import tempfile

    from railui.capture import simulator
    from railui.capture.protocol import text as text_form
    from railui.capture.protocol import wire
    from railui.capture.simulator.terminal import DRAIN_TIMEOUT, READER_TIMEOUT, PseudoTerminal, ReaderAbsent, play

    if until_eof:
        _end_with_stdin()
    source = Path(design) if design else Path(simulator.__file__).with_name("demo.yaml")
    logger = _build_logger(source, track, speed, seconds, call.seed or 0, noise)
    logger = dataclasses.replace(
        logger, block=block, form="text" if text else "binary", faults=_parse_faults(misbehave)
    )
    with tempfile.TemporaryDirectory(prefix="railui-logger-") as home:
        terminal = PseudoTerminal(Path(link) if link else Path(home) / "logger")
        call.info(f"{terminal.link}: {len(logger.channels)} channels at {logger.rate:g} Hz, {seconds:g} s of data")
        if not once and link is None:
            click.echo(str(terminal.link))
        try:
            if not now:
                terminal.await_reader(text_form.DELIMITER if text else wire.DELIMITER)
            play(logger, terminal, pace, reader_timeout=READER_TIMEOUT if once else math.inf)
            while not once:
                play(dataclasses.replace(logger, faults=_parse_faults("")), terminal, pace)
            terminal.await_empty(DRAIN_TIMEOUT)
        except ReaderAbsent:
            call.info(f"ended early: nobody has read {terminal.link} for {READER_TIMEOUT:g} s")
        finally:
            terminal.unplug()
            sent = dataclasses.asdict(logger.sent_counts)
            call.write_json(call.document("capture_logger", {"sent": sent}, [source]))
            call.show(json.dumps(sent))


def _end_with_stdin() -> None:
    """End this process as by ctrl-c when stdin is closed, as at the end of the process that holds its other end."""
    import os
    import signal
    import threading

    def await_eof() -> None:
        while os.read(0, 1):
            pass
        os.kill(os.getpid(), signal.SIGTERM)

    threading.Thread(target=await_eof, name="stdin", daemon=True).start()


def _build_logger(source: Path, track: str, speed: float, seconds: float, seed: int, noise: float) -> SimulatedLogger:
    """Simulate a run and return the logger that sends it."""
    import numpy as np

    import railui
    from railui.capture.simulator.demo import WheelsetGeometry, demo_channels, simulate_sensors
    from railui.capture.simulator.logger import SimulatedLogger
    from railui.runs.columns import COMPARED_CHANNELS
    from railui.track import parse_spec
    from railui.vehicle.design_reader import load_design

    vehicle = load_design(source)
    length = np.ceil(speed * seconds)
    with usage_errors():
        spec = parse_spec(f"{track} length={length:g} seed={seed} spacing={speed / SAMPLING_RATE:.9g}")
    line = spec.build()
    motion = railui.simulate(vehicle, line, speed, COMPARED_CHANNELS)
    if not all(np.all(np.isfinite(motion[name])) for name in COMPARED_CHANNELS):
        raise RuntimeError(f"the simulation of {vehicle.name} diverges at {speed:.4g} m/s: lower the speed")
    motion |= {"v": np.full_like(motion["t"], speed), "phiw": line.phiw, "gauge": line.gauge}
    geometry = WheelsetGeometry(
        vehicle.value("vehicle.geometry.half_wheelbase"),
        vehicle.value("vehicle.geometry.half_gauge"),
        (vehicle.value("contact.leading.roll"), vehicle.value("contact.trailing.roll")),
    )
    readings = simulate_sensors(motion, geometry, SAMPLING_RATE, seed, noise)
    return SimulatedLogger(demo_channels(), readings, SAMPLING_RATE)


def _parse_faults(text: str) -> Faults:
    """Parse NAME=VALUE pairs with commas."""
    from railui.capture.simulator.logger import Faults
    from railui.io.problems import suggest_name

    fields = {f.name for f in dataclasses.fields(Faults)}
    values: dict[str, float] = {}
    for pair in text.split(","):
        name, _, value = pair.strip().partition("=")
        if not pair.strip():
            continue
        if name not in fields:
            raise usage_error(f"--misbehave {name} is not known, {suggest_name(name, fields)}")
        try:
            values[name] = int(value) if name == "seed" else float(value)
        except ValueError:
            raise usage_error(f"--misbehave {pair}: write {name}=NUMBER") from None
    return Faults(**values)  # type: ignore[arg-type]
