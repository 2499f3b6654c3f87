"""Tables of the loop page: values, units, ratios and deviations."""

from __future__ import annotations

from typing import Any

import pytest

from railui.report.loop.page_tables import (
    candidate_row,
    error_rows,
    mean_error_rows,
    parameter_rows,
    ride_quality_rows,
    run_row,
)

STIFFNESS = "vehicle.primary.lateral_stiffness"
PARAMETER = {"declared": 4e6, "before": 3.5e6, "value": 3e6, "sd": 6e4, "unit": "N/m", "flag": None}


def report(**more: Any) -> dict[str, Any]:
    """Return a report of two channels: the error falls from 0.8 to 0.1 over a noise floor of 0.05."""
    nrmse = {"declared": 0.8, "before": 0.4, "after": 0.1, "floor": 0.05}
    rows = {model: {"nrmse": x, "channels": {"e1": x, "ayf": 2 * x}} for model, x in nrmse.items()}
    return {**rows, "verdict": "effect", **more}


def parameter_row(flag: str | None, word: str) -> dict[str, Any]:
    identifiability = {"parameters": {STIFFNESS: {"word": word}}}
    parameters = {STIFFNESS: PARAMETER | {"flag": flag}}
    (row,) = parameter_rows(report(parameters=parameters, profiles=None, identifiability=identifiability))
    return row


def test_every_error_is_followed_by_its_ratio_to_the_noise_floor() -> None:
    found = error_rows(report())
    assert found["channels"] == ["e1", "ayf"]
    assert [(r["label"], r["all"], r["ratio"], r["channels"]) for r in found["rows"]] == [
        ("nominal", "0.800", "16.00", ["0.800", "1.600"]),
        ("calibrated", "0.400", "8.00", ["0.400", "0.800"]),
        ("calibrated + effect", "0.100", "2.00", ["0.100", "0.200"]),
        ("noise floor", "0.050", "1.00", ["0.050", "0.100"]),
    ]


def test_a_diverged_model_has_no_ratio() -> None:
    diverged = {"nrmse": None, "channels": {"e1": None, "ayf": None}}
    row = error_rows(report(before=diverged))["rows"][1]
    assert (row["all"], row["ratio"], row["channels"]) == ("diverged", "–", ["–", "–"])


def test_a_parameter_is_shown_in_one_unit_with_its_change_from_nominal() -> None:
    row = parameter_row("moved", "determined")
    assert [row[key] for key in ("declared", "before", "value", "unit", "change")] == [
        *("4.00", "3.50", "3.000 ± 0.060", "MN/m", "−25 %")
    ]


@pytest.mark.parametrize(
    ("flag", "word", "expected"),
    [
        ("moved", "determined", ("determined, shifted", "good")),
        (None, "only in combination", ("only in combination with others", "fair")),
        ("unseen", "not seen by these sensors", ("not identifiable, prior-dominated", "poor")),
        ("bound", "determined", ("at its bound", "poor")),
    ],
)
def test_a_parameter_is_graded_by_what_the_data_determine(
    flag: str | None, word: str, expected: tuple[str, str]
) -> None:
    row = parameter_row(flag, word)
    assert (row["identifiability"], row["grade"]) == expected


def test_ride_quality_is_shown_as_measured_and_with_the_deviation_of_each_model() -> None:
    values = {"measured": 2e-3, "declared": 3e-3, "before": 1.9e-3, "after": None}
    (row,) = ride_quality_rows({"riding": {model: {"sd_e1": x} for model, x in values.items()}})
    assert row["unit"] == "mm"
    assert [(cell["value"], cell["deviation"]) for cell in row["cells"]] == [
        *(("2.00", ""), ("3.00", "+50.0 %"), ("1.90", "−5.0 %"), ("–", ""))
    ]


def test_mean_errors_are_shown_in_the_unit_of_their_channel() -> None:
    rows = mean_error_rows({"means": {"e1": -1.5e-4, "ayf": 0.02}}, {"e1": "m", "ayf": "m/s^2"})
    assert [(r["name"], r["value"], r["unit"]) for r in rows] == [("e1", "−0.15", "mm"), ("ayf", "0.020", "m/s²")]


def test_a_candidate_without_gain_is_dotted_and_one_that_was_not_refitted_hollow() -> None:
    row = {"kind": "free_play", "at": "primary_lateral", "wheelset": 2, "rho": -0.5, "nrmse": 0.2, "weight": 0.25}
    better, worse = (candidate_row(row | {"refitted": False}, 0.4, base) for base in (0.3, 0.1))
    assert (better["bar"], worse["bar"]) == (" estimate", " estimate no-gain")
    assert (better["rho"], better["rho_width"], better["nrmse_width"]) == ("−0.50", "50.0", "50.0")
    assert (better["location"], better["weight"]) == ("lateral primary suspension, wheelset 2", "25 %")


def test_a_run_names_the_rows_that_were_excluded() -> None:
    counts = {"used": 90, "gaps": 1, "nan_rows": 4, "standing_rows": 6, "stuck_rows": 0}
    row = run_row({"file": "a.csv", "role": "validate", "samples": 100, "stretches": 2, "counts": counts})
    assert (row["role"], row["used"], row["gaps"], row["segments"]) == ("validation", 90, 1, 2)
    assert row["excluded"] == "4 rows with empty or NaN cells; 6 rows at standstill"
