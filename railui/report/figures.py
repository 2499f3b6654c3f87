"""Figures of the loop report: errors, series and spectra, and the laws found, as SVG that needs nothing beside it."""

from __future__ import annotations

import base64
import io
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy import signal
from scipy.interpolate import CubicSpline

from railui import core
from railui.core import Batch, Placement, Vehicles
from railui.files.columns import columns_of
from railui.files.design import PlacedEffect
from railui.files.display import suited
from railui.files.effect_records import unit_at
from railui.study.judge import initial_state
from railui.study.loop import Found
from railui.study.measured import COMPARED, RIG_RESPONSES, Stretch, cut_samples, filtered, simulate
from railui.study.model import Model, effect_row

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Floats = NDArray[np.float64]

# Okabe and Ito's colours; lines differ in dash and width too, bars in hatching
COLOURS = {"declared": "#b3b3b3", "before": "#d55e00", "after": "#0072b2", "floor": "#ffffff", "measured": "#b0b0b0"}
LINES: dict[str, dict[str, Any]] = {
    "measured": {"color": COLOURS["measured"], "lw": 2.6, "solid_capstyle": "round"},
    "before": {"color": COLOURS["before"], "lw": 1.0, "ls": (0, (4, 1.5))},
    "after": {"color": COLOURS["after"], "lw": 1.0},
}
STYLE = {
    "svg.fonttype": "none",
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.edgecolor": "#666666",
    "axes.linewidth": 0.7,
    "axes.grid": True,
    "grid.color": "#e6e6e6",
    "grid.linewidth": 0.6,
    "axes.axisbelow": True,
    "axes.titlesize": 9,
    "axes.titlelocation": "left",
    "xtick.color": "#444444",
    "ytick.color": "#444444",
    "path.simplify_threshold": 0.3,
}
FIRST = ("e1", "ay1", "ayf", "d1")  # drawn first where they were measured
MARGINS = (0.66, 0.12, 0.42, 0.24)  # inch: left, right, bottom, top
SHOWN = 5.0  # s of a series
PERIODS = 25  # of a rig's main frequency, which may be anything
POINTS = 2500  # of a line
HEAVY = 1e9  # times the mass of the vehicle: a bench that its forces do not move
FUNCTION = 0.98  # share explained by the motion from which a law is drawn as a curve, not as a path


