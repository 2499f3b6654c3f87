"""railui capture logger: a logger in software on a pseudo-terminal, that plays a simulated ride."""

from __future__ import annotations

import dataclasses
from pathlib import Path
from typing import TYPE_CHECKING

import click

from railui.cli.common import Invocation, options, refuse
from railui.cli.quantities import reading, speed

if TYPE_CHECKING:
    from railui.capture.simulator.logger import Faults, Logger

RATE = 200.0  # samples per second of the demo


@click.command("logger")
@click.option("--link", metavar="PATH", help="The name that the port gets; the system's own by default.")
@click.option("--design", metavar="DESIGN", help="The vehicle; by default a bogie whose axle boxes have worn.")
@click.option("--track", default="erri_b176_low", metavar="SPEC", help="The track it rides on, without its length.")
@click.option("--speed", default="40", callback=reading(speed), metavar="SPEED", help='Such as 40, or "144 km/h".')
@click.option("--seconds", default=600.0, show_default=True, type=click.FloatRange(1), help="Length of the ride.")
@click.option(
    "--pace", default=1.0, show_default=True, type=click.FloatRange(0, min_open=True), help="Times real time."
)
@click.option("--block", default=1, show_default=True, type=click.IntRange(1, 255), help="Samples per frame.")
@click.option("--text", is_flag=True, help="Lines of text instead of binary frames.")
@click.option("--noise", default=1.0, show_default=True, type=click.FloatRange(0), help="Times the usual noise.")
@click.option("--misbehave", metavar="NAME=VALUE,...", default="", help="drop=0.01,damage=0.01,unplug=5,restart=8, ...")
@click.option("--once", is_flag=True, help="Play once and end; else it plays again and again.")
@click.option(
    "--now", is_flag=True, help="Begin at once, not when somebody opens the port (as loggers that reset then)."
)
@options
def command(
    link: str | None, design: str | None, track: str, speed: float, seconds: float, pace: float, block: int, text: bool,
    noise: float, misbehave: str, once: bool, now: bool, call: Invocation,
) -> None:  # fmt: skip
    """Play a simulated ride as a logger on the bogie would send it, until ctrl-c.

    \b
    railui capture logger --link /tmp/logger --misbehave damage=0.01,unplug=5
    railui capture /tmp/logger -o monday

    Shares of frames: drop, damage, junk, repeat. Once, at a time [s]: restart, relayout (other channels), unplug,
    pause, huge_hello (claims 65535 channels), garble (as at a wrong baud rate). seed: of what happens by chance.
    """
    import json
    import tempfile

    from railui.capture import simulator
    from railui.capture.simulator.terminal import LEAVE, Terminal, play

    source = Path(design) if design else Path(simulator.__file__).with_name("demo.yaml")
    logger = _logger(source, track, speed, seconds, call.seed or 0, noise)
    logger = dataclasses.replace(logger, block=block, form="text" if text else "binary", faults=_faults(misbehave))
    with tempfile.TemporaryDirectory(prefix="railui-logger-") as home:
        terminal = Terminal(Path(link) if link else Path(home) / "logger")
        call.say(f"{terminal.link}: {len(logger.channels)} channels at {logger.rate:g} Hz, {seconds:g} s of ride")
        if not once and link is None:
            click.echo(str(terminal.link))
        if not now:
            terminal.await_reader(b"\n" if text else b"\0")
        try:
            play(logger, terminal, pace)
            while not once:
                play(dataclasses.replace(logger, faults=_faults("")), terminal, pace)
        finally:
            if once:
                terminal.await_empty(LEAVE)
            terminal.unplug()
            call.emit(call.document("capture_logger", {"sent": dataclasses.asdict(logger.truth)}, [source]))
            call.show(json.dumps(dataclasses.asdict(logger.truth)))


def _logger(source: Path, track: str, speed: float, seconds: float, seed: int, noise: float) -> Logger:
    """The logger of a simulated ride."""
    import numpy as np

    import railui
    from railui.capture.simulator.demo import Wheels, channels, sensed
    from railui.capture.simulator.logger import Logger
    from railui.runs.columns import COMPARED
    from railui.track import parse_spec
    from railui.vehicle.design_reader import load_design

    vehicle = load_design(source)
    length = np.ceil(speed * seconds)
    try:
        spec = parse_spec(f"{track} length={length:g} seed={seed} spacing={speed / RATE:.9g}")
    except ValueError as error:
        raise refuse(str(error)) from None
    line = spec.build()
    ride = railui.simulate(vehicle, line, speed, COMPARED)
    if not all(np.all(np.isfinite(ride[name])) for name in COMPARED):
        raise RuntimeError(f"{vehicle.name} leaves the track at {speed:g} m/s: lower the speed")
    ride |= {"v": np.full_like(ride["t"], speed), "phiw": line.phiw, "gauge": line.gauge}
    wheels = Wheels(
        vehicle.value("vehicle.geometry.half_wheelbase"),
        vehicle.value("vehicle.geometry.half_gauge"),
        (vehicle.value("contact.leading.roll"), vehicle.value("contact.trailing.roll")),
    )
    return Logger(channels(), sensed(ride, wheels, RATE, seed, noise), RATE)


def _faults(text: str) -> Faults:
    from railui.capture.simulator.logger import Faults
    from railui.io.problems import nearest

    known = {f.name: f for f in dataclasses.fields(Faults)}
    given: dict[str, float] = {}
    for pair in text.split(","):
        name, _, value = pair.strip().partition("=")
        if not pair.strip():
            continue
        if name not in known:
            raise refuse(f"--misbehave {name} is not known, {nearest(name, known)}")
        try:
            given[name] = int(value) if name == "seed" else float(value)
        except ValueError:
            raise refuse(f"--misbehave {pair}: write {name}=NUMBER") from None
    return Faults(**given)  # type: ignore[arg-type]
