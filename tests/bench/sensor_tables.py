"""Tables of the page on sensors, from the stored figures."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

from railui.identification.estimation.identifiability import COMBINED, DETERMINED, ROUGH, UNSEEN
from tests.bench.growth import markdown_table

Figures = dict[str, Any]
WORSE = 1.1  # ratio from which a limit counts as changed


class Shown(NamedTuple):
    """An effect of the table: label, row of the minimum detectable effects, factor and unit of its number."""

    label: str
    kind: str
    at: str
    wheelset: int | None
    factor: float
    unit: str


SHOWN = (
    Shown("clearance, primary lateral, both wheelsets", "free_play", "primary_lateral", None, 1e3, "mm"),
    Shown("clearance, primary lateral, leading", "free_play", "primary_lateral", 1, 1e3, "mm"),
    Shown("clearance, primary yaw, both wheelsets", "free_play", "primary_yaw", None, 1e3, "mrad"),
    Shown("dry friction, primary lateral", "dry_friction", "primary_lateral", None, 1.0, "N"),
    Shown("dry friction, primary yaw", "dry_friction", "primary_yaw", None, 1e-3, "kN*m"),
    Shown("dry friction, secondary yaw", "dry_friction", "secondary_yaw", None, 1e-3, "kN*m"),
    Shown("hysteresis, primary yaw (yield)", "hysteresis", "primary_yaw", None, 1e-3, "kN*m"),
    Shown("cubic spring, primary lateral", "cubic_stiffness", "primary_lateral", None, 1e-12, "kN/mm^3"),
    Shown("bump stop, secondary lateral", "bump_stop", "secondary_lateral", None, 1e-6, "MN/m"),
    Shown("viscous damper, primary lateral", "viscous_damper", "primary_lateral", None, 1e-3, "kN*s/m"),
    Shown("damper with series spring, secondary yaw", "maxwell_damper", "secondary_yaw", None, 1e-6, "MN*m/rad"),
    Shown("flange contact, both wheelsets", "flange_contact", "contact", None, 1e-6, "MN/m"),
    Shown("creep saturation, both wheelsets (friction)", "creep_saturation", "contact", None, 1.0, "1"),
    Shown("nonlinear conicity, both wheelsets", "nonlinear_conicity", "contact", None, 1e-6, "1/mm^2"),
    Shown("conicity by gauge, both wheelsets", "gauge_conicity", "contact", None, 1e-3, "1/mm"),
    Shown("rail flexibility, both wheelsets", "rail_flexibility", "track", None, 1e-6, "MN/m"),
    Shown("run-out, leading wheelset", "run_out", "wheelset", 1, 1e-3, "kN"),
    Shown("gain of ayf, deviation from 1", "sensor_gain", "ayf", None, 1e2, "%"),
    Shown("delay of ayf", "sensor_delay", "ayf", None, 1e3, "ms"),
)
STRONGER_BELOW = ("friction",)  # parameters of which a smaller value is the larger effect
NAMES = {
    "contact.leading.": "leading ",
    "contact.trailing.": "trailing ",
    "contact.": "",
    "vehicle.primary.": "primary ",
    "vehicle.secondary.": "secondary ",
}


def page_text(figures: Figures) -> str:
    """Return headings, tables and summaries in the order of the page."""
    return "\n\n".join(_sections(figures)) + "\n"


def _sections(figures: Figures) -> Iterator[str]:
    sets = figures["sets"]
    runs = ", ".join(f"{t:.0f} s at {v:.0f} m/s" for t, v in zip(figures["durations"], figures["speeds"], strict=True))
    yield (
        f"{figures['date']}, railui at {figures['commit']}. Simulated campaign of `tests/truth`, "
        f"seed {figures['seed']}, no unmodelled effect: {runs}, the last for validation. "
        f"{len(sets[0]['parameters'])} parameters are estimated with every set. "
        "Figures of another campaign, vehicle or track differ."
    )
    yield "## Sets of sensors"
    yield _set_table(sets)
    yield "## Minimum detectable effects, 90 % nominal power"
    yield _effect_table(sets)
    yield "## Determined parameters"
    yield _parameter_table(sets)
    yield "## Does another sensor make anything worse?"
    yield _growth_table(sets)
    yield from _growth_sentences(sets)
    yield "## Delays"
    for row in sets:
        if row["reported_delays"] is not None:
            yield f"**{title(row)}**"
            yield _delay_table(row, figures["speeds"][0])
    yield "## Noise"
    yield _noise_table(sets[-1])


def title(row: Figures) -> str:
    """Name a set by its channels."""
    return " ".join(row["channels"])


def _set_table(sets: Sequence[Figures]) -> str:
    cells = [
        (str(i), title(r), f"{r['error']:.3f}", f"{r['floor']:.3f}", str(_counted(r, DETERMINED)))
        for i, r in enumerate(sets, 1)
    ]
    header = (
        "set",
        "channels, besides t, s, v, yw, phiw, gauge",
        "NRMSE",
        "noise floor",
        "parameters determined to 10 %",
    )
    return markdown_table(header, cells)


def _counted(row: Figures, word: str) -> int:
    return sum(p["class"] == word for p in row["parameters"].values())


def _effect(row: Figures, shown: Shown, key: str = "value") -> tuple[float | None, str]:
    """Minimum detectable value of a shown effect and its parameter."""
    effect = next(e for e in row["effects"] if (e["kind"], e["at"], e["wheelset"]) == shown[1:4])
    value = effect[key]
    if value is not None and effect["parameter"] == "gain":
        value = abs(value - 1.0)
    return value, effect["parameter"]


def is_inverse(kind: str, parameter: str) -> bool:
    """True where a smaller value of the parameter is the larger effect."""
    return parameter in STRONGER_BELOW or kind == "rail_flexibility"


def _effect_table(sets: Sequence[Figures]) -> str:
    cells = []
    for shown in SHOWN:
        parameter = _effect(sets[0], shown)[1]
        bound = "up to" if is_inverse(shown.kind, parameter) else "from"
        values = [_effect(r, shown)[0] for r in sets]
        numbers = ["-" if x is None else f"{x * shown.factor:.3g}" for x in values]
        cells.append((f"{shown.label}: {parameter} [{shown.unit}]", bound, *numbers))
    return markdown_table(("effect", "found", *_set_numbers(sets)), cells)


def _set_numbers(sets: Sequence[Figures]) -> list[str]:
    return [f"set {i}" for i in range(1, len(sets) + 1)]


def _parameter_table(sets: Sequence[Figures]) -> str:
    forms = {DETERMINED: "{} %", ROUGH: "({} %)", COMBINED: "combination", UNSEEN: "-"}
    cells = []
    for path in sets[0]["parameters"]:
        found = [r["parameters"][path] for r in sets]
        cells.append((_short(path), *(forms[p["class"]].format(f"{100 * p['sd']:.2g}") for p in found)))
    return markdown_table(("parameter", *_set_numbers(sets)), cells)


def _short(path: str) -> str:
    prefix = next(p for p in NAMES if path.startswith(p))
    return NAMES[prefix] + path.removeprefix(prefix).replace("_", " ")


def nested_pairs(sets: Sequence[Figures]) -> list[tuple[int, int]]:
    """Pairs of sets of which the second contains the first, and no third lies between them."""
    channels = [set(r["channels"]) for r in sets]
    pairs = [(i, k) for i, a in enumerate(channels) for k, b in enumerate(channels) if a < b]
    return [(i, k) for i, k in pairs if not any(channels[i] < c < channels[k] for c in channels)]


def effect_ratios(small: Figures, large: Figures, key: str) -> dict[str, float]:
    """Size of the minimum detectable effect with the larger set over that with the smaller, by the label of SHOWN."""
    ratios = {}
    for shown in SHOWN:
        (a, parameter), (b, _) = _effect(small, shown, key), _effect(large, shown, key)
        if a is not None and b is not None:
            ratios[shown.label] = a / b if is_inverse(shown.kind, parameter) else b / a
    return ratios


def parameter_ratios(small: Figures, large: Figures) -> dict[str, float]:
    """Relative standard deviation with the larger set over that with the smaller, of what either determines."""
    pairs = {p: (a, large["parameters"][p]) for p, a in small["parameters"].items()}
    used = {p: x for p, x in pairs.items() if any(one["class"] in (DETERMINED, ROUGH) for one in x)}
    return {_short(p): b["sd"] / a["sd"] for p, (a, b) in used.items()}


def _growth_table(sets: Sequence[Figures]) -> str:
    cells = []
    for i, k in nested_pairs(sets):
        added = " ".join(c for c in sets[k]["channels"] if c not in sets[i]["channels"])
        ratios = (
            parameter_ratios(sets[i], sets[k]),
            effect_ratios(sets[i], sets[k], "score_only"),
            effect_ratios(sets[i], sets[k], "value"),
        )
        cells.append((f"{i + 1} to {k + 1}: {added}", *map(_change, ratios)))
    header = ("step: added", "standard deviations of parameters", "score test alone", "minimum detectable effects")
    return markdown_table(header, cells)


def _change(ratios: dict[str, float]) -> str:
    better = sum(r < 1.0 / WORSE for r in ratios.values())
    worse = sum(r > WORSE for r in ratios.values())
    return f"{better} smaller, {worse} larger of {len(ratios)}"


def _growth_sentences(sets: Sequence[Figures]) -> Iterator[str]:
    """Greatest change for the worse of each kind of figure, and the whole way from the first set to the last."""
    yield "Changes by less than 10 % count as none. The largest change for the worse:"
    lines = []
    for name, ratios in (
        ("standard deviation", parameter_ratios),
        ("score test alone", lambda a, b: effect_ratios(a, b, "score_only")),
        ("minimum detectable effect", lambda a, b: effect_ratios(a, b, "value")),
    ):
        found = [(r, label, i, k) for i, k in nested_pairs(sets) for label, r in ratios(sets[i], sets[k]).items()]
        r, label, i, k = max(found)
        lines.append(f"- {name}: {label}, times {r:.2f} from set {i + 1} to {k + 1}")
    yield "\n".join(lines)
    whole = effect_ratios(sets[0], sets[-1], "value")
    alone = effect_ratios(sets[0], sets[-1], "score_only")
    yield (
        f"From set 1 to set {len(sets)}: minimum detectable effects {_change(whole)}; by the score test alone "
        f"{_change(alone)}; standard deviations {_change(parameter_ratios(sets[0], sets[-1]))}."
    )


def _delay_table(row: Figures, speed: float) -> str:
    cells = []
    for name, x in row["delays"].items():
        reported = row["reported_delays"][name]
        where = f"track ({1e-3 * speed:.2g} m per ms)" if name == "track" else name
        cells.append(
            (
                where,
                f"{1e3 * x['doubled_error']:.1f}",
                f"{1e3 * x['biased']:.2f} ({_short(x['parameter'])})",
                f"{0.1 * x['shift']:.2g} % ({_short(x['shifted'])})",
                "none up to 100" if reported is None else f"{1e3 * reported:.0f}",
            )
        )
    header = (
        "late record",
        "error doubles [ms]",
        "a parameter shifts by its sd [ms]",
        "shift by 1 ms",
        "reported from [ms]",
    )
    return markdown_table(header, cells)


def _noise_table(row: Figures) -> str:
    scale = {"e": (1e3, "mm"), "d": (1e3, "mm"), "a": (1.0, "m/s^2"), "r": (1e3, "mrad/s")}
    cells = []
    for c, x in row["noise"].items():
        factor, unit = scale[c[0]]
        values = [f"{factor * x[k]:.3g}" for k in ("signal", "sensor", "track", "total", "sufficient")]
        cells.append((f"{c} [{unit}]", *values))
    header = (
        "channel",
        "signal in the band",
        "sensor noise in the band",
        "from track noise",
        "sensor noise, all",
        "sufficient",
    )
    return markdown_table(header, cells)