@dataclass(frozen=True)
class Picture:
    """One figure: what it shows, in words for those who do not see it, and its SVG."""

    name: str
    alt: str
    svg: bytes

    @property
    def source(self) -> str:
        """The figure as an address that holds it whole."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg).decode("ascii")


def drawn(name: str, alt: str, size: tuple[float, float], draw: Callable[[Axes], None]) -> Picture:
    """A figure of one pair of axes, size [inch]."""
    import matplotlib
    from matplotlib.figure import Figure

    with matplotlib.rc_context({**STYLE, "svg.hashsalt": name}):  # type: ignore[arg-type]
        figure = Figure(figsize=size)
        left, right, bottom, top = MARGINS
        ax = figure.add_axes((left / size[0], bottom / size[1], 1 - (left + right) / size[0], 1 - (bottom + top) / size[1]))
        ax.yaxis.set_label_coords(-(left - 0.14) / (size[0] - left - right), 0.5)
        draw(ax)
        out = io.BytesIO()
        figure.savefig(out, format="svg", metadata={"Date": None, "Creator": None})
    # matplotlib measures with its own font; a reader without it gets a narrower one
    return Picture(name, alt, out.getvalue().replace(b"'DejaVu Sans'", b"Helvetica, Arial, 'DejaVu Sans', sans-serif"))


def pretty(unit: str) -> str:
    """A unit as it is printed.

    >>> pretty("kN*s^2/m^2"), pretty("1")
    ('kN·s²/m²', '')
    """
    return "" if unit == "1" else unit.replace("*", "·").replace("^2", "²").replace("^3", "³")


def scale(values: Any, unit: str) -> tuple[float, str]:
    """What SI values are multiplied by to be read, and the unit they then have."""
    given = np.abs(np.asarray([v for v in np.ravel(values) if v is not None], dtype=float))
    largest = float(given[np.isfinite(given)].max(initial=0.0))
    if largest == 0:
        return 1.0, pretty(unit)
    number, name = suited(largest, unit)
    return number / largest, pretty(name)


def axis(name: str, unit: str) -> str:
    """The label of an axis."""
    return f"{name} [{unit}]" if unit else name


def place(at: str, wheelset: int | None = None) -> str:
    """A place in words."""
    return at.replace("_", " ") + (f", wheelset {wheelset}" if wheelset else "")


# errors


def error_bars(report: Mapping[str, Any]) -> Picture:
    """Error of every channel and of all: declared, before, after, floor."""
    channels = ["all", *report["declared"]["channels"]]
    which = ("declared", "before", "after", "floor")

    def value(w: str, c: str) -> float | None:
        found: float | None = report[w]["nrmse"] if c == "all" else report[w]["channels"].get(c)
        return found

    def draw(ax: Axes) -> None:
        for i, w in enumerate(which):
            heights = [value(w, c) for c in channels]
            x = np.arange(len(channels)) + 0.2 * (i - 1.5)
            hatch = "////" if w == "floor" else None
            ax.bar(x, [h or 0.0 for h in heights], 0.19, color=COLOURS[w], label=w, hatch=hatch,
                   edgecolor="#555555" if hatch else "none", linewidth=0.6)  # fmt: skip
            for at, h in zip(x, heights, strict=True):
                if h is None:
                    ax.text(at, 0.0, " diverged", rotation=90, ha="center", va="bottom", fontsize=7)
        ax.axvline(0.5, color="#999999", lw=0.7)
        ax.set_xticks(np.arange(len(channels)), channels)
        ax.set_xlim(-0.5, len(channels) - 0.5)
        ax.grid(axis="x", visible=False)
        ax.tick_params(axis="x", length=0)
        ax.set_ylabel("error (nrmse)")
        ax.legend(ncols=4, frameon=False, loc="lower left", bbox_to_anchor=(0.0, 1.0), borderaxespad=0.2)

    alt = "Bars of the error of every channel: declared, before, after, noise floor"
    return drawn("errors", alt, (7.2 if len(channels) > 4 else 5.0, 2.7), draw)


# series and spectra


@dataclass(frozen=True, eq=False)
class Window:
    """A telling piece of a validating stretch: rows [begin, end) of what is left after the cut."""

    index: int
    stretch: Stretch
    begin: int
    end: int

    def rows(self, cut: int) -> slice:
        """The same rows of the whole stretch."""
        return slice(self.begin + cut, self.end + cut)


def compared_series(found: Found, index: int) -> dict[str, Floats]:
    """measured, before, after of a validating stretch in the band of the comparison, each [channel, kept]."""
    stretch, campaign = found.measurement.validate[index], found.measurement.campaign
    series = {"measured": stretch.measured(stretch.channels)}
    series |= {w: found.judged[w].series[index] for w in ("before", "after")}
    return {w: filtered(campaign, stretch, x) for w, x in series.items() if np.all(np.isfinite(x))}


def telling(found: Found) -> Window:
    """Where the vehicle as found does better than before by most; where nothing was added, where it moves most."""
    best: tuple[float, Window] | None = None
    for index, stretch in enumerate(found.measurement.validate):
        series = compared_series(found, index)
        x = series["measured"]
        power = np.maximum(x.var(axis=1, keepdims=True), 1e-300)
        gain = np.sum(x**2 / power, axis=0)
        if found.before is not found.after and {"before", "after"} <= set(series):
            gain = np.sum(((x - series["before"]) ** 2 - (x - series["after"]) ** 2) / power, axis=0)
        width = max(2, min(x.shape[1], round(_seconds(stretch) / stretch.dt)))
        sums = np.cumsum(np.concatenate([[0.0], gain]))
        gains = sums[width:] - sums[:-width]
        at = int(np.argmax(gains))
        if best is None or gains[at] > best[0]:
            best = float(gains[at]), Window(index, stretch, at, at + width)
    assert best is not None  # a campaign without validating runs is refused when it is read
    return best[1]


def _seconds(stretch: Stretch) -> float:
    if stretch.kind != "rig":
        return SHOWN
    f, density = signal.periodogram(stretch.columns[stretch.channels[0]], 1.0 / stretch.dt)
    return float(min(SHOWN, PERIODS / f[1 + int(np.argmax(density[1:]))]))


def shown_channels(stretch: Stretch) -> list[str]:
    """The compared channels of a stretch, those that tell most first."""
    judged = [c for c in stretch.channels if c in COMPARED or c in RIG_RESPONSES]
    return [*(c for c in FIRST if c in judged), *(c for c in judged if c not in FIRST)]


def channel_unit(stretch: Stretch, channel: str) -> str:
    """SI unit of a channel; none for a rig, whose numbers are in the units of its run."""
    return columns_of(stretch.kind)[channel].unit


def series_picture(found: Found, window: Window, series: Mapping[str, Floats], channel: str) -> Picture:
    """A few seconds of one channel: measured, before, after."""
    stretch = window.stretch
    row = stretch.channels.index(channel)
    piece = slice(window.begin, window.end, max(1, (window.end - window.begin) // POINTS))
    t = stretch.columns["t"][cut_samples(found.measurement.campaign, stretch) :]
    factor, unit = scale(series["measured"][row, piece], channel_unit(stretch, channel))

    def draw(ax: Axes) -> None:
        for which, line in LINES.items():
            if which in series:
                ax.plot(t[piece], factor * series[which][row, piece], **line)
        ax.margins(x=0)
        ax.set_xlabel("time [s]")
        ax.set_ylabel(axis(channel, unit))

    return drawn(f"series-{channel}", f"{channel} over time: measured, before, after", (5.4, 2.0), draw)


def spectrum_picture(found: Found, window: Window, channel: str) -> Picture:
    """Power spectral density of one channel over the whole stretch."""
    stretch, band = window.stretch, found.measurement.campaign.band
    row = stretch.channels.index(channel)
    lines = {"measured": stretch.columns[channel]}
    lines |= {w: found.judged[w].series[window.index][row] for w in ("before", "after")}
    factor, unit = scale(stretch.columns[channel].std(), channel_unit(stretch, channel))
    highest = 0.5 / stretch.dt if band is None else min(1.5 * band[1], 0.5 / stretch.dt)

    def draw(ax: Axes) -> None:
        for which, line in LINES.items():
            if which in lines and np.all(np.isfinite(lines[which])):
                segment = min(stretch.samples, max(256, stretch.samples // 5))
                f, density = signal.welch(lines[which], 1.0 / stretch.dt, nperseg=segment)
                kept = slice(1, np.searchsorted(f, highest))
                ax.loglog(f[kept], factor**2 * density[kept], **line)
        ax.margins(x=0)
        for low, high in ((0.0, band[0]), (band[1], np.inf)) if band else ():
            left, right = ax.get_xlim()
            ax.axvspan(max(low, left), min(high, right), color="#f1f1f1", lw=0, zorder=0)
            ax.set_xlim(left, right)
        _plain_decades(ax)
        ax.set_xlabel("frequency [Hz]")
        ax.set_ylabel(f"[({unit})²/Hz]" if unit else "[1/Hz]")

    return drawn(f"spectrum-{channel}", f"Spectrum of {channel}: measured, before, after", (4.2, 2.0), draw)


def _plain_decades(ax: Axes) -> None:
    """Frequencies as plain numbers, densities with few decades labelled and no mathematics in the text."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    digits = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
    ax.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:g}"))
    ax.yaxis.set_major_locator(LogLocator(numticks=5))
    ax.yaxis.set_major_formatter(FuncFormatter(lambda x, _: "10" + f"{round(np.log10(x))}".translate(digits)))
    for one in (ax.xaxis, ax.yaxis):
        one.set_minor_formatter(NullFormatter())


