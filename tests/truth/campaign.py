"""Simulated campaigns of a vehicle that differs from its nominal model: sampled, simulated and written.

python -m tests.truth.campaign OUT --effect "free_play at=primary_lateral half_width=0.3e-3" --seed 3
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import numpy as np
from scipy.signal import lfilter

from tests.truth.bogie import Bogie, Vehicle
from tests.truth.effects import Effect, effect, of_one_run, parse
from tests.truth.files import NOISE, UNITS, campaign_text, design, facts_text, paths, write_run
from tests.truth.laws import Array
from tests.truth.march import simulate_many, steps_for
from tests.truth.road import Table
from tests.truth.tracks import met, recorder_noise

DECLARED = Vehicle(
    c_sy=0.2e6,
    c_spsi=0.2e6,
    lam=(0.15, 0.15),
    kappa_x=(180.0, 180.0),
    kappa_y=(165.0, 165.0),
    epsilon=(6.0, 6.0),
)
TRACK, RESPONSES = ("yw", "phiw", "gauge"), ("e1", "e2", "ay1", "ay2", "ayf", "rf", "d1", "d2")
WARM = 6.0  # s ahead of every run, so that none starts from rest
# how far the true vehicle may be from the declared one; what the fit holds fixed is as declared
SPREAD = {"c_y": 0.10, "c_x": 0.10, "k_y": 0.30, "k_psi": 0.30, "kappa_s": 0.25}
SPREAD_BY_WHEELSET = {
    "lam": 0.25,
    "kappa_x": 0.25,
    "kappa_y": 0.25,
    "epsilon": 0.25,
    "delta": 0.10,
    "sigma": 0.10,
}
DECAY = 1.0  # 1/s: least decay of the true vehicle's small motions at the speeds of the campaign
WIDEST = 0.03  # m: a wheelset further out would have left the rails; another vehicle is drawn


@dataclass(frozen=True)
class Order:
    """Specification of a campaign; its runs are a, b, ...: the last is for validation, the others for estimation."""

    effects: Sequence[Effect] = ()
    seed: int = 0
    name: str = "truth"
    track: str = "low"  # ERRI B176
    scale: float = 1.0  # of the track
    speeds: Sequence[float] = (40.0, 31.0)  # m/s of each run
    wander: float = 1.15  # m/s: standard deviation of the speed within a run
    seconds: Sequence[float] = (70.0, 45.0)
    rate: float = 200.0  # samples per second
    noise: Mapping[str, float] = field(default_factory=dict)  # standard deviations other than NOISE's; 0: none
    noise_band: float = 2.5  # m
    coloured: float = 0.0  # s: correlation time of the sensors' noise
    pink: bool = False  # sensors' noise with a 1/f spectrum
    stated: float = 1.0  # standard deviations in the campaign file over the true ones; 0: none are stated
    without: Sequence[str] = ()  # responses that are not recorded
    spread: Mapping[str, float] = field(default_factory=dict)  # letter to the width of its draw, besides the usual
    unmeasured: float = 0.0  # N: standard deviation of a random force on the frame
    columns: Sequence[str] = ()  # beyond the usual ones: psi1, psi2, Qy, Qpsi
    declared: Vehicle = DECLARED
    vehicle: Vehicle | None = None  # the true one; drawn round the declared where None
    centre: Mapping[str, float] = field(default_factory=dict)  # letter to factor: kappa_x 0.65 on worn rails
    steps: int | None = None


@dataclass(frozen=True)
class Campaign:
    """A campaign in memory: columns per run as recorded, and the truth behind them."""

    order: Order
    vehicle: Vehicle
    effects: dict[str, list[Effect]]  # per run, with its own phases and seeds
    runs: dict[str, dict[str, Array]]  # "a", "b" and so on, in the order of the columns
    clean: dict[str, dict[str, Array]]  # the same without noise
    steps: int


def decay(vehicle: Vehicle, V: float) -> float:
    """Decay of the least stable small oscillation, 1/s; negative where the linear vehicle hunts."""
    result = Bogie([vehicle]).eigenvalues(V)[0]
    swinging = result.real[np.abs(result.imag) > 1e-6]
    return -float(swinging.max(initial=-np.inf))


def drawn(order: Order, attempt: int = 0) -> Vehicle:
    """A true vehicle round the declared one, stable a little above both speeds."""
    if order.vehicle is not None:
        return order.vehicle
    rng = np.random.default_rng([order.seed, 11, attempt])
    d = order.declared
    for x, factor in order.centre.items():
        d = replace(d, **{x: _times(getattr(d, x), factor)})
    for _ in range(200):
        common = {x: order.spread.get(x, w) for x, w in SPREAD.items()}
        letters: dict[str, Any] = {x: getattr(d, x) * (1.0 + rng.uniform(-w, w)) for x, w in common.items()}
        by_wheelset = {x: order.spread.get(x, w) for x, w in SPREAD_BY_WHEELSET.items()}
        for x, w in by_wheelset.items():  # mostly common to both wheelsets, a fifth their own
            both, own = rng.uniform(-0.8 * w, 0.8 * w), rng.uniform(-0.2 * w, 0.2 * w, 2)
            letters[x] = tuple(float(p * (1.0 + both + o)) for p, o in zip(getattr(d, x), own, strict=True))
        vehicle = replace(d, **letters)
        if min(decay(vehicle, v + 2.0 * order.wander) for v in order.speeds) > DECAY:
            return vehicle
    raise ValueError(f"no stable vehicle near the declared one at {order.speeds} m/s: lower the speeds")


def _times(value: Any, factor: float) -> Any:
    return tuple(x * factor for x in value) if isinstance(value, tuple) else value * factor


def _prepare(order: Order, attempt: int) -> tuple[Vehicle, list[Table], list[list[Effect]]]:
    vehicle, tables, effects = drawn(order, attempt), [], []
    for run, (speed, seconds) in enumerate(zip(order.speeds, order.seconds, strict=True)):
        seed = int(np.random.SeedSequence([order.seed, run]).generate_state(1)[0])
        tables.append(met(speed, seconds, seed, order.track, order.scale, order.rate, WARM, order.wander))
        extra = [effect("frame_rumble", "frame", force=order.unmeasured)] if order.unmeasured else []
        effects.append(of_one_run([*order.effects, *extra], np.random.default_rng([order.seed, 12, run])))
    return vehicle, tables, effects


def campaigns(orders: Sequence[Order], *, round_steps: bool = False) -> list[Campaign]:
    """Many campaigns; those of one number of steps run side by side. Raises where all tries derail.

    round_steps: round the steps per sample up to a power of two, so that more run side by side.
    """
    found = try_campaigns(orders, round_steps=round_steps)
    if missing := [order.name for order, one in zip(orders, found, strict=True) if one is None]:
        raise ArithmeticError(f"{', '.join(missing)}: derails every time; weaken the effects or the track")
    return [one for one in found if one is not None]


def try_campaigns(orders: Sequence[Order], *, round_steps: bool = False) -> list[Campaign | None]:
    """As `campaigns`; None where all tries derail."""
    done: dict[int, Campaign] = {}
    for attempt in range(6):
        open_ones = [k for k, x in enumerate(orders) if k not in done and (x.vehicle is None or not attempt)]
        pending = {k: _prepare(orders[k], attempt) for k in open_ones}
        alike: dict[tuple[int, float], list[int]] = {}
        for k, what in pending.items():
            steps = _steps(orders[k], *what)
            steps = 1 << (steps - 1).bit_length() if round_steps else steps
            alike.setdefault((steps, orders[k].rate), []).append(k)
        for (steps, _), members in alike.items():
            vehicles = [pending[k][0] for k in members for _ in orders[k].speeds]
            tables = [run for k in members for run in pending[k][1]]
            effects = [one for k in members for one in pending[k][2]]
            seen = simulate_many(vehicles, tables, effects, steps)
            for k in members:
                own, seen = seen[: len(orders[k].speeds)], seen[len(orders[k].speeds) :]
                if all(max(np.abs(c["e1"]).max(), np.abs(c["e2"]).max()) < WIDEST for c in own):
                    done[k] = _recorded(orders[k], pending[k], own, steps)
    return [done.get(k) for k in range(len(orders))]


def steps_of(order: Order) -> int:
    """Integration steps per sample that the first try of a campaign needs."""
    return _steps(order, *_prepare(order, 0))


def _steps(order: Order, vehicle: Vehicle, tables: list[Table], effects: list[list[Effect]]) -> int:
    bogies = [Bogie([vehicle], [one]) for one in effects]
    slowest = [float(run.v.min()) for run in tables]
    return order.steps or max(steps_for(b, v, 1.0 / order.rate) for b, v in zip(bogies, slowest, strict=True))


def campaign(order: Order) -> Campaign:
    """One campaign in memory."""
    return campaigns([order])[0]


def _recorded(
    order: Order,
    what: tuple[Vehicle, list[Table], list[list[Effect]]],
    seen: list[dict[str, Array]],
    steps: int,
) -> Campaign:
    vehicle, tables, effects = what
    runs, clean, names = {}, {}, ascii_lowercase[: len(tables)]
    recorded = [x for x in RESPONSES if x not in order.without]
    for i, name in enumerate(names):
        run, warm = tables[i], round(WARM * order.rate)
        whole = {
            "t": run.t,
            "s": run.s,
            "v": run.v,
            "yw": run.yw,
            "phiw": run.phiw,
            "gauge": run.gauge,
            **seen[i],
        }
        clean[name] = {x: whole[x][warm:] for x in ("t", "s", "v", *TRACK, *recorded, *order.columns)}
        runs[name] = noisy(clean[name], order, np.random.default_rng([order.seed, 13, i]))
    return Campaign(order, vehicle, dict(zip(names, effects, strict=True)), runs, clean, steps)


def noisy(clean: Mapping[str, Array], order: Order, rng: np.random.Generator) -> dict[str, Array]:
    """The columns as recorded: track noise above the recorder's wavelength, sensors white or coloured."""
    out = dict(clean)
    for name in clean:
        sd = order.noise.get(name, NOISE.get(name, (0.0, ""))[0])
        own = np.random.default_rng(rng.integers(2**63))
        if name in TRACK:
            out[name] = clean[name] + recorder_noise(clean["s"], sd, order.noise_band, own)
        elif sd and order.pink:
            out[name] = clean[name] + sd * pink(len(clean[name]), own)
        elif sd:
            white = own.normal(0.0, sd, len(clean[name]) + 1000)
            rho = np.exp(-1.0 / (order.rate * order.coloured)) if order.coloured else 0.0
            out[name] = clean[name] + lfilter([np.sqrt(1.0 - rho**2)], [1.0, -rho], white)[1000:]
    return out


