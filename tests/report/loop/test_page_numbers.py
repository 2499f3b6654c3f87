"""The numbers of a loop's page: what is compared with what, in which unit, by how much it is off."""

from __future__ import annotations

from typing import Any

from railui.report.loop import page


def report(**more: Any) -> dict[str, Any]:
    """A report of two channels: the error falls from 0.8 to 0.1 over a floor of 0.05."""
    nrmse = {"declared": 0.8, "before": 0.4, "after": 0.1, "floor": 0.05}
    rows = {w: {"nrmse": x, "channels": {"e1": x, "ayf": 2 * x}} for w, x in nrmse.items()}
    return {**rows, "verdict": "effect", **more}


def test_every_error_stands_beside_the_floor_as_a_ratio() -> None:
    told = page.errors(report())
    assert told["channels"] == ["e1", "ayf"]
    assert [(r["all"], r["ratio"], r["channels"]) for r in told["rows"]] == [
        ("0.800", "16.00", ["0.800", "1.600"]),
        ("0.400", "8.00", ["0.400", "0.800"]),
        ("0.100", "2.00", ["0.100", "0.200"]),
        ("0.050", "1.00", ["0.050", "0.100"]),
    ]


def test_a_vehicle_that_diverged_has_no_ratio() -> None:
    lost = {"nrmse": None, "channels": {"e1": None, "ayf": None}}
    row = page.errors(report(before=lost))["rows"][1]
    assert (row["all"], row["ratio"], row["channels"]) == ("diverged", "–", ["–", "–"])


def test_a_parameter_stands_in_one_unit_with_its_change_since_it_was_declared() -> None:
    path = "vehicle.primary.lateral_stiffness"
    one = {"declared": 4e6, "before": 3.5e6, "value": 3e6, "sd": 6e4, "unit": "N/m", "flag": "moved"}
    (row,) = page.parameters(report(parameters={path: one}, profiles=None))
    assert [row[k] for k in ("declared", "before", "value", "unit", "change", "grade")] == [
        "4.00", "3.50", "3.000 ± 0.060", "MN/m", "−25 %", "good",
    ]  # fmt: skip


def test_riding_quality_is_told_as_measured_and_by_how_much_each_model_is_off() -> None:
    values = {"measured": 2e-3, "declared": 3e-3, "before": 1.9e-3, "after": None}
    (row,) = page.riding({"riding": {w: {"sd_e1": x} for w, x in values.items()}})
    assert row["unit"] == "mm"
    assert [(c["value"], c["off"]) for c in row["cells"]] == [
        ("2.00", ""), ("3.00", "+50.0 %"), ("1.90", "−5.0 %"), ("–", ""),
    ]  # fmt: skip


def test_means_are_told_in_the_unit_of_their_channel() -> None:
    rows = page.means({"means": {"e1": -1.5e-4, "ayf": 0.02}}, {"e1": "m", "ayf": "m/s^2"})
    assert [(r["name"], r["value"], r["unit"]) for r in rows] == [("e1", "−0.15", "mm"), ("ayf", "0.020", "m/s²")]


def test_a_candidate_that_gains_nothing_is_drawn_faint_and_one_that_was_not_fitted_hollow() -> None:
    row = {"kind": "free_play", "at": "primary_lateral", "wheelset": 2, "rho": -0.5, "nrmse": 0.2, "weight": 0.25}
    gaining, idle = (page.candidate(row | {"refitted": False}, 0.4, nothing) for nothing in (0.3, 0.1))
    assert (gaining["bar"], idle["bar"]) == (" guess", " guess idle")
    assert (gaining["rho"], gaining["rho_width"], gaining["nrmse_width"]) == ("−0.50", "50.0", "50.0")
    assert (gaining["place"], gaining["weight"]) == ("primary lateral, wheelset 2", "25 %")
