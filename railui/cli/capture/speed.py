"""railui capture speed: what recording and decoding cost, in processor time."""

from __future__ import annotations

import click

from railui.cli.common import Invocation, options


@click.command("speed")
@click.option("--baud", default=921600, show_default=True, type=click.IntRange(9600), help="Bytes for this rate.")
@click.option("--seconds", default=60.0, show_default=True, type=click.FloatRange(1), help="So many seconds of them.")
@click.option("--channels", default=12, show_default=True, type=click.IntRange(1, 64), help="16-bit channels.")
@click.option("--block", default=1, show_default=True, type=click.IntRange(1, 255), help="Samples per frame.")
@click.option("--live", is_flag=True, help="Over a pseudo-terminal at that pace, as a recording; else decoding alone.")
@options
def command(baud: int, seconds: float, channels: int, block: int, live: bool, call: Invocation) -> None:
    """Measure the processor time of a full line: bytes as 8N1 passes them, decoded and written as they are always."""
    from railui.capture.recorder.speed import decoding_cost, recording_cost

    cost = (recording_cost if live else decoding_cost)(baud, seconds, channels, block)
    call.show(
        f"{cost.bytes} bytes, {cost.frames} frames, {cost.samples} samples, {cost.lost} lost: "
        f"{cost.cpu:.2f} s of processor for {seconds:g} s at {baud} baud, {100 * cost.cpu / seconds:.1f} % of one core"
    )
    body = {"bytes": cost.bytes, "frames": cost.frames, "samples": cost.samples, "lost": cost.lost, "cpu_s": cost.cpu}
    call.emit(call.document("capture_speed", {**body, "baud": baud, "seconds": seconds, "share": cost.cpu / seconds}))
