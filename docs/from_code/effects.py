"""Page of the catalogue of effects: formula, source, parameters and force diagram of every record of the kernel."""

import io
from collections.abc import Iterator
from typing import Any

import matplotlib.pyplot as plt
import numpy as np
from markdown_text import code, plain, symbol, table

from railui.api.library import REFERENCE_BOGIE, resolve_parameter
from railui.core import effect_catalogue
from railui.io.number_format import format_quantity
from railui.report.loop.force_evaluation import restoring_force
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effects import site_quantities

AMPLITUDES = (1.5e-3, 3e-3, 5e-3)  # m
FREQUENCY = 1.6  # Hz: 10 rad/s, the reference motion of the defaults
INTRODUCTION = f"""# Catalogue of effects

Effects that the linear model lacks, each a law at a location. Simulation, structure detection, fitting, designs and reports use the
same record of the kernel; this page is generated from those records.

z is the deflection at the location, v its speed, F the force on the body above it. Defaults and ranges are those at the first
location for the bogie of the examples; `times` of `railui effects --json -` gives the quantity that they are multiples of. The diagrams
show the restoring force against a sinusoidal motion of {", ".join(f"{1e3 * a:g}" for a in AMPLITUDES)} mm at {FREQUENCY} Hz at
`primary_lateral` with the defaults, including the nominal spring (grey: the spring alone), computed by the kernel.

```yaml
effects:
  - {{kind: free_play, at: primary_lateral, wheelset: 2, half_width: 0.3 mm}}
```
"""


def page() -> str:
    """Return one section for each record, in the order of the kernel."""
    return INTRODUCTION + "".join(map(_section, effect_catalogue()))


def _section(record: dict[str, Any]) -> str:
    locations = [str(at) for at in record["at"]]
    kind, title = str(record["kind"]), str(record["title"])
    properties = [f"acts on: {record['acts']}", f"at {', '.join(map(code, locations))}"]
    properties += [f"replaces the nominal {record['supersedes']}"] if record["supersedes"] else []
    properties += ["has internal states"] if record["states"] else []
    properties += ["passive"] if record["dissipates"] else []
    properties += ["odd" if record["odd"] else "not odd"]
    properties += [] if record["candidate"] else ["not a candidate of the score test"]
    parts = [
        f"\n## {kind}\n\n{plain(title[0].upper() + title[1:])}; {'; '.join(properties)}.\n\n```\n{record['law']}\n```\n\n"
    ]
    rows = [_parameter(resolve_parameter(p, locations)) for p in record["parameters"]]
    parts.append(table(("key", "letter", "unit", "default", "range", "origin of the default"), rows))
    if _is_drawn(record):
        parts.append(f"\n![force against motion of {kind}](laws/{kind}.svg)\n")
    return "".join([*parts, f"\nSource: {plain(str(record['source']))}.\n"])


def _parameter(p: dict[str, Any]) -> tuple[str, ...]:
    def formatted(value: float | None) -> str:
        return "" if value is None else plain(format_quantity(value, p["unit"]))

    limits = f"{formatted(p['minimum'])} to {formatted(p['maximum'])}" if p["minimum"] is not None else ""
    return code(p["key"]), symbol(p["symbol"]), code(p["unit"]), formatted(p["default"]), limits, plain(p["origin"])


def _is_drawn(record: dict[str, Any]) -> bool:
    return (
        record["acts"] == "force"
        and {"primary_lateral", "rig"} <= set(record["at"])
        and record["kind"] != "measured_force"
    )


def pictures() -> Iterator[tuple[str, bytes]]:
    """Yield the force diagram of every suspension law as SVG."""
    for record in effect_catalogue():
        if _is_drawn(record):
            yield str(record["kind"]), _picture(record)


def _picture(record: dict[str, Any]) -> bytes:
    at = "primary_lateral"
    site = site_quantities(at, REFERENCE_BOGIE)
    values = {p["key"]: resolve_parameter(p, [at])["default"] for p in record["parameters"]}
    k = site["k"]
    effect = PlacedEffect(record["kind"], "rig", None, {key: x for key, x in values.items() if x is not None})
    t = np.linspace(0.0, 2.0 / FREQUENCY, 2000)
    figure, ax = plt.subplots(figsize=(4.6, 3.0), constrained_layout=True)
    for amplitude, shade in zip(AMPLITUDES, ("#9ecae1", "#4292c6", "#08519c"), strict=True):
        z = amplitude * np.sin(2 * np.pi * FREQUENCY * t)
        force, _ = restoring_force(z, t[1], [effect], k, 0.0)
        last_period = t >= 1.0 / FREQUENCY
        ax.plot(1e3 * z[last_period], 1e-3 * force[last_period], color=shade, lw=1.5)
    ax.plot(
        [-1e3 * z.max(), 1e3 * z.max()], [-1e-3 * k * z.max(), 1e-3 * k * z.max()], color="#999999", lw=0.9, ls="--"
    )
    ax.set(xlabel="deflection z [mm]", ylabel="resisting force [kN]")
    ax.spines[["top", "right"]].set_visible(False)
    with plt.rc_context({"svg.hashsalt": str(record["kind"])}):
        file = io.BytesIO()
        figure.savefig(file, format="svg", metadata={"Date": None})
    plt.close(figure)
    return file.getvalue()
