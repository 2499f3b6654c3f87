"""The laws found, drawn: force against the motion that was seen, before and after."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from railui import core
from railui.arrays import FloatArray
from railui.identification.loop import LoopResult
from railui.report.figures.drawing import Picture, axis, drawn, scale
from railui.report.loop.driven import (
    Scene,
    at_port,
    explained,
    force_word,
    gauge_under,
    held,
    mass_of,
    port_of,
    resisted,
    rms,
    whole_force,
    whole_title,
)
from railui.report.loop.figures import COLOURS, LINES, POINTS, Window, place
from railui.vehicle.design_reader import PlacedEffect
from railui.vehicle.effect_records import unit_at
from railui.vehicle.model import Model

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Curves = Mapping[str, tuple[FloatArray, FloatArray]]  # before, after -> motion [n], force [n]
FUNCTION = 0.98  # share explained by the motion from which a law is drawn as a curve, not as a path


@dataclass(frozen=True, eq=False)
class Law:
    """What is drawn of an effect: a heading, its pictures, what they show, which lines need a key."""

    title: str
    pictures: tuple[Picture, ...]
    note: str
    lines: tuple[str, ...] = ("before", "after")


def law_figures(found: LoopResult, report: Mapping[str, Any], window: Window) -> list[Law]:
    """The measured curve of `outside`, then every effect of the vehicle as found, over the motion actually seen."""
    model, laws = found.after.model, []
    if found.outside is not None:
        o = report["outside"]
        scene = Scene.of(found, found.outside.fit.model, window)
        laws.append(_from_run_to_run(o) if "runs" in o else _outside(scene, o))
    scene = Scene.of(found, model, window)
    for i, effect in enumerate(model.effects):
        if effect.kind not in core.CURVES:
            laws.append(_law(scene, effect, f"law-{i}"))
    return laws


def _law(scene: Scene, effect: PlacedEffect, name: str) -> Law:
    record = core.record(effect.kind)
    title = f"{record['title']}: {place(effect.at, effect.wheelset)}"
    draw: Callable[[Scene, PlacedEffect, str, str], Law] = _outer
    if record["acts"] == "sensor":
        draw = _sensor
    elif "rig" in record["at"]:
        draw = _suspension
    elif record["acts"] == "body":
        draw = _coach
    elif effect.at in ("contact", "track"):
        draw = _contact
    try:
        return draw(scene, effect, name, title)
    except ValueError as problem:  # too stiff to be stepped, or diverged
        return Law(title, (), f"Not drawn: {problem}.", ())


def _suspension(scene: Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """Whole force of the place against displacement, and the effect's own against what rules it."""
    at, (w, z) = effect.at, port_of(scene, effect.at, effect.wheelset)
    mass, (_, k, c) = mass_of(scene.model), at_port(scene.model, at, w)
    curves, v = whole_force(scene, at, w, z)
    superseded = str(core.record(effect.kind)["supersedes"] or "")
    own = resisted(z, scene.stretch.dt, mass, [effect], k, c)[0] - resisted(z, scene.stretch.dt, mass, [], k, c)[0]
    own = own + ("stiffness" in superseded) * k * z + ("damping" in superseded) * c * v
    kept = scene.settled
    ruling = ("v", v) if explained(v[kept], own[kept]) > explained(z[kept], own[kept]) else ("z", z)
    heading = whole_title(scene, at, w)
    note = "Force that resists the motion, over the motion of the validating run."
    if np.std(own - curves["after"]) < 0.01 * np.std(own):  # nothing else stands there
        return Law(title, (_motion_picture(scene, f"{name}-whole", heading, curves, ruling, at),), note)
    whole = _motion_picture(scene, f"{name}-whole", heading, curves, ("z", z), at)
    alone = _motion_picture(scene, f"{name}-own", "the effect alone", {"after": own}, ruling, at)
    return Law(title, (whole, alone), note)