def pink(n: int, rng: np.random.Generator) -> Array:
    """Noise [n] of unit standard deviation whose spectrum falls as 1/f."""
    spectrum = np.fft.rfft(rng.normal(size=4 * n))
    spectrum[1:] /= np.sqrt(np.arange(1, len(spectrum)))
    spectrum[0] = 0.0
    series = np.fft.irfft(spectrum)
    return np.asarray(series[:n] / series.std())


def write(found: Campaign, folder: Path, truth: Path | None = None) -> None:
    """vehicle.yaml, campaign.yaml and the runs; the truth only where a path is given for it."""
    order = found.order
    folder.mkdir(parents=True, exist_ok=True)
    noise = {x: NOISE[x][1] for x in found.runs["a"] if x in NOISE}
    noise |= {x: f"{sd:.12g}" for x, sd in order.noise.items() if sd and x in noise}
    noise = {x: text for x, text in noise.items() if order.noise.get(x, 1.0)}
    if order.stated != 1.0:
        true = {x: order.noise.get(x, NOISE[x][0]) for x in noise}
        noise = {x: f"{order.stated * sd:.12g}" for x, sd in true.items() if order.stated}
    (folder / "vehicle.yaml").write_text(design(order.declared))
    text = campaign_text(order.name, "vehicle.yaml", noise, order.noise_band, found.runs)
    (folder / "campaign.yaml").write_text(text)
    for name, run in found.runs.items():
        write_run(folder / f"run_{name}.csv.gz", run, UNITS)
    if truth is not None:
        truth.parent.mkdir(parents=True, exist_ok=True)
        truth.write_text(facts_text(facts(found)))


