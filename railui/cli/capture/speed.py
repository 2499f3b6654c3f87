"""railui capture speed: processor time of recording and decoding."""

from __future__ import annotations

import click

from railui.cli.invocation import Invocation, common_options


@click.command("speed")
@click.option("--baud", default=921600, show_default=True, type=click.IntRange(9600), help="Baud rate of the line.")
@click.option("--seconds", default=60.0, show_default=True, type=click.FloatRange(1), help="Duration of the data.")
@click.option("--channels", default=12, show_default=True, type=click.IntRange(1, 64), help="16-bit channels.")
@click.option("--block", default=1, show_default=True, type=click.IntRange(1, 255), help="Samples per frame.")
@click.option("--live", is_flag=True, help="Record over a pseudo-terminal at that speed; else decode alone.")
@common_options
def command(baud: int, seconds: float, channels: int, block: int, live: bool, call: Invocation) -> None:
    """Measure the processor time of a line at full capacity (8N1), decoded and written as in a recording."""
    from railui.capture.recorder.speed import measure_decoding, measure_recording

    cost = (measure_recording if live else measure_decoding)(baud, seconds, channels, block)
    call.show(
        f"{cost.bytes} bytes, {cost.frames} frames, {cost.samples} samples, {cost.lost} lost: "
        f"{cost.cpu:.2f} s of processor for {seconds:g} s at {baud} baud, {100 * cost.cpu / seconds:.1f} % of one core"
    )
    body = {"bytes": cost.bytes, "frames": cost.frames, "samples": cost.samples, "lost": cost.lost, "cpu_s": cost.cpu}
    document = {**body, "baud": baud, "seconds": seconds, "share": cost.cpu / seconds}
    call.write_json(call.document("capture_speed", document))
