"""The Design panel: a vehicle as a form, and on every change what it does on its track beside its base."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.desk.messages import Done, Failed, Seen
from railui.desk.panels.common import arranged, titled
from railui.desk.presenters.effects import choices, placed
from railui.desk.presenters.look import Case, Look, laid, look, road, with_curves
from railui.desk.presenters.quality import comparison
from railui.desk.presenters.views import VIEWS, WINDOWS
from railui.desk.presenters.written import value_text
from railui.desk.services.work import Latest, Study
from railui.desk.state.draft import Draft, Field, Moved
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.dialogs import Name, Pick
from railui.desk.widgets.form import Form, Head
from railui.desk.widgets.form_side import FormSide
from railui.desk.widgets.picture import Picture
from railui.desk.widgets.plot import Plot
from railui.hunting.summary import stability
from railui.io.problems import FileProblems
from railui.io.units import read_speed

EMPTY = Picture(Axis(""), Axis(""), wait="no design: ctrl+o opens one")
CASE = ("case.track", "case.speed")
OF_PROFILES = (".wheel_load", ".rolling_radius")  # on which depends what measured profiles give


class DesignPanel(Vertical):
    """The form on the left, what the design does on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("ctrl+z", "undo", "Undo", show=False),
        Binding("ctrl+y", "redo", "Redo", show=False),
        Binding("v", "view(1)", "View"),
        Binding("V", "view(-1)", "View back", show=False),
        Binding("b", "base", "Base"),
        Binding("x", "exchange", "A/B"),
        Binding("a", "add", "Effect"),
        Binding("delete", "remove", "Remove effect", show=False),
        Binding("l", "limits", "Critical V"),
        Binding("t", "track", "Track", show=False),
        Binding("c", "copy", "Copy", show=False),
    ]
    HELP = """
## Design
Every change rides the design anew on its track and shows riding quality, spectra, modes and series beside the **base**
(grey): the file as it was read, or what `b` made the base. `x` exchanges the two, A against B.
`ctrl+z` undoes, `ctrl+y` does again, `ctrl+s` saves: the numbers change in the file, its comments stay.
`l` looks for the critical speeds: linear, of the fold, in practice on this track.
`v` shows other pictures, `a` adds an effect of the catalogue, Delete removes the one under the cursor.
Track and speed stand on top of the form; they belong to the desk, not to the file.
"""

    class Changed(Message):
        """The design, or what it rides on, is another."""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.draft: Draft | None = None
        self.case = Case()
        self.view = 0
        self.looks: tuple[Look, Look] | None = None
        self.latest = Latest(self, "look")

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield FormSide("Design", "←→ slide · type · ⌫ base · / find", id="design-form")
            with Vertical(id="answer"):
                yield Static(id="quality")
                with Grid(id="plots"):
                    for i, name in enumerate(VIEWS):
                        yield Plot(EMPTY, name, id=f"view{i}", window=WINDOWS.get(name, (0.0, 1.0)))

    def on_mount(self) -> None:
        self.query_one("#quality").border_title = "Riding quality"

    @property
    def side(self) -> FormSide:
        """The form."""
        return self.query_one(FormSide)

    # the design

    def open(self, draft: Draft) -> None:
        """Another design on the desk."""
        self.draft, self.looks = draft, None
        self._changed()
        self.query_one(Form).focus()

    def _changed(self) -> None:
        """The form and all that is computed, anew; the last pictures stay until then."""
        if self.draft is None:
            return
        self.side.fill(self._rows(self.draft), self.draft.base.values)
        titled(self.side, f"{self.draft.name}{' ●' if self.draft.dirty else ''}")
        self.latest.ask(partial(_seen, self.draft.design, self.draft.base, self.case, self.looks))
        self.post_message(self.Changed())

    def _rows(self, draft: Draft) -> list[Head | Field]:
        speed = Field("case.speed", "V", "speed", "m/s", self.case.speed, 5.0, 100.0, False, "the desk")
        track = Field("case.track", "", "track", "", self.case.track, 0, 1, False, "the desk")
        rows: list[Head | Field] = [Head("rides on"), track, speed]
        profiles = draft.design.profiles
        if profiles is not None:
            rows.append(Head(f"contact: {profiles.wheel.stem} on {profiles.rail.stem}, {profiles.given['use']}"))
        last = ""
        for field in draft.fields():
            if field.group != last:
                last = field.group
                rows.append(Head(self._heading(draft, last)))
            rows.append(field)
        return rows

    def _heading(self, draft: Draft, group: str) -> str:
        if group.startswith("effects."):
            effect = draft.design.effects[int(group.split(".")[1])]
            which = f" {effect.wheelset}" if effect.wheelset else ""
            return f"{effect.kind.replace('_', ' ')} at {effect.at.replace('_', ' ')}{which}"
        for whole in ("vehicle.", "bodies.", "elements."):
            group = group.removeprefix(whole)
        return group.replace(".", " ").replace("_", " ")

    # what the form asks for

    @on(Form.Wanted)
    def _wanted(self, event: Form.Wanted) -> None:
        self.set(event.path, event.value, event.gesture)

    @on(Form.Reset)
    def _reset(self, event: Form.Reset) -> None:
        if self.draft is not None and event.path not in CASE:
            self.draft.reset(event.path)
            self._changed()

    def set(self, path: str, value: Any, gesture: str = "") -> bool:
        """Another value at a path of the design or of the case; says what is wrong where it does not fit."""
        trouble = ""
        try:
            if path in CASE:
                self._set_case(path, value)
            elif self.draft is not None:
                self.draft.set(path, value, gesture)
        except FileProblems as error:
            first = error.problems[0]
            trouble = ", ".join(t for t in (first.message, first.remedy) if t)
        except ValueError as error:
            trouble = str(error)
        if trouble:
            self.side.refused(trouble)
            return False
        self._changed()
        self.side.accepted()
        if self.draft is not None and self.draft.design.profiles is not None and path.endswith(OF_PROFILES):
            self.notify("what the profiles give stays as it is until the file is saved and read again", timeout=8)
        return True

    def _set_case(self, path: str, value: Any) -> None:
        case = replace(self.case, speed=read_speed(value)) if path == "case.speed" else replace(self.case, track=value)
        road(case)
        self.case = case

    # what was computed

    @on(Seen)
    def _seen_it(self, event: Seen) -> None:
        self.looks = (event.look, event.base)
        if event.look.guiding_force is None or event.base.guiding_force is None:
            self.latest.ask(partial(_curved, event.look, event.base), unless_waiting=True)
        self._quality()
        self._draw([(self.view + k) % len(VIEWS) for k in range(len(VIEWS))], self.looks)

    def _quality(self) -> None:
        """The numbers, as wide as there is room for."""
        quality = self.query_one("#quality", Static)
        if self.looks is not None:
            quality.update(comparison(*self.looks, quality.size.width), layout=False)
            titled(quality, sub="")

    def _draw(self, order: list[int], looks: tuple[Look, Look]) -> None:
        """One picture after the other, each in a refresh of its own: so no key waits for all of them."""
        if looks is not self.looks:
            return  # newer ones are being drawn
        for k, i in enumerate(order):
            plot = self.query_one(f"#view{i}", Plot)
            plot.show(list(VIEWS.values())[i](*looks))
            if plot.display:
                self.call_after_refresh(self._draw, order[k + 1 :], looks)
                return

    @on(Failed)
    def _failed(self, event: Failed) -> None:
        titled(self.query_one("#quality"), sub="no new result")
        self.side.refused(event.text.splitlines()[0])

    # pictures

    def on_resize(self, event: Resize) -> None:
        self._arrange()
        self.call_after_refresh(self._quality)

    def _arrange(self) -> None:
        """As many pictures as there is room for, from the chosen one on."""
        plots = [self.query_one(f"#view{i}") for i in range(len(VIEWS))]
        arranged(self.query_one("#plots", Grid), plots, self.view)

    def action_view(self, by: int) -> None:
        self.view = (self.view + by) % len(VIEWS)
        self._arrange()

    # actions

    def action_undo(self) -> None:
        self._told(self.draft.undo() if self.draft else None, "undone", "nothing to undo")

    def action_redo(self) -> None:
        self._told(self.draft.redo() if self.draft else None, "done again", "nothing to do again")

    def _told(self, what: str | None, done: str, nothing: str) -> None:
        self.notify(f"{done}: {what}" if what else nothing, timeout=2)
        self._changed()

    def action_base(self) -> None:
        if self.draft is not None:
            self.draft.compare_with_this()
            self.notify("this is the base now", timeout=2)
            self._changed()

    def action_exchange(self) -> None:
        if self.draft is not None:
            self.draft.exchange()
            self._changed()

    def action_limits(self) -> None:
        """Linear critical speed, the fold below which hunting dies, and the one in practice on this track."""
        if self.draft is None:
            return
        design, track = self.draft.design, self.case.track
        self.notify("looking for the fold and for the critical speed in practice", timeout=4)

        def job(study: Study) -> Message:
            return Done("limits", stability(design, fold=True, track=laid(track), told=study.checkpoint))

        Study(self, "limits", job)

    @on(Done)
    def _limits(self, message: Done) -> None:
        found = message.result

        def speed(key: str) -> str:
            return "none up to 90 m/s" if found[key] is None else f"{found[key]:.4g} m/s"

        told = [
            f"linear critical speed: {speed('linear_critical_speed')}",
            f"fold, below which hunting dies: {speed('fold_speed')}",
            f"in practice on {self.case.track.split()[0]}: {speed('practical_critical_speed')}",
        ]
        self.notify("\n".join(told), title="Critical speeds", timeout=30)

    def action_track(self) -> None:
        self.query_one(Form).choose("case.track")
        self.query_one(Form).action_type()

    def action_add(self) -> None:
        if self.draft is not None:
            self.app.push_screen(Pick("Add an effect", choices(self.draft.design)), self._add)

    def _add(self, chosen: str | None) -> None:
        if chosen is None or self.draft is None:
            return
        try:
            self.draft.with_effect(placed(chosen))
        except FileProblems as error:
            self.notify(error.problems[0].message, severity="error")
            return
        self._changed()
        index = len(self.draft.design.effects) - 1
        first = next((p for p in self.draft.design.paths() if p.startswith(f"effects.{index}.")), None)
        if first is not None:
            self.query_one(Form).choose(first)

    def action_remove(self) -> None:
        field = self.query_one(Form).field
        if field is not None and self.draft is not None and field.path.startswith("effects."):
            self.draft.without_effect(int(field.path.split(".")[1]))
            self._changed()

    def action_copy(self) -> None:
        """The value under the cursor, or the whole comparison where that has the keys."""
        field = self.query_one(Form).field
        if field is not None:
            self.app.copy_to_clipboard(value_text(field))
            self.notify(f"copied {value_text(field)}", timeout=2)

    def save(self) -> None:
        """Saves into the file, or asks for a name."""
        if self.draft is None:
            return
        try:
            path = self.draft.save()
        except Moved as reason:
            self.notify(str(reason), severity="warning")
            self.save_as()
            return
        except (FileProblems, OSError) as error:
            self.notify(str(error), severity="error")
            return
        self.notify(f"saved {path}", timeout=3)
        self._changed()

    def save_as(self) -> None:
        """Saves under a name."""
        if self.draft is not None:
            begin = str(self.draft.file.source or f"{self.draft.name}.yaml")
            self.app.push_screen(Name("Save as", begin), self._save_as)

    def _save_as(self, name: str | None) -> None:
        if name is None or self.draft is None:
            return
        path = Path(name).expanduser()
        path = path if path.suffix in (".yaml", ".yml") else path.with_name(f"{path.name}.yaml")
        if path.exists() and path != self.draft.file.source:
            self.notify(f"{path} exists: choose another name", severity="error")
            return
        try:
            self.draft.save_as(path)
        except (FileProblems, OSError) as error:
            self.notify(str(error), severity="error")
            return
        self.notify(f"saved {path}", timeout=3)
        self._changed()


def _curved(now: Look, base: Look) -> Message:
    """The same looks with their stands in curves."""
    found = with_curves(now) if now.guiding_force is None else now
    return Seen(found, found if base is now else with_curves(base) if base.guiding_force is None else base)


def _seen(design: Any, base: Any, case: Case, last: tuple[Look, Look] | None) -> Message:
    """Looks at a design and at its base; what is known already is not computed again."""
    known = [seen for seen in last or () if seen.case == case]

    def of(wanted: Any) -> Look:
        same = next((seen for seen in known if seen.design.resolved() == wanted.resolved()), None)
        if same is None:
            same = look(wanted, case)
            known.append(same)
        return same

    return Seen(of(design), of(base))