def _motion_picture(
    scene: Scene, name: str, title: str, forces: Mapping[str, FloatArray], motion: tuple[str, FloatArray], at: str
) -> Picture:
    """Forces against a motion (z or v, and its values) at a place."""
    curves = {which: (motion[1], force) for which, force in forces.items()}
    return _force_picture(scene, name, title, curves, (motion[0], scene.unit(motion[0], at)), scene.unit("F", at))


def _force_picture(scene: Scene, name: str, title: str, curves: Curves, motion: tuple[str, str], unit: str) -> Picture:
    """Force against motion: a curve where the motion rules it, else the path of some seconds."""
    words = {"z": "displacement z", "v": "speed v", "e": "displacement e from the rails"}[motion[0]]
    kept = scene.settled
    ruled = {which: explained(x[kept], y[kept]) >= FUNCTION for which, (x, y) in curves.items()}
    shown = kept if all(ruled.values()) else scene.path
    seen = next(iter(curves.values()))[0][shown]
    x_scale, x_unit = scale(seen, motion[1])
    y_scale, y_unit = scale([y[shown] for _, y in curves.values()], unit)

    def draw(ax: Axes) -> None:
        for which, (x, y) in curves.items():
            a, b = x[shown], y[shown]
            if ruled[which]:
                order = np.argsort(a)
                order = order[:: max(1, len(order) // POINTS)]
                a, b = a[order], b[order]
            ax.plot(x_scale * a, y_scale * b, **LINES[which] | {"lw": 1.4})
        _seen(ax, x_scale * seen)
        ax.set_title(title)
        ax.set_xlabel(axis(words, x_unit))
        ax.set_ylabel(axis(force_word(unit), y_unit))

    return drawn(name, f"{title}: {force_word(unit)} against {words}", (4.7, 3.0), draw)


def _seen(ax: Axes, x: FloatArray) -> None:
    """How often each motion was seen, as a grey hill at the foot of the axes."""
    counts, edges = np.histogram(x, bins=60)
    middle = 0.5 * (edges[1:] + edges[:-1])
    ax.fill_between(middle, 0.18 * counts / max(counts.max(), 1), color="#dddddd", lw=0, zorder=0,
                    transform=ax.get_xaxis_transform())  # fmt: skip


def _contact(scene: Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """Lateral force and yaw moment of the contact on a wheelset held straight, against e."""
    w, model = effect.wheelset or 1, scene.model
    e = scene.motion([f"e{w}"])[0]
    others = Model(model.design.with_effects(x for x in model.design.effects if x is not effect))
    now, was, without = (held(scene, m, True) for m in (model, scene.before, others))
    change = {k: rms(now[k] - without[k]) / rms(without[k]) for k in (f"Y{w}", f"M{w}")}
    gauge, fan, pictures = gauge_under(scene, w), False, []
    for key, unit, words in ((f"Y{w}", "N", "lateral force"), (f"M{w}", "N*m", "yaw moment")):
        if change[key] < 0.5 * max(change.values()):
            continue
        curves = {"before": (e, was[key]), "after": (e, now[key])}
        heading = f"{words} of the rails on wheelset {w}"
        ruled = {k: explained(x[scene.settled], f[scene.settled]) >= FUNCTION for k, (x, f) in curves.items()}
        fan = gauge is not None and ruled["before"] and not ruled["after"]
        if fan and gauge is not None:
            pictures.append(_fan_picture(scene, f"{name}-{key}", heading, curves, gauge, unit))
        else:
            pictures.append(_force_picture(scene, f"{name}-{key}", heading, curves, ("e", "m"), unit))
    note = "The rails moved under a wheelset held straight, as far as they were seen to move."
    if fan:
        return Law(title, tuple(pictures), f"{note} Dots: after, coloured by the gauge.", ("before",))
    return Law(title, tuple(pictures), note)


def _fan_picture(scene: Scene, name: str, title: str, curves: Curves, gauge: FloatArray, unit: str) -> Picture:
    """As `_force_picture` where e alone does not rule the force: dots coloured by the gauge."""
    (x, y), (_, was) = curves["after"], curves["before"]
    some = np.arange(len(x))[scene.settled][:: max(1, len(x) // 1200)]
    order = some[np.argsort(x[some])]
    x_scale, x_unit = scale(x[some], "m")
    y_scale, y_unit = scale(y[some], unit)
    g_scale, g_unit = scale(gauge[some], "m")

    def draw(ax: Axes) -> None:
        dots = ax.scatter(x_scale * x[some], y_scale * y[some], s=5, c=g_scale * gauge[some], cmap="cividis", lw=0)
        ax.plot(x_scale * x[order], y_scale * was[order], **LINES["before"] | {"lw": 1.4})
        ax.figure.colorbar(dots, ax=ax, label=axis("gauge deviation", g_unit), pad=0.03)
        _seen(ax, x_scale * x[some])
        ax.set_title(title)
        ax.set_xlabel(axis("displacement e from the rails", x_unit))
        ax.set_ylabel(axis(force_word(unit), y_unit))

    return drawn(name, f"{title} against e, coloured by the gauge", (4.7, 3.0), draw)


def _outer(scene: Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """A force that hangs on the way alone: on a wheelset held still, against distance."""
    w, key, unit = effect.wheelset or 1, "M" if effect.at.endswith("_yaw") else "Y", unit_at("F", effect.at)
    if not effect.at.startswith("wheelset"):
        return Law(title, (), "A constant: there is no curve to draw.", ())
    f = held(scene, Model(scene.model.design.with_effects([effect])), False)[f"{key}{w}"]
    s = scene.stretch.columns["s"][scene.piece]
    radius = scene.model.design.values["vehicle.geometry.rolling_radius"]
    some = s <= s[0] + 8 * np.pi * radius
    factor, name_of = scale(f, unit)

    def draw(ax: Axes) -> None:
        ax.plot(s[some], factor * f[scene.piece][some], **LINES["after"] | {"lw": 1.4})
        ax.margins(x=0)
        ax.set_title(f"force on wheelset {w}")
        ax.set_xlabel("distance [m]")
        ax.set_ylabel(axis("moment" if key == "M" else "force", name_of))

    picture = drawn(name, f"{title}: force against distance", (4.7, 3.0), draw)
    return Law(title, (picture,), "Four turns of the wheelset.", ("after",))


def _coach(scene: Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """Force between frame and coach against the frame's motion, from the balance of the simulated frame."""
    model, before = scene.model, scene.before
    y, a = scene.motion(["z.frame.0", "ayf"])
    mass, dt = mass_of(model), scene.stretch.dt
    primary = 0.0
    for w, z in zip((1, 2), scene.motion(["z.primary_lateral.1", "z.primary_lateral.2"]), strict=True):
        primary = primary + resisted(z, dt, mass, *at_port(model, "primary_lateral", w))[0]
    force = primary - mass * a
    was, _ = resisted(y, dt, mass, *at_port(before, "secondary_lateral", 0))
    forces = {"before": was, "after": force}
    picture = _motion_picture(scene, name, "force between frame and coach", forces, ("z", y), "secondary_lateral")
    return Law(title, (picture,), "Force that resists the motion of the frame; the coach moves with it.")


def _sensor(scene: Scene, effect: PlacedEffect, name: str, title: str) -> Law:
    """What a sensor shows against what the vehicle does."""
    channel, stretch = effect.at, scene.stretch
    true = scene.motion([channel], Model(scene.model.design))[0][scene.piece]
    shown = scene.motion([channel])[0][scene.piece]
    measured = stretch.columns[channel][scene.piece]
    factor, unit = scale(measured, scene.units[channel])

    def draw(ax: Axes) -> None:
        ax.plot(factor * true, factor * measured, **LINES["measured"] | {"lw": 1.4})
        ax.plot(factor * true, factor * true, **LINES["before"])
        ax.plot(factor * true, factor * shown, **LINES["after"])
        ax.set_xlabel(axis(f"{channel} of the vehicle", unit))
        ax.set_ylabel(axis(f"{channel} as shown", unit))

    picture = drawn(name, f"{title}: what the sensor shows against what the vehicle does", (4.7, 3.0), draw)
    return Law(title, (picture,), "Grey: measured; dashed: a true sensor; blue: the sensor as found.", ())


def _outside(scene: Scene, o: Mapping[str, Any]) -> Law:
    """The measured curve with its error bars, over the motion actually seen, and with it the place's whole force."""
    path, pictures = o.get("parameter"), []
    rows = [r for r in zip(o["motion"], o["force"], o["sd"], strict=True) if None not in r[:2]]
    x, y, sd = np.array([[r[0], r[1], r[2] or 0.0] for r in rows]).T
    sign = 1.0 if path else -1.0
    x_scale, x_unit = scale(x, o["motion_unit"])
    y_scale, y_unit = scale(y, o["force_unit"])
    curve = scene.model.design.effects[-1] if scene.model.design.effects else None
    motion: list[FloatArray] = []
    if curve is not None and curve.kind == "measured_force" and o["against"] in ("z", "v"):
        w, z = port_of(scene, curve.at, curve.wheelset)
        forces, v = whole_force(scene, curve.at, w, z)
        heading = whole_title(scene, curve.at, w)
        pictures.append(_motion_picture(scene, "outside-whole", heading, forces, ("z", z), curve.at))
        motion = [(z if o["against"] == "z" else v)[scene.settled]]

    def draw(ax: Axes) -> None:
        ax.errorbar(x_scale * x, sign * y_scale * y, yerr=2 * y_scale * sd, color=COLOURS["after"], lw=1.2, marker="o",
                    ms=4, capsize=3, ecolor="#444444", elinewidth=0.9)  # fmt: skip
        for seen in motion:
            _seen(ax, x_scale * seen)
        words = {"z": "displacement z", "v": "speed v", "s": "distance s"}[o["against"]]
        ax.set_title("the curve alone")
        ax.set_xlabel(axis(words, x_unit))
        ax.set_ylabel(axis(path or force_word(o["force_unit"]), y_unit))

    where = place(o["at"], o["wheelset"]) if o.get("at") else "along the track"
    pictures.append(drawn("outside", f"Measured curve, {where}", (4.7, 3.0), draw))
    turned = "" if path else " Force that resists the motion: the negative of F in the files."
    lines = ("before", "after") if len(pictures) > 1 else ()
    return Law(f"identified force curve: {where}", tuple(pictures), "Bars: two standard deviations." + turned, lines)


def _from_run_to_run(o: Mapping[str, Any]) -> Law:
    """A parameter on every run: as adjusted, and as each validating run asks for it."""
    runs = o["runs"]
    factor, unit = scale([r["value"] for r in runs], o["force_unit"])

    def draw(ax: Axes) -> None:
        for role, colour, shape in (("adjust", COLOURS["before"], "s"), ("validate", COLOURS["after"], "o")):
            own = [(i, r) for i, r in enumerate(runs) if r["role"] == role]
            ax.errorbar([i for i, _ in own], [factor * r["value"] for _, r in own],
                        yerr=[2 * factor * (r["sd"] or 0.0) for _, r in own], color=colour, fmt=shape, ms=6, capsize=4,
                        ecolor="#444444", elinewidth=0.9)  # fmt: skip
        ax.set_xticks(range(len(runs)), [f"{r['file']}\n{r['role']}, {r['speed']:.3g} m/s" for r in runs])
        ax.set_xlim(-0.5, len(runs) - 0.5)
        ax.set_ylabel(axis(o["parameter"], unit))

    where = place(o["at"], o["wheelset"])
    picture = drawn("outside", f"{o['parameter']} on every run", (4.7, 3.0), draw, bottom=0.5)
    note = (
        "Square: as adjusted; round: as that run asks for it with all else as adjusted; bars: two standard deviations. "
        f"With these values the error of the validating runs would be {o['nrmse']:.3f}: no fit may see them, so it is "
        "not what the table of errors says."
    )
    return Law(f"not the same from run to run: {where}", (picture,), note, ())