# the laws: the kernel itself is the bench on which they are driven through the motion that was seen


@dataclass(frozen=True, eq=False)
class Law:
    """What is drawn of an effect: a heading, its pictures, and what they show."""

    title: str
    pictures: tuple[Picture, ...]
    note: str


@dataclass(frozen=True, eq=False)
class _Scene:
    """The vehicle as found on the stretch that is shown."""

    found: Found
    window: Window
    start: Floats

    @property
    def stretch(self) -> Stretch:
        return self.window.stretch

    @property
    def piece(self) -> slice:
        """The rows that are shown."""
        return self.window.rows(cut_samples(self.found.measurement.campaign, self.stretch))

    @property
    def settled(self) -> slice:
        """All rows but those in which the initial state dies away."""
        cut = cut_samples(self.found.measurement.campaign, self.stretch)
        return slice(cut, self.stretch.samples - cut)

    def motion(self, channels: Sequence[str], model: Model | None = None) -> Floats:
        """Channels [channel, n] of the vehicle as found (or another of its structure)."""
        return simulate(model or self.found.after.model, self.stretch, channels, initial=self.start)[0][0]


def law_figures(found: Found, report: Mapping[str, Any], window: Window) -> list[Law]:
    """Every effect of the vehicle as found over the motion actually seen, and the measured curve of `outside`."""
    model = found.after.model
    scene = _Scene(found, window, initial_state(model, window.stretch, found.measurement.noise))
    laws = [_outside(scene, report["outside"])] if report["outside"] else []
    for i, effect in enumerate(model.effects):
        if effect.kind != "measured_force":
            laws.append(_law(scene, effect, f"law-{i}"))
    return laws