def facts(found: Campaign) -> dict[str, Any]:
    """The truth of a campaign."""
    return {
        "name": found.order.name,
        "seed": found.order.seed,
        "steps": found.steps,
        "coloured": found.order.coloured,
        "unmeasured": found.order.unmeasured,
        "parameters": paths(found.vehicle),
        "effects": [one.record() for one in found.order.effects],
        "runs": {name: [one.record() for one in effects] for name, effects in found.effects.items()},
    }


def main(words: Sequence[str] | None = None) -> None:
    """The command line."""
    p = argparse.ArgumentParser(prog="python -m tests.truth.campaign", description=__doc__)
    p.add_argument("out", type=Path)
    p.add_argument("--effect", action="append", default=[], metavar='"KIND at=PLACE wheelset=1 NAME=NUMBER ..."')
    p.add_argument("--seed", type=int, default=0)
    p.add_argument("--name")
    p.add_argument("--track", choices=["low", "high"], default="low")
    p.add_argument("--scale", type=float, default=1.0)
    p.add_argument("--speeds", type=float, nargs="+", default=Order.speeds)
    p.add_argument("--seconds", type=float, nargs="+", default=Order.seconds)
    p.add_argument("--coloured", type=float, default=0.0, metavar="SECONDS")
    p.add_argument("--unmeasured", type=float, default=0.0, metavar="NEWTON")
    p.add_argument("--columns", nargs="*", default=[], choices=["psi1", "psi2", "Qy", "Qpsi"])
    p.add_argument("--centre", default="", metavar="kappa_x=0.65,kappa_y=0.65", help="where the draw is centred")
    p.add_argument("--as-declared", action="store_true", help="the true vehicle is the declared one")
    p.add_argument("--truth", type=Path, help="file of the truth; not in the directory of the campaign")
    given = p.parse_args(words)
    order = Order(
        effects=[parse(text) for text in given.effect],
        seed=given.seed,
        name=given.name or given.out.name.replace("_", " "),
        track=given.track,
        scale=given.scale,
        speeds=tuple(given.speeds),
        seconds=tuple(given.seconds),
        coloured=given.coloured,
        unmeasured=given.unmeasured,
        columns=given.columns,
        centre={x: float(w) for x, w in (pair.split("=") for pair in given.centre.split(",") if pair)},
        vehicle=DECLARED if given.as_declared else None,
    )
    write(campaign(order), given.out, given.truth)


if __name__ == "__main__":
    main()
