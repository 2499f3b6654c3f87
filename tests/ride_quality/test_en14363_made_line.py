"""Evaluation by the rules of EN 14363 held against the same rules worked out again on a made line through all zones."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from scipy import signal, stats

from railui.io.series_file import write_series
from railui.ride_quality.en14363.evaluation import evaluate_measured, evaluate_simulated
from railui.ride_quality.time_series import ride_series
from railui.track.excitation import Excitation, resolve_track
from railui.vehicle.resolve import resolve_model

HOME = Path(__file__).parents[2]
BOGIE, COACH = HOME / "designs/test_bogie.yaml", HOME / "designs/manchester_coach.yaml"
LINE = HOME / "designs/lines/reverse_curves.yaml"
V, STEP, TARGET = 40.0, 0.1, 0.165  # m/s: sections of 100 m; m; cant deficiency in m
# zone by hand, radius to the right [m], length of its sections [m], cant deficiency of each section [m]
PIECES = (
    (1, 0.0, 100.0, [0.0] * 5),
    (2, 1000.0, 100.0, [0.06, 0.07, 0.09, 0.10, 0.12, 0.13, 0.15, 0.15]),
    (3, -500.0, 100.0, [0.10, 0.10, 0.10]),
    (4, 300.0, 70.0, [0.06, 0.08, 0.11, 0.13, 0.15, 0.16]),
    (0, 200.0, 100.0, [0.1, 0.1]),
)
Q = 50e3  # N


class MadeLine:
    """Slow waves of 20 to 50 m on an outward force that grows with the cant deficiency, by formula."""

    def __init__(self) -> None:
        ends, self.sections = 0.0, []
        for zone, radius, length, deficiencies in PIECES:
            for deficiency in deficiencies:
                self.sections.append((zone, ends, ends + length, radius, deficiency))
                ends += length
        self.s = np.arange(0.0, ends - 0.5 * STEP, STEP)
        starts = np.array([begin for _, begin, *_ in self.sections])
        self.number = np.searchsorted(starts, self.s + 1e-9, side="right") - 1
        self.radius = np.array([each[3] for each in self.sections])[self.number]
        self.deficiency = np.array([each[4] for each in self.sections])[self.number]
        rng = np.random.default_rng(5)
        k, phase = 2 * np.pi / np.array([20.0, 27.0, 50.0]), rng.uniform(0, 2 * np.pi, (2, 3))
        size = rng.uniform(1e3, 3e3, (2, 3))
        self.outer, self.inner = (
            base + slope * self.deficiency + np.sin(self.s[:, None] * k + p) @ a
            for base, slope, p, a in zip((6e3, 1e3), (80e3, 20e3), phase, size, strict=True)
        )

    def columns(self) -> dict[str, np.ndarray]:
        """Return the run: on straight track and in right-hand curves the outer wheel is the left one."""
        is_left_hand = self.radius < 0
        right = np.where(is_left_hand, self.outer, -self.inner)
        left = np.where(is_left_hand, self.inner, -self.outer)
        load = np.full(self.s.size, Q)
        run = {"t [s]": self.s / V, "s [m]": self.s, "v [m/s]": V + 0 * self.s, "radius [m]": self.radius}
        run |= {"cant_deficiency [mm]": 1e3 * self.deficiency, "Y1.right [kN]": right / 1e3, "Y1.left [N]": left}
        return run | {"Q1.right [N]": load, "Q1.left [N]": load}

    def values(self, zone: int, percentile: float, both: bool, sign: float = 1.0) -> tuple[np.ndarray, np.ndarray]:
        """Return percentile and cant deficiency of each section of a zone.

        Of the outward force of the outer wheel, or of both, to 20 Hz as means over 2 m every 0.5 m; the median, of a
        quasi-static force, is that of the samples.
        """
        columns = self.columns()
        low_pass = signal.butter(4, 20.0, output="sos", fs=V / STEP)
        right, left = (
            signal.sosfiltfilt(low_pass, x) for x in (1e3 * columns["Y1.right [kN]"], columns["Y1.left [N]"])
        )
        values, deficiencies = [], []
        for number, begin, end, radius, deficiency in self.sections:
            if number == zone:
                outward, outer = (1.0, right) if radius < 0 else (-1.0, left)
                force = outward * sign * (right + left if both else outer)
                at = [x for x in np.arange(begin, end - 0.25, 0.5) if 1.0 <= x <= self.s[-1] - 1.0]
                integral = np.concatenate([[0.0], np.cumsum(0.5 * STEP * (force[1:] + force[:-1]))])
                means = [
                    0.5 * float(np.interp(x + 1.0, self.s, integral) - np.interp(x - 1.0, self.s, integral)) for x in at
                ]
                samples = force[(self.s >= begin - 1e-9) & (self.s < end - 1e-9)]
                values.append(np.percentile(samples if percentile == 50.0 else means, percentile))
                deficiencies.append(deficiency)
        return np.array(values), np.array(deficiencies)


def prediction_limit(values: np.ndarray, deficiency: np.ndarray, confidence: float) -> float:
    """Return the upper end of the prediction interval of the regression at the target, as textbooks have it."""
    n, fit = len(values), stats.linregress(deficiency, values)
    residual = np.sqrt(np.sum((values - fit.intercept - fit.slope * deficiency) ** 2) / (n - 2))
    spread = np.sum((deficiency - deficiency.mean()) ** 2)
    root = np.sqrt(1 + 1 / n + (TARGET - deficiency.mean()) ** 2 / spread)
    return float(fit.intercept + fit.slope * TARGET + stats.t.ppf(0.5 * (1 + confidence), n - 2) * residual * root)


@pytest.fixture(scope="module")
def made() -> MadeLine:
    return MadeLine()


@pytest.fixture(scope="module")
def result(made: MadeLine, tmp_path_factory: pytest.TempPathFactory) -> dict:
    path = write_series(tmp_path_factory.mktemp("made") / "run.csv", made.columns())
    return evaluate_measured(path, BOGIE, cant_deficiency=TARGET)


def of(result: dict, zone: int, quantity: str, place: str) -> dict:
    quantities = result["zones"][zone - 1]["quantities"]
    (found,) = (q for q in quantities if (q["quantity"], q["place"]) == (quantity, place))
    return found


def test_the_sections_lie_in_the_zones_of_their_radii(result: dict) -> None:
    """5, 8, 3 and 6 sections; the radius of 200 m is outside all zones."""
    assert [zone["sections"] for zone in result["zones"]] == [5, 8, 3, 6]
    assert [zone["mean_radius"] for zone in result["zones"][1:]] == pytest.approx([1000.0, 500.0, 300.0])
    assert result["zones"][3]["mean_cant_deficiency"] == pytest.approx(np.mean(PIECES[3][3]))


@pytest.mark.parametrize("zone", [2, 3, 4])
def test_percentiles_and_estimates_of_curves_are_those_worked_out_again(
    made: MadeLine, result: dict, zone: int
) -> None:
    for quantity, place, both, factor in (
        ("sum of guiding forces", "wheelset 1", True, 1.0),
        ("Y/Q", "wheelset 1, outer wheel", False, 1.0 / Q),
    ):
        found = of(result, zone, quantity, place)
        values, deficiency = made.values(zone, 99.85, both)
        values *= factor
        assert found["values"] == len(values) and found["mean"] == pytest.approx(values.mean(), rel=1e-6)
        if zone == 3:  # one cant deficiency: mean + 3 s
            assert found["method"] == "one-dimensional"
            expected = values.mean() + 3 * values.std(ddof=1)
        else:
            assert found["method"] == "two-dimensional"
            expected = prediction_limit(values, deficiency, 0.99)
        assert found["estimated"] == pytest.approx(expected, rel=1e-6)
        assert found["exceeded"] == (expected > found["limit"])


@pytest.mark.parametrize("zone", [2, 4])
def test_quasi_static_forces_are_the_line_through_the_medians(made: MadeLine, result: dict, zone: int) -> None:
    found = of(result, zone, "quasi-static guiding force", "wheelset 1, outer wheel")
    values, deficiency = made.values(zone, 50.0, both=False)
    fit = stats.linregress(deficiency, values)
    assert found["estimated"] == pytest.approx(fit.intercept + fit.slope * TARGET, rel=1e-6)


def test_both_directions_count_on_straight_track(made: MadeLine, result: dict) -> None:
    found = of(result, 1, "sum of guiding forces", "wheelset 1")
    values = np.concatenate([made.values(1, 99.85, True, sign)[0] for sign in (-1.0, 1.0)])
    assert found["values"] == 10
    assert found["estimated"] == pytest.approx(values.mean() + 3 * values.std(ddof=1), rel=1e-6)
    assert found["limit"] == pytest.approx(10e3 + 2 * 55e3 / 3)


def test_the_series_of_a_simulated_run_has_the_evaluation_of_the_simulation(tmp_path: Path) -> None:
    """Curvature and cant of the series give the cant deficiency, its wheel loads Y/Q."""
    series = ride_series(resolve_model(COACH), Excitation(resolve_track(LINE), 25.0))
    path = write_series(tmp_path / "run.csv.gz", series.by_header())
    measured, simulated = evaluate_measured(path, COACH), evaluate_simulated(LINE, COACH, 25.0)
    assert measured["missing"] == simulated["missing"]
    for one, other in zip(measured["zones"], simulated["zones"], strict=True):
        assert one["sections"] == other["sections"]
        estimates = {(q["quantity"], q["place"]): q["estimated"] for q in other["quantities"]}
        assert estimates.keys() == {(q["quantity"], q["place"]) for q in one["quantities"]}
        for q in one["quantities"]:
            assert q["estimated"] == pytest.approx(estimates[q["quantity"], q["place"]], rel=1e-6, abs=1e-6)
