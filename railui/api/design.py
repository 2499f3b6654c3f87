"""Design of a vehicle, with the analyses of the commands as methods."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

from numpy.typing import ArrayLike

from railui.api.display import Summarised, SummaryRow
from railui.progress import SILENT, Progress
from railui.vehicle.design import Design as VehicleDesign
from railui.vehicle.effects import PlacedEffect

if TYPE_CHECKING:
    import pandas

    from railui.api.assessed_track import Assessment
    from railui.api.curving import Curve
    from railui.api.plan import Plan, Tracks
    from railui.api.response import Response
    from railui.api.response_map import ResponseMap
    from railui.api.ride import Ride
    from railui.api.sensitivity import Sensitivity
    from railui.api.series import Series
    from railui.api.stability import Stability
    from railui.ride_quality.evaluation import TrackLike
    from railui.running_stability.mode_tracking import TrackedMode
    from railui.vehicle.state_space import StateSpace
    from railui.vehicle.transfer import LinearVehicle


@dataclass(frozen=True)
class Design(VehicleDesign, Summarised):
    """Design of a vehicle: its numbers in SI by dotted path, and its effects.

    It is built by `load`, `from_text` or `from_dict`. Every function of `railui` takes it in the place of a path.

    Attributes
    ----------
    name : str
    kind : str
        "bogie", "rig", or "vehicle" for bodies and elements.
    values : mapping
        Numbers in SI by dotted path.
    effects : tuple of PlacedEffect
    source : Path or None
        File that it was read from.
    warnings : tuple of Problem
    overrides : mapping
        Changes by `with_values` since it was read.

    Examples
    --------
    >>> design = Design.load("designs/test_bogie.yaml")
    >>> stiffer = design.with_values({"vehicle.primary.lateral_stiffness": "4 MN/m"})
    >>> stiffer.value("vehicle.primary.lateral_stiffness"), design.unit("vehicle.primary.lateral_stiffness")
    (4000000.0, 'N/m')
    """

    overrides: Mapping[str, Any] = field(default_factory=dict, compare=False, repr=False)

    @classmethod
    def of(cls, design: VehicleDesign) -> Self:
        """Return a design as this class."""
        if isinstance(design, cls):
            return design
        return cls(**{item.name: getattr(design, item.name) for item in fields(VehicleDesign)})

    @classmethod
    def load(cls, path: str | Path, overrides: Mapping[str, Any] | None = None) -> Self:
        """Read a design file.

        Parameters
        ----------
        path : str or Path
        overrides : mapping, optional
            Changed values by path, as of `with_values`.

        Raises
        ------
        FileProblems
            With every problem of the file, or for another kind of file.
        """
        from railui.documents.recognise import expect_kind
        from railui.vehicle.design_reader import load_design

        expect_kind(path, "design")
        design = cls.of(load_design(Path(path)))
        return design.with_values(overrides) if overrides else design

    @classmethod
    def from_text(cls, text: str) -> Self:
        """Read a design from YAML text.

        Raises
        ------
        FileProblems
            With every problem of the text.

        Examples
        --------
        >>> Design.from_text("vehicle: {rig: {mass: 95 kg}}").value("vehicle.rig.mass")
        95.0
        """
        from railui.vehicle.design_reader import parse_design

        return cls.of(parse_design(text))

    @classmethod
    def from_dict(cls, content: Mapping[str, Any]) -> Self:
        """Build a design from the groups of its file as nested mappings.

        Parameters
        ----------
        content : mapping
            SI numbers, or quantities such as "3 MN/m".

        Raises
        ------
        FileProblems
            With every problem.

        Examples
        --------
        >>> Design.from_dict({"vehicle": {"rig": {"mass": "0.1 t", "gain": 2.0}}}).kind
        'rig'
        """
        from railui.io.yaml_writer import YamlWriter

        writer = YamlWriter()
        for key, value in content.items():
            writer.entry(key, value)
        return cls.from_text(writer.text())

    def with_values(self, changes: Mapping[str, Any]) -> Self:
        """Return a design with changed values.

        Parameters
        ----------
        changes : mapping
            SI numbers, or quantities such as "3 MN/m", by path; `load.state` selects a load state.

        Raises
        ------
        FileProblems
            If a path is unknown or a value does not fit.
        """
        changed = self.of(super().with_values(changes))
        return replace(changed, overrides={**self.overrides, **changes})

    def with_effects(self, effects: Iterable[PlacedEffect]) -> Self:
        """Return a design with these effects; FileProblems if one does not fit the catalogue."""
        return self.of(super().with_effects(effects))

    def save(self, path: str | Path) -> Path:
        """Write the design as a complete YAML file, atomically; return the path."""
        from railui.documents.saving import save_design

        return save_design(self, path)

    def to_yaml(self) -> str:
        """Return the design as the text of a complete file, every number in SI with all its digits."""
        from railui.documents.saving import design_text

        return design_text(self)

    def to_frame(self) -> pandas.DataFrame:
        """Return the numbers of the vehicle and of its effects by path, with symbols and units.

        Raises
        ------
        ImportError
            Without pandas.
        """
        from railui.api.frames import frame_of_rows

        rows = []
        for path in self.paths():
            record = self.parameter(path)
            rows.append({"path": path, "value": self.value(path), "unit": record.unit, "symbol": record.symbol})
        return frame_of_rows(rows).set_index("path")

    def schematic(self) -> str:
        """Return the plan view of the vehicle with its effects, as SVG."""
        from railui.report.schematic.subjects import schematic_of_design

        return schematic_of_design(self)

    def ride(self, track: TrackLike, speed: float | str, *, seed: int | None = None, jobs: int | None = None) -> Ride:
        """Compute the ride quality on a track, as `railui ride`.

        Parameters
        ----------
        track : Track, spec or path
        speed : float or str
            Speed [m/s], or a quantity such as "144 km/h".
        seed : int, optional
            Seed that replaces that of the spec.
        jobs : int, optional
            Threads; by default all.

        Raises
        ------
        FileProblems
            For faulty files.
        ValueError
            For a faulty spec or speed, or a vehicle too stiff to be integrated.

        Examples
        --------
        >>> design = Design.load("designs/test_bogie.yaml")
        >>> design.ride("erri_b176_low length=500", "144 km/h").ride_class
        'satisfactory'
        """
        from railui.api.ride import compute_ride

        return compute_ride(self, track, speed, seed=seed, jobs=jobs)

    def simulate(
        self, track: TrackLike, speed: float | str, channels: Sequence[str] | None = None, *, seed: int | None = None
    ) -> Series:
        """Simulate the vehicle on a track.

        Parameters
        ----------
        track, speed, seed
            As for `ride`.
        channels : sequence of str, optional
            Names of channels; all by default.

        Raises
        ------
        ValueError
            For an unknown channel, and as `ride`.

        Examples
        --------
        >>> series = Design.load("designs/test_bogie.yaml").simulate("erri_b176_low length=200", 40.0, ["e1"])
        >>> series["e1"].shape, series.units["e1"], round(series.rate, 6)
        ((2000,), 'm', 400.0)
        """
        from railui.api.series import simulate_design

        return simulate_design(self, track, speed, channels, seed=seed)

    def stability(
        self,
        speeds: Sequence[float] | None = None,
        *,
        fold: bool = False,
        track: TrackLike | None = None,
        seed: int | None = None,
        jobs: int | None = None,
        progress: Progress = SILENT,
    ) -> Stability:
        """Compute modes and critical speeds, as `railui stability`; parameters as of the function.

        Raises
        ------
        FileProblems
            For a test rig.
        ValueError
            For speeds that are not positive.

        Examples
        --------
        >>> round(Design.load("designs/check_bogie.yaml").stability([20.0, 80.0]).linear_critical_speed, 3)
        61.64
        """
        from railui.api.stability import compute_stability

        return compute_stability(self, speeds, fold=fold, track=track, seed=seed, jobs=jobs, progress=progress)

    def modes(self, speeds: ArrayLike) -> list[TrackedMode]:
        """Follow the oscillating modes over speed by their roots and shapes, least damped first.

        Parameters
        ----------
        speeds : array_like
            Speeds [m/s], increasing, in steps of at most some m/s.

        Returns
        -------
        list of TrackedMode
            With name, `frequency` [Hz] and `damping` at every speed, and `shape_at(speed)`.

        Raises
        ------
        FileProblems
            For a test rig.
        ValueError
            For a state matrix that is not finite.

        Examples
        --------
        >>> [mode.name for mode in Design.load("designs/check_bogie.yaml").modes(range(5, 101))[:2]]
        ['hunting', 'frame yaw']
        """
        from railui.api.modes import follow_modes

        return follow_modes(self, speeds)

    def response(
        self,
        speed: float | str,
        track: TrackLike | None = None,
        *,
        channels: Sequence[str] | None = None,
        frequencies: Sequence[float] | None = None,
        seed: int | None = None,
    ) -> Response:
        """Compute transfer functions and the stationary response, as `railui response`; parameters as of the function.

        Raises
        ------
        ValueError
            For an unknown channel, and speeds or frequencies that are not positive.
        """
        from railui.api.response import compute_response

        return compute_response(self, speed, track, channels=channels, frequencies=frequencies, seed=seed)

    def curve(self, radii: float | Sequence[float], cant_deficiency: float = 0.0) -> Curve:
        """Compute the equilibrium in a curve, or in curves of several radii [m], as `railui curve`.

        Parameters
        ----------
        radii : float or sequence of float
            Radius [m], positive for a right-hand curve.
        cant_deficiency : float
            Cant deficiency [m].

        Raises
        ------
        FileProblems
            For a test rig.
        ValueError
            For a radius that is 0 or not finite.
        """
        from railui.api.curving import compute_curve

        return compute_curve(self, radii, cant_deficiency)

    def sensitivity(self, of: Sequence[str] | None = None, **options: Any) -> Sensitivity:
        """Compute the changes of results with each parameter, as `railui sensitivity`.

        Parameters, `options` and exceptions as of the function: track, speed, seeds, radius, cant_deficiency, jobs.
        """
        from railui.api.sensitivity import sensitivity_of

        return sensitivity_of(self, of, **options)

    def map(self, x: str, y: str, of: Sequence[str], **options: Any) -> ResponseMap:
        """Compute results over two parameters, as `railui map`; nothing is stored.

        Parameters, `options` and exceptions as of `railui.response_map`: track, speed, radius, cant_deficiency, jobs.
        """
        from railui.api.response_map import map_of

        return map_of(self, x, y, of, **options)

    def assess(
        self,
        track: TrackLike,
        speed: float | str,
        *,
        section_length: float | None = None,
        seed: int | None = None,
        jobs: int | None = None,
    ) -> Assessment:
        """Rank the sections of a track by the ride of this vehicle, as `railui assess`; parameters as of the function.

        Raises
        ------
        ValueError
            For a section that is too short or not shorter than the track, and as `ride`.
        """
        from railui.api.assessed_track import compute_assessment

        return compute_assessment(self, track, speed, section_length=section_length, seed=seed, jobs=jobs)

    def plan(
        self,
        sensors: str | Path,
        speeds: Sequence[float | str],
        track: Tracks,
        *,
        budget: float | None = None,
        **options: Any,
    ) -> Plan:
        """Plan a measurement campaign before any measurement, as `railui plan`.

        Parameters, `options` and exceptions as of the function: duration, sections, noise, store, seed, jobs, progress.
        """
        from railui.api.plan import plan_of

        return plan_of(self, sensors, speeds, track, budget=budget, **options)

    def linearise(self, speed: float | str, channels: Sequence[str] | None = None) -> LinearVehicle:
        """Return the linear equations at a speed: x' = A x + sum B_i u_i(t - tau_i), y = C x + sum D_i u_i(t - tau_i).

        Parameters
        ----------
        speed : float or str
            Speed [m/s], or a quantity.
        channels : sequence of str, optional
            Names of y; those of a run by default.

        Raises
        ------
        FileProblems
            For a test rig.
        ValueError
            For an unknown channel or a speed that is not positive.
        """
        from railui.api.response import linear_vehicle

        return linear_vehicle(self, speed, channels)

    def state_space(self, speed: float | str, channels: Sequence[str] | None = None) -> StateSpace:
        """Return the linear equations as A, B, C, D with names and units; parameters and exceptions as `linearise`.

        Examples
        --------
        >>> space = Design.load("designs/check_bogie.yaml").state_space(40.0, ["e1"])
        >>> space.states[:2], space.inputs[:2], space.delays.tolist()
        (('y', 'psi'), ('yw.1', 'dyw_ds.1'), [0.0, 0.064])
        """
        from railui.api.response import state_space_of

        return state_space_of(self, speed, channels)

    def summary_title(self) -> str:
        """Return name and kind."""
        return f"{self.name} ({self.kind})"

    def summary_rows(self) -> list[SummaryRow]:
        """Return the numbers by path, and the effects."""
        rows = [SummaryRow(path, self.values[path], self.unit(path)) for path in self.values]
        return [*rows, *(SummaryRow(f"effects.{i}", _effect_text(effect)) for i, effect in enumerate(self.effects))]

    def summary_notes(self) -> Sequence[str]:
        """Return the warnings."""
        return [str(problem) for problem in self.warnings]

    def _repr_html_(self) -> str:
        """Return the schematic, then the summary, as HTML."""
        return self.schematic() + super()._repr_html_()


def _effect_text(effect: PlacedEffect) -> str:
    place = effect.at if effect.wheelset is None else f"{effect.at} {effect.wheelset}"
    return f"{effect.kind} at {place}"


def as_design(design: VehicleDesign | str | Path) -> Design:
    """Return a design, or that of a file, as the class of this package."""
    return Design.of(design) if isinstance(design, VehicleDesign) else Design.load(design)