def _law(scene: _Scene, effect: PlacedEffect, name: str) -> Law:
    record = core.record(effect.kind)
    title = f"{record['title']}: {place(effect.at, effect.wheelset)}"
    if record["acts"] == "sensor":
        return _sensor(scene, effect, name, title)
    if "rig" in record["at"]:
        return _suspension(scene, effect, name, title)
    if record["acts"] == "body":
        return _coach(scene, name, title)
    if effect.at in ("contact", "track"):
        return _contact(scene, effect, name, title)
    return _outer(scene, effect, name, title)


def resisted(z: Floats, dt: float, mass: float, effects: Sequence[PlacedEffect], k: float, c: float) -> Floats:
    """The force [n] with which effects beside a spring and a damper resist a motion z [n], and its speed: [2, n].

    The kernel's own laws: they stand under a mass that they cannot move, on a base that makes the motion.
    """
    t = dt * np.arange(len(z))
    bench = Stretch("", "", 0, {"t": t, "u": -z}, dt, "rig")
    vehicles = Vehicles("rig", [Placement(e.kind, "rig", None, len(effect_row(e))) for e in effects])
    numbers = np.array([[HEAVY * mass, k, c, 1.0, core.RIG_INPUTS["base_displacement"]]])
    tail = np.array([[x for e in effects for x in effect_row(e)]])
    batch = Batch.of(numbers, tail, np.ones((1, len(effects))))
    start = np.zeros(vehicles.states(batch))
    start[:2] = z[0], CubicSpline(t, z)(0.0, 1)
    steps = vehicles.steps(batch, 1.0, 1.0, dt)[0]
    series, _ = vehicles.simulate(batch.with_initial(start), bench.table(0.0, steps), dt, steps, ["v.rig.0", "az"])
    return np.stack([-HEAVY * mass * series[0, 1], series[0, 0]])


def _mass(model: Model) -> float:
    values = model.design.values
    return values.get("vehicle.frame.mass") or values["vehicle.rig.mass"]


def _at(model: Model, at: str, wheelset: int) -> tuple[list[PlacedEffect], float, float]:
    """Effects, spring and damper of a model at one port."""
    here = [e for e in model.design.effects if e.at == at and e.wheelset in (None, wheelset)]
    k, c = model.vehicles().sites(model.single())[(at, wheelset)]
    return [e for e in here if "rig" in core.record(e.kind)["at"]], k, c


def _port(scene: _Scene, at: str, wheelset: int | None) -> tuple[int, Floats]:
    """The port of an effect (that which moves most, where it has two) and its motion z."""
    sites = scene.found.after.model.vehicles().sites(scene.found.after.model.single())
    linkage = wheelset is None and (at, 3) in sites
    ports = [w for a, w in sites if a == at and ((w == 3) if linkage else w < 3 and wheelset in (None, w))]
    motion = scene.motion([f"z.{at}.{w}" for w in ports])
    best = int(np.argmax(motion.std(axis=1)))
    return ports[best], motion[best]


