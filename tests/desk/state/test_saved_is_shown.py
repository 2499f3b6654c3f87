"""Saved designs run as the form showed them, after any sequence of edits, undos, saves and reloads."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from railui.desk.presenters.design_results import evaluate_design
from railui.desk.state.design_file import CHANGED, EXISTS, REWRITTEN, FileChanged
from railui.desk.state.draft import Draft
from railui.desk.state.run_conditions import RunConditions
from railui.desk.state.session_parts import form_content, restore_form
from railui.documents.saving import design_text
from railui.io.problems import FileProblems
from railui.ride_quality.evaluation import ride
from railui.vehicle.design_reader import Adjustment, Design, load_design
from railui.vehicle.effects import PlacedEffect
from tests.desk.conftest import REPOSITORY

CONDITIONS = RunConditions("erri_b176_low length=60 seed=1", 40.0)
PLAY = PlacedEffect("free_play", "primary_lateral", None, {"half_width": 3e-4})
TEXTS = {
    "plain": (REPOSITORY / "designs/test_bogie.yaml").read_text(),
    "coach": (REPOSITORY / "designs/bogie_under_coach.yaml").read_text(),
}


def calibrated(design: Design) -> Design:
    """Return a design as a loop leaves it: other contact numbers, an effect, the covariance of its estimates."""
    names = tuple(path for path in design.values if path.endswith(("conicity", "lateral_stiffness")))[:2]
    values = design.with_values({name: 1.1 * design.value(name) for name in names})
    has_play = design.structure is not None or any(effect.kind == PLAY.kind for effect in design.effects)
    effects = values.effects if has_play else (*values.effects, PLAY)
    adjustment = Adjustment("a campaign", "0" * 64, names, ((1e-4, 1e-6), (1e-6, 2e-4)))
    return replace(values.with_effects(effects), adjustment=adjustment, name=f"{design.name}, calibrated")


class Session:
    """Session at the model layer: a draft, its files, and the actions of the desk."""

    def __init__(self, directory: Path, text: str) -> None:
        self.directory = directory
        self.source = directory / "vehicle.yaml"
        self.source.write_text(text)
        self.draft = Draft.load(self.source, CONDITIONS)
        self.count = 0

    def edit(self, number: int, factor: float) -> None:
        paths = [path for path in self.draft.design.paths() if self.draft.design.value(path)]
        path = paths[number % len(paths)]
        try:
            self.draft.set(path, factor * self.draft.design.value(path))
        except FileProblems:
            return  # rejected: nothing changes

    def choose(self, use: str) -> None:
        self.draft.set("riding.use", use)

    def add_effect(self) -> None:
        if self.draft.design.structure is None and not any(e.kind == PLAY.kind for e in self.draft.design.effects):
            self.draft.add_effect(PLAY)

    def take(self, values: float) -> None:
        """Take a design of a front of the calibrated vehicle, as `t` does."""
        nominal = calibrated(self.draft.design)
        path = next(p for p in nominal.values if p.endswith("lateral_stiffness"))
        design = nominal.with_values({path: values * nominal.value(path)})
        self.draft = Draft(design, base=nominal, conditions=CONDITIONS, new_path=self.directory / "taken.yaml")

    def swap(self) -> None:
        self.draft.swap_with_base()

    def set_base(self) -> None:
        self.draft.set_base()

    def undo(self) -> None:
        self.draft.undo()

    def redo(self) -> None:
        self.draft.redo()

    def save(self) -> None:
        before = self.draft.design.content()
        if self.draft.path is None:
            self.count += 1
            self.draft.save_as(self.directory / f"saved_{self.count}.yaml")
        else:
            try:
                self.draft.save()
            except FileChanged as question:  # answered with "write"
                assert question.prepared is not None
                assert set(question.prepared.reasons) <= {CHANGED, EXISTS, REWRITTEN}
                self.draft.write(question.prepared)
        assert self.draft.design.content() == before and not self.draft.is_modified
        self.check_file()

    def change_on_disk(self) -> None:
        """Change the file as another program would."""
        path = self.draft.path
        if path is not None:
            path.write_text(path.read_text() + "# by another program\n")
            with pytest.raises(FileChanged):
                self.draft.save()

    def reload(self) -> None:
        if self.draft.path is not None:
            self.draft = Draft.load(self.draft.path, CONDITIONS)

    def restore(self) -> None:
        """End the process and restore the form."""
        before, was_modified = self.draft.design, self.draft.is_modified
        self.draft = restore_form(form_content(self.draft))
        assert (
            self.draft.design.content() == before.content()
            and self.draft.design.present_adjustment == before.present_adjustment
        )
        assert self.draft.is_modified == was_modified

    def check_file(self) -> None:
        """Compare the file with the form: contents, calibration, and names."""
        assert self.draft.path is not None
        saved = load_design(self.draft.path)
        assert (
            saved.content() == self.draft.design.content() and saved.adjustment == self.draft.design.present_adjustment
        )


def actions() -> st.SearchStrategy[tuple[Any, ...]]:
    """Return a strategy of one action: name of the method and arguments."""
    plain = ("add_effect", "swap", "set_base", "undo", "redo", "save", "change_on_disk", "reload", "restore")
    return st.one_of(
        st.tuples(st.just("edit"), st.integers(0, 60), st.sampled_from([0.9, 1.07, 1.3])),
        st.tuples(st.just("choose"), st.sampled_from(["long_distance", "local"])),
        st.tuples(st.just("take"), st.sampled_from([0.8, 1.25])),
        *(st.tuples(st.just(name)) for name in plain),
    )


def run(kind: str, steps: list[tuple[Any, ...]], finish: Callable[[Session], None]) -> None:
    """Run actions in a directory of their own, then save and finish."""
    with tempfile.TemporaryDirectory() as directory:
        session = Session(Path(directory), TEXTS[kind])
        for name, *arguments in steps:
            getattr(session, name)(*arguments)
        session.save()
        finish(session)


@settings(max_examples=60, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(kind=st.sampled_from(sorted(TEXTS)), steps=st.lists(actions(), max_size=12))
def test_a_saved_file_reads_back_as_the_form_after_any_actions(kind: str, steps: list[tuple[Any, ...]]) -> None:
    run(kind, steps, Session.check_file)


def check_ride(session: Session) -> None:
    """Compare what `railui ride` computes of the file with what the desk computed of the form."""
    draft = session.draft
    assert draft.path is not None
    shown = evaluate_design(draft.design, draft.conditions).quality
    said = ride(load_design(draft.path), draft.conditions.track, draft.conditions.speed)
    keys = ("score", "class", "decided_by", "comfort_hours", "weighted_acceleration", "flange_margin", "safety_share")
    assert {key: said[key] for key in keys} == {key: shown[key] for key in keys}


@settings(max_examples=6, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow])
@given(steps=st.lists(actions(), max_size=10))
def test_railui_ride_says_of_a_saved_file_what_the_desk_said(steps: list[tuple[Any, ...]]) -> None:
    run("plain", steps, check_ride)


def test_a_design_of_a_calibrated_front_is_saved_with_contact_and_effects(bogie: Path) -> None:
    text = bogie.read_text()
    nominal = calibrated(load_design(bogie))
    assert nominal.source == bogie  # as a loop leaves it: in memory, but with the name of the declared file
    design = nominal.with_values({"vehicle.primary.lateral_stiffness": 5e6})
    draft = Draft(design, base=nominal, new_path=bogie.with_name("taken.yaml"))
    assert draft.is_modified and draft.path is None and draft.name == "taken.yaml"
    with pytest.raises(FileChanged, match="no file yet"):
        draft.save()
    saved = load_design(draft.save_as(draft.new_path))
    assert bogie.read_text() == text
    assert saved.content() == design.content() and saved.effects[-1].kind == "free_play"
    assert saved.value("contact.leading.conicity") == design.value("contact.leading.conicity")
    assert saved.adjustment == design.adjustment


def test_a_number_set_by_hand_has_no_deviation(bogie: Path) -> None:
    bogie.write_text(design_text(calibrated(load_design(bogie))))
    draft = Draft.load(bogie)
    adjustment = draft.design.adjustment
    assert adjustment is not None and draft.design.present_adjustment == adjustment
    kept, changed = adjustment.names
    draft.set(changed, 1.2 * draft.design.value(changed))
    sources = {field.path: field.source for field in draft.fields()}
    assert sources[kept] == "calibrated on a campaign"
    assert sources[changed].startswith("set by hand (estimate ") and "+/-" in sources[changed]
    saved = load_design(draft.save_as(bogie.with_name("other.yaml"))).adjustment
    assert saved is not None and saved.names == (kept,) and saved.covariance == ((1e-4,),)
    draft.undo()
    assert not draft.design.is_set_by_hand(changed)
    draft.set(kept, 1.2 * draft.design.value(kept))
    draft.set(changed, 1.2 * draft.design.value(changed))
    assert load_design(draft.save_as(bogie.with_name("third.yaml"))).adjustment is None


def test_an_existing_file_is_not_replaced_without_a_question(bogie: Path) -> None:
    other = bogie.with_name("other.yaml")
    other.write_text("name: somebody else's\n")
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    with pytest.raises(FileChanged, match="exists already") as caught:
        draft.save_as(other)
    assert other.read_text() == "name: somebody else's\n"
    assert caught.value.prepared is not None
    assert "-name: somebody else's" in caught.value.prepared.difference()


def test_the_own_name_in_save_as_does_not_replace_a_changed_file(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    changed = bogie.read_text().replace("3.0 MN/m", "3.3 MN/m") + "# theirs\n"
    bogie.write_text(changed)
    with pytest.raises(FileChanged, match="another program") as caught:
        draft.save_as(bogie)
    assert bogie.read_text() == changed
    prepared = caught.value.prepared
    assert prepared is not None
    difference = "\n".join(prepared.difference())
    assert "3.3 MN/m" in difference and "3000" in difference
    draft.write(prepared)  # what is on the screen, with the comments of the other
    assert "# theirs" in bogie.read_text() and load_design(bogie).content() == draft.design.content()


def test_a_file_changed_after_the_question_is_asked_about_again(bogie: Path) -> None:
    draft = Draft.load(bogie)
    draft.set("vehicle.frame.mass", 3000.0)
    bogie.write_text(bogie.read_text() + "# first\n")
    prepared = draft.prepare()
    bogie.write_text(bogie.read_text() + "# second\n")
    with pytest.raises(FileChanged, match="just been changed") as caught:
        draft.write(prepared)
    assert "# second" in bogie.read_text()
    assert caught.value.prepared is not None and "# second" in caught.value.prepared.text


def test_a_number_of_the_active_load_state_is_saved_in_this_state(tmp_path: Path) -> None:
    path = tmp_path / "loaded.yaml"
    load = "load:\n  state: laden\n  laden: {vehicle.frame.mass: 3500 kg}\n"
    path.write_text((REPOSITORY / "designs/test_bogie.yaml").read_text() + load)
    draft = Draft.load(path)
    draft.set("vehicle.frame.mass", 3600.0)
    draft.save()
    assert load_design(path).value("vehicle.frame.mass") == 3600.0
    assert "laden: {vehicle.frame.mass: 3600 kg}" in path.read_text()


def test_a_setting_that_was_undone_after_saving_is_saved_again(bogie: Path) -> None:
    bogie.write_text(bogie.read_text().replace("use: long_distance, ", ""))
    draft = Draft.load(bogie)
    draft.set("riding.guidance", "lateral_force")
    draft.set("riding.cushion_frequency", 4.0)
    draft.set("riding.cushion_damping", 0.3)
    draft.save()
    for _ in range(3):
        draft.undo()
    assert draft.is_modified
    with pytest.raises(FileChanged, match="without its comments") as caught:  # keys cannot be removed in place
        draft.save()
    assert caught.value.prepared is not None
    draft.write(caught.value.prepared)
    assert load_design(bogie).content() == draft.design.content() and not draft.is_modified


def test_undo_covers_design_base_track_and_speed(bogie: Path) -> None:
    draft = Draft.load(bogie, CONDITIONS)
    start = draft.states.current
    draft.set("vehicle.frame.mass", 3000.0)
    draft.set_base()
    draft.set_conditions(replace(CONDITIONS, speed=50.0), "speed")
    draft.swap_with_base()  # equal: no step
    draft.set("vehicle.frame.mass", 3100.0)
    draft.swap_with_base()
    states = [draft.states.current]
    while draft.undo() is not None:
        states.append(draft.states.current)
    assert len(states) == 6 and draft.states.current == start
    for state in reversed(states[:-1]):
        assert draft.redo() is not None
        assert draft.states.current == state
