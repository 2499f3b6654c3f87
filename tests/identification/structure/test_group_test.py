"""Test of equal numbers at the joints of an element and the wheelsets of a contact group."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest

from railui.campaign.campaign import load_campaign
from railui.campaign.dataset import Dataset, read_dataset
from railui.identification.context import Context, create_context
from railui.identification.estimation.calibration import calibrate
from railui.identification.estimation.fit import Fit
from railui.identification.estimation.output_error import fit_output_error
from railui.identification.prediction import Predictor
from railui.identification.structure.freed_groups import free_groups
from railui.identification.structure.group_test import compare_group_members
from railui.vehicle.design_reader import load_design, parse_design
from railui.vehicle.division import divide_design
from railui.vehicle.model import Model
from tests.truth.files import write_run
from tests.truth.tracks import met

DESIGN = Path(__file__).parents[3] / "designs/bogie_under_coach.yaml"
PATHS = (
    "contact.wheels.conicity",
    "vehicle.elements.primary.lateral_stiffness",
    "vehicle.elements.primary.longitudinal_stiffness",
)
NOISE = {"e1": 5e-5, "e2": 5e-5, "ay1": 0.03, "ay2": 0.03, "ayf": 0.02, "rf": 3e-4}
UNITS = {"t": "s", "s": "m", "v": "m/s", "yw": "m", "phiw": "rad", "e1": "m", "e2": "m", "rf": "rad/s"}
UNITS |= dict.fromkeys(("ay1", "ay2", "ayf"), "m/s^2")


def design_text() -> str:
    """The bundled vehicle with one contact group for both wheelsets."""
    lines = DESIGN.read_text("utf-8").replace("  leading:  {conicity", "  wheels: {conicity").splitlines(keepends=True)
    return "".join(line for line in lines if not line.startswith("  trailing:"))


def true_model(changes: dict[str, float]) -> Model:
    """The declared vehicle with factors on the numbers of single wheelsets, by path."""
    design = divide_design(parse_design(design_text()), PATHS)
    return Model(design.with_values({path: factor * design.value(path) for path, factor in changes.items()}))


@cache
def campaign(factors: tuple[tuple[str, float], ...]) -> Dataset:
    """Two runs of the program's own vehicle, with noise of the sensors."""
    with TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "vehicle.yaml").write_text(design_text())
        text = "vehicle: vehicle.yaml\nruns: [{file: a.csv.gz, role: adjust}, {file: b.csv.gz, role: validate}]\n"
        text += f"adjust: [{', '.join(PATHS)}]\nnoise: {{yw: 0, phiw: 0, gauge: 0, "
        text += f"{', '.join(f'{n}: {x}' for n, x in NOISE.items())}}}\n"
        (folder / "campaign.yaml").write_text(text)
        tables = {run: met(speed, 25.0, 50 + int(speed)) for run, speed in (("a", 35.0), ("b", 28.0))}
        columns = {run: {"t": x.t, "s": x.s, "v": x.v, "yw": x.yw, "phiw": x.phiw} for run, x in tables.items()}
        rng = np.random.default_rng(1)
        for run, some in columns.items():
            empty = {name: rng.normal(0.0, sd, len(some["t"])) for name, sd in NOISE.items()}
            write_run(folder / f"{run}.csv.gz", some | empty, UNITS)
        for run, segment in zip("ab", read_dataset(load_campaign(folder)).segments, strict=True):
            series = Predictor(true_model(dict(factors)), segment).simulate(list(NOISE)).series[0]
            noisy = {n: x + rng.normal(0.0, sd, len(x)) for (n, sd), x in zip(NOISE.items(), series, strict=True)}
            write_run(folder / f"{run}.csv.gz", {c: segment.columns[c] for c in columns[run]} | noisy, UNITS)
        return read_dataset(load_campaign(folder))


@cache
def fitted(*factors: tuple[str, float]) -> tuple[Context, Fit]:
    context = create_context(campaign(factors), jobs=2)
    return context, calibrate(context)


def test_equal_wheelsets_ask_for_nothing() -> None:
    groups = compare_group_members(*fitted())
    assert {g.path for g in groups} == set(PATHS)
    assert all(g.members == (1, 2) and not g.is_heterogeneous for g in groups)
    assert max(g.partial_correlation for g in groups) < 0.1


@pytest.mark.parametrize("index", [0, 1])
def test_a_wheelset_that_differs_is_found_with_its_sign_and_size(index: int) -> None:
    path = PATHS[index]
    context, fit = fitted((f"{path}.2", 0.7))
    first, *others = compare_group_members(context, fit)
    assert (first.path, first.is_heterogeneous) == (path, True) and not any(g.is_heterogeneous for g in others)
    assert first.p_value <= context.settings.score_test.significance_level
    declared = context.nominal.design.value(path)
    assert first.differences == pytest.approx([0.15 * declared, -0.15 * declared], rel=0.4)


def test_freed_members_take_their_true_values() -> None:
    path = PATHS[1]
    context, fit = fitted((f"{path}.2", 0.7))
    freed = free_groups(context, fit)
    assert freed.fit is not None and freed.fit.error_to_noise < min(1.1, fit.error_to_noise)
    declared = context.nominal.design.value(path)
    for number, factor in ((1, 1.0), (2, 0.7)):
        j = freed.fit.free.paths.index(f"{path}.{number}")
        assert abs(freed.fit.x[j] - factor * declared) < 4 * freed.fit.sd[j]
        assert freed.fit.sd[j] < 0.05 * declared


def test_a_single_group_that_differs_is_found() -> None:
    path = PATHS[1]
    context, fit = fitted((f"{path}.2", 0.7))
    alone = fit_output_error(context, fit.model, [path], segments=fit.segments)
    assert [(g.path, g.is_heterogeneous) for g in compare_group_members(context, alone)] == [(path, True)]


def test_a_bogie_has_no_groups() -> None:
    context, fit = fitted()
    bogie = Model(load_design(DESIGN.with_name("test_bogie.yaml")))
    assert compare_group_members(context, replace(fit, model=bogie)) == ()