def _suspension(scene: _Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """Whole force of the place against displacement, and the effect's own against what rules it."""
    at, (w, z) = effect.at, _port(scene, effect.at, effect.wheelset)
    dt, mass = scene.stretch.dt, _mass(scene.found.after.model)
    kept = scene.settled
    here, k, c = _at(scene.found.after.model, at, w)
    whole, v = resisted(z, dt, mass, here, k, c)
    was, _ = resisted(z, dt, mass, *_at(scene.found.before.model, at, w))
    superseded = str(core.record(effect.kind)["supersedes"] or "")
    own = resisted(z, dt, mass, [effect], k, c)[0] - resisted(z, dt, mass, [], k, c)[0]
    own = own + ("stiffness" in superseded) * k * z + ("damping" in superseded) * c * v
    z_unit, v_unit, f_unit = (unit_at(word, at) for word in ("z", "v", "F"))
    here_name = place(at, w if w in (1, 2) else None)
    curves = {"before": (z, was), "after": (z, whole)}
    pictures = [_force_picture(scene, name, f"whole force, {here_name}", curves, ("z", z_unit), f_unit)]
    if np.std(own - whole) > 0.01 * np.std(whole):
        ruled, x, unit = ("z", z, z_unit)
        if _explained(v[kept], own[kept]) > _explained(z[kept], own[kept]):
            ruled, x, unit = "v", v, v_unit
        alone = {"after": (x, own)}
        pictures.append(_force_picture(scene, f"{name}-own", "the effect alone", alone, (ruled, unit), f_unit))
    return Law(title, tuple(pictures), "Force that resists the motion, over the motion of the validating run.")


def _explained(x: Floats, y: Floats, bins: int = 100) -> float:
    """Share of the variance of y that x rules, from quantile bins."""
    parts = np.array_split(y[np.argsort(x)], min(bins, len(x)))
    within = sum(float(np.sum((p - p.mean()) ** 2)) for p in parts)
    total = float(np.sum((y - y.mean()) ** 2))
    return 1.0 - within / total if total > 0 else 1.0


def _force_picture(
    scene: _Scene, name: str, title: str, curves: Mapping[str, tuple[Floats, Floats]], motion: tuple[str, str], unit: str
) -> Picture:
    """Force against motion: a curve where the motion rules it, else the path of the seconds shown."""
    words = {"z": "displacement z", "v": "speed v", "e": "displacement e from the rails"}[motion[0]]
    seen = next(iter(curves.values()))[0][scene.settled]
    x_scale, x_unit = scale(seen, motion[1])
    y_scale, y_unit = scale([y[scene.settled] for _, y in curves.values()], unit)

    def draw(ax: Axes) -> None:
        for which, (x, y) in curves.items():
            a, b = x[scene.settled], y[scene.settled]
            if _explained(a, b) >= FUNCTION:
                order = np.argsort(a)
                order = order[:: max(1, len(order) // POINTS)]
                a, b = a[order], b[order]
            else:
                a, b = x[scene.piece], y[scene.piece]
            ax.plot(x_scale * a, y_scale * b, **LINES[which] | {"lw": 1.4})
        _seen(ax, x_scale * seen)
        ax.set_title(title)
        ax.set_xlabel(axis(words, x_unit))
        ax.set_ylabel(axis("moment" if unit.endswith("*m") else "force", y_unit))

    return drawn(name, f"{title}: force against {words}", (4.7, 3.0), draw)


def _seen(ax: Axes, x: Floats) -> None:
    """How often each motion was seen, as a grey hill at the foot of the axes."""
    counts, edges = np.histogram(x, bins=60)
    middle = 0.5 * (edges[1:] + edges[:-1])
    ax.fill_between(middle, 0.18 * counts / max(counts.max(), 1), color="#dddddd", lw=0, zorder=0,
                    transform=ax.get_xaxis_transform())  # fmt: skip


def _held(scene: _Scene, model: Model, moved: bool) -> dict[str, Floats]:
    """Forces and moments [n] on both wheelsets of a vehicle too heavy to move: Y1, Y2, M1, M2.

    moved: the rails are moved under it so that e is what was seen; else they lie straight.
    """
    stretch, columns = scene.stretch, model.columns
    vehicles = model.vehicles(stretch.coach_forces)
    row = model.row.copy()
    masses = [p for p in columns if p.startswith("vehicle.") and p.endswith(("mass", "yaw_inertia"))]
    row[[columns[p] for p in masses]] *= HEAVY
    batch = model.batch(row[None])
    steps = vehicles.steps(batch, *stretch.speeds, stretch.dt)[0]
    table = stretch.table(model.half_wheelbase(), steps).copy()
    table[:, [2, 3, 4, 5, 7, 8, 9, 10]] = 0.0
    if moved:
        at = np.arange(len(table)) * (stretch.dt / (2 * steps))
        e = scene.motion(["e1", "e2"])
        spline = CubicSpline(stretch.dt * np.arange(stretch.samples), -e, axis=1)
        for i, column in enumerate((2, 7)):
            table[:, column] = spline(at)[i]
            table[:, column + 1] = spline(at, 1)[i] / table[:, 1]
    channels = ["ay1", "ay2", "v.wheelset_yaw.1", "v.wheelset_yaw.2"]
    series = vehicles.simulate(batch, table, stretch.dt, steps, channels)[0][0]
    m = row[columns["vehicle.wheelset.mass"]]
    inertia = row[columns["vehicle.wheelset.yaw_inertia"]]
    turned = inertia * np.gradient(series[2:], stretch.dt, axis=1)
    return {"Y1": m * series[0], "Y2": m * series[1], "M1": turned[0], "M2": turned[1]}


def _contact(scene: _Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """Lateral force and yaw moment of the contact on a wheelset held straight, against e."""
    w = effect.wheelset or 1
    e = scene.motion([f"e{w}"])[0]
    model = scene.found.after.model
    others = Model(model.design.with_effects(x for x in model.design.effects if x is not effect))
    now, was, linear = (_held(scene, m, True) for m in (model, scene.found.before.model, others))
    pictures = []
    for key, unit, words in (("Y", "N", "lateral force"), ("M", "N*m", "yaw moment")):
        f, without = now[f"{key}{w}"], linear[f"{key}{w}"]
        if np.std(f - without) > 0.02 * np.std(without):
            curves = {"before": (e, was[f"{key}{w}"]), "after": (e, f)}
            caption = f"{words} of the rails on wheelset {w}"
            pictures.append(_contact_picture(scene, f"{name}-{key}", caption, curves, unit, w))
    note = "The rails moved under a wheelset held straight, as far as they were seen to move."
    return Law(title, tuple(pictures), note)


def _contact_picture(
    scene: _Scene, name: str, title: str, curves: Mapping[str, tuple[Floats, Floats]], unit: str, wheelset: int
) -> Picture:
    """As `_force_picture`; where e alone does not rule the force, points coloured by the gauge."""
    x, y = curves["after"]
    gauge = scene.stretch.columns.get("gauge")
    kept = scene.settled
    if gauge is None or not np.any(gauge) or _explained(x[kept], y[kept]) >= FUNCTION:
        return _force_picture(scene, name, title, curves, ("e", "m"), unit)
    s = scene.stretch.columns["s"]
    back = 2.0 * scene.found.after.model.half_wheelbase() * (wheelset - 1)
    under = np.interp(s - back, s, gauge)
    some = np.arange(scene.stretch.samples)[kept][:: max(1, scene.stretch.samples // 1500)]
    x_scale, x_unit = scale(x, "m")
    y_scale, y_unit = scale(y, unit)
    g_scale, g_unit = scale(under, "m")

    def draw(ax: Axes) -> None:
        dots = ax.scatter(x_scale * x[some], y_scale * y[some], s=5, c=g_scale * under[some], cmap="cividis", lw=0)
        order = np.argsort(curves["before"][0][some])
        ax.plot(x_scale * x[some][order], y_scale * curves["before"][1][some][order], **LINES["before"] | {"lw": 1.4})
        ax.figure.colorbar(dots, ax=ax, label=axis("gauge deviation", g_unit), pad=0.02)
        _seen(ax, x_scale * x[kept])
        ax.set_title(title)
        ax.set_xlabel(axis("displacement e from the rails", x_unit))
        ax.set_ylabel(axis("moment" if unit.endswith("*m") else "force", y_unit))

    return drawn(name, f"{title} against e, coloured by the gauge", (4.7, 3.0), draw)


def _outer(scene: _Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """A force that hangs on the way alone: on a wheelset held still, against distance."""
    w, key, unit = effect.wheelset or 1, "M" if effect.at.endswith("_yaw") else "Y", unit_at("F", effect.at)
    if not effect.at.startswith("wheelset"):
        return Law(title, (), "A constant: there is no curve to draw.")
    f = _held(scene, Model(scene.found.after.model.design.with_effects([effect])), False)[f"{key}{w}"]
    s = scene.stretch.columns["s"][scene.piece]
    radius = scene.found.after.model.design.values["vehicle.geometry.rolling_radius"]
    some = s <= s[0] + 8 * np.pi * radius
    factor, name_of = scale(f, unit)

    def draw(ax: Axes) -> None:
        ax.plot(s[some], factor * f[scene.piece][some], **LINES["after"] | {"lw": 1.4})
        ax.margins(x=0)
        ax.set_title(f"force on wheelset {w}")
        ax.set_xlabel("distance [m]")
        ax.set_ylabel(axis("moment" if key == "M" else "force", name_of))

    picture = drawn(name, f"{title}: force against distance", (4.7, 3.0), draw)
    return Law(title, (picture,), "Four turns of the wheelset.")


def _coach(scene: _Scene, name: str, title: str) -> Law:
    """Force between frame and coach against the frame's motion, from the balance of the simulated frame."""
    model, before = scene.found.after.model, scene.found.before.model
    y, a = scene.motion(["z.frame.0", "ayf"])
    mass, dt = _mass(model), scene.stretch.dt
    primary = 0.0
    for w, z in zip((1, 2), scene.motion(["z.primary_lateral.1", "z.primary_lateral.2"]), strict=True):
        primary = primary + resisted(z, dt, mass, *_at(model, "primary_lateral", w))[0]
    force = primary - mass * a
    was, _ = resisted(y, dt, mass, *_at(before, "secondary_lateral", 0))
    curves = {"before": (y, was), "after": (y, force)}
    picture = _force_picture(scene, name, "force between frame and coach", curves, ("z", "m"), "N")
    return Law(title, (picture,), "Force that resists the motion of the frame; the coach moves with it.")


def _sensor(scene: _Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """What a sensor shows against what the vehicle does."""
    channel, stretch = effect.at, scene.stretch
    true = scene.motion([channel], Model(scene.found.after.model.design))[0][scene.piece]
    shown = scene.motion([channel])[0][scene.piece]
    measured = stretch.columns[channel][scene.piece]
    factor, unit = scale(measured, channel_unit(stretch, channel))

    def draw(ax: Axes) -> None:
        ax.plot(factor * true, factor * measured, **LINES["measured"] | {"lw": 1.4})
        ax.plot(factor * true, factor * true, **LINES["before"])
        ax.plot(factor * true, factor * shown, **LINES["after"])
        ax.set_xlabel(axis(f"{channel} of the vehicle", unit))
        ax.set_ylabel(axis(f"{channel} as shown", unit))

    picture = drawn(name, f"{title}: what the sensor shows against what the vehicle does", (4.7, 3.0), draw)
    return Law(title, (picture,), "Grey: measured; dashed: a true sensor; blue: the sensor as found.")


def _outside(scene: _Scene, o: Mapping[str, Any]) -> Law:
    """The measured curve with its error bars, over the motion actually seen."""
    path = o.get("parameter")
    rows = [r for r in zip(o["motion"], o["force"], o["sd"], strict=True) if None not in r[:2]]
    x, y, sd = np.array([[r[0], r[1], r[2] or 0.0] for r in rows]).T
    sign = 1.0 if path else -1.0
    x_scale, x_unit = scale(x, o["motion_unit"])
    y_scale, y_unit = scale(y, o["force_unit"])
    motion = list(_motion_seen(scene, o))

    def draw(ax: Axes) -> None:
        ax.errorbar(x_scale * x, sign * y_scale * y, yerr=2 * y_scale * sd, color=COLOURS["after"], lw=1.2, marker="o",
                    ms=4, capsize=3, ecolor="#444444", elinewidth=0.9)  # fmt: skip
        if motion:
            _seen(ax, x_scale * motion[0])
        words = {"z": "displacement z", "v": "speed v", "s": "distance s"}[o["against"]]
        ax.set_xlabel(axis(words, x_unit))
        ax.set_ylabel(axis(path or ("moment" if o["force_unit"].endswith("*m") else "force"), y_unit))

    where = place(o["at"], o["wheelset"]) if o.get("at") else "along the track"
    picture = drawn("outside", f"Measured curve, {where}", (4.7, 3.0), draw)
    note = "Bars: two standard deviations." + ("" if path else " Force that resists the motion: F of the files is its negative.")
    return Law(f"measured curve: {where}", (picture,), note)


def _motion_seen(scene: _Scene, o: Mapping[str, Any]) -> Iterator[Floats]:
    """What the curve stands against, where the vehicle has it."""
    sites = scene.found.after.model.vehicles().sites(scene.found.after.model.single())
    ports = [w for at, w in sites if at == o.get("at") and o["wheelset"] in (None, w)]
    if ports and o["against"] in ("z", "v"):
        yield scene.motion([f"{o['against']}.{o['at']}.{ports[0]}"])[0][scene.settled]
