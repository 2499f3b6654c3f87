"""The Optimise panel: a search set up from the form, its front as it grows, a walk along it, one design taken back."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.arrays import FloatArray
from railui.desk.messages import Done, Failed, Offered, Seen, Showed
from railui.desk.panels.common import arranged, in_turn, titled
from railui.desk.presenters.look import Case, Look, look
from railui.desk.presenters.quality import comparison
from railui.desk.presenters.search_progress import Searched, Step, step_of
from railui.desk.presenters.views import acceleration, displacement
from railui.desk.services.work import Latest, Study
from railui.desk.state.plan import Plan, variables
from railui.desk.widgets.axis import Axis
from railui.desk.widgets.bars import Bars
from railui.desk.widgets.dialogs import Faults, Pick
from railui.desk.widgets.form import Form
from railui.desk.widgets.form_side import FormSide
from railui.desk.widgets.picture import Picture
from railui.desk.widgets.plot import Plot
from railui.execution.session import Session
from railui.execution.threads import ThreadRunner
from railui.io.problems import FileProblems
from railui.optimisation.optimise import SearchState, optimise
from railui.vehicle.design_reader import Design

EMPTY = Picture(Axis(""), Axis(""), wait="s starts the search")


class OptimisePanel(Vertical):
    """The plan on the left; front, designs, convergence and what the chosen design does on the right."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("s", "start", "Start"),
        Binding("p", "pause", "Pause"),
        Binding("k", "stop", "Stop"),
        Binding("f", "front", "Front"),
        Binding("v", "view(1)", "View"),
        Binding("t", "take", "Take design"),
        Binding("a", "add", "Variable"),
        Binding("g", "aim", "Aim", show=False),
        Binding("delete", "remove", "Remove", show=False),
        Binding("d", "design", "From form", show=False),
        Binding("c", "copy", "Copy", show=False),
    ]
    HELP = """
## Optimise
The plan on the left begins with the design in the form (`d` takes it anew): which numbers may vary and how far, what is
aimed at, which limits hold, on which track, speeds and seeds. `a` adds a variable, `g` an aim, Delete removes the one
under the cursor. `s` starts, `p` pauses, `k` stops; every evaluation is kept in the directory of the plan, so that `s`
goes on where it ended, and `railui optimise` does too. `f` goes to the front: up and down walk along it, the pictures
show what each design does beside the design as it is, and the cross on the front what its aims are on seeds that the
search never saw: mean and one standard deviation. `t` takes it into the form.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.plan: Plan | None = None
        self.study: Study | None = None
        self.view, self.touched = 0, False
        self.latest = Latest(self, "look")
        self.declared: Look | None = None
        self.searched: Searched | None = None
        self.doing, self.fresh = "", ""

    @property
    def steps(self) -> list[Step]:
        """The generations so far."""
        return self.searched.steps if self.searched else []

    @property
    def result(self) -> dict[str, Any] | None:
        """The result, once there is one."""
        return self.searched.result if self.searched else None

    def compose(self) -> ComposeResult:
        with Horizontal():
            yield FormSide("Plan", "a variable · g aim · del · s start", id="plan")
            with Vertical(id="search"):
                yield Static(id="stand", classes="pane")
                with Grid(id="search-parts"):
                    yield Plot(EMPTY, "Front", id="front")
                    yield Bars("Designs of the front", "", id="designs", cursor=True)
                    yield Plot(EMPTY, "Displacement spectrum", id="search-displacement")
                    yield Plot(EMPTY, "Comfort spectrum", id="search-comfort")
                    yield Static(id="search-quality", classes="pane")
                    yield Plot(EMPTY, "Convergence", id="convergence")

    def on_mount(self) -> None:
        self.query_one("#stand").border_title = "Search"
        self.query_one("#search-quality").border_title = "Design under the cursor"
        self._state()

    @property
    def side(self) -> FormSide:
        """The form of the plan."""
        return self.query_one(FormSide)

    # the plan

    def begin(self, design: Design, case: Case) -> None:
        """A plan for the design in the form, as long as nobody has changed it or searched."""
        if self.touched or self.steps or self.study is not None:
            return
        if self.plan is None or self.plan.design is not design:
            self.set_plan(Plan.of(design, case.track, case.speed))

    def open(self, path: Path) -> None:
        """The plan of a study file; FileProblems with every fault."""
        self.set_plan(Plan.read(path))
        self.touched = True

    def set_plan(self, plan: Plan) -> None:
        """Another plan in the form."""
        self.plan = plan
        base: dict[str, float] = {}
        for path in plan.bounds:
            base |= {f"bounds.{path}.{end}": plan.design.value(path) for end in ("lowest", "highest")}
        self.side.fill(list(plan.rows()), base)
        self._state()

    @on(Form.Wanted)
    def _wanted(self, event: Form.Wanted) -> None:
        if self.plan is None:
            return
        self.touched = True
        try:
            self.set_plan(self.plan.changed(event.path, event.value))
        except ValueError as error:
            self.side.refused(str(error))
        else:
            self.side.accepted()

    @on(Form.Reset)
    def _reset(self, event: Form.Reset) -> None:
        self.action_remove()

    def action_add(self) -> None:
        if self.plan is not None:
            self.app.push_screen(Pick("Vary which parameter?", variables(self.plan.design)), self._add)

    def _add(self, path: str | None) -> None:
        if path is not None and self.plan is not None:
            self.touched = True
            self.set_plan(self.plan.with_variable(path))
            self.side.form.choose(f"bounds.{path}.lowest")

    def action_aim(self) -> None:
        if self.plan is not None:
            self.set_plan(self.plan.with_aim())
            self.side.form.choose(f"aims.{len(self.plan.aims) - 1}.aim")

    def action_remove(self) -> None:
        field = self.side.form.field
        if field is not None and self.plan is not None:
            self.set_plan(self.plan.without(field.path))

    def action_design(self) -> None:
        """The design in the form takes the plan's own one's place."""
        self.post_message(self.Wished())

    class Wished(Message):
        """The design in the form is wished for the plan."""

    def take_design(self, design: Design) -> None:
        """Plans with another design, its variables where it has them."""
        if self.plan is not None:
            bounds = {p: b for p, b in self.plan.bounds.items() if p in design.paths()}
            self.set_plan(replace(self.plan, design=design, bounds=bounds, study=None, scenarios="usual"))

    # the search

    def action_start(self) -> None:
        if self.plan is None:
            self.notify("open a design first: ctrl+o")
            return
        if self.study is not None:
            self.notify("the search is running: k stops it")
            return
        try:
            study = self.plan.resolved()
        except FileProblems as error:
            self.app.push_screen(Faults("the plan", error))
            return
        except (OSError, RuntimeError, ValueError) as error:  # a directory that cannot be written, or is no path
            self.doing = f"{error}: change the directory of the plan"
            self.notify(self.doing, severity="error", timeout=12)
            self._state()
            return
        self.searched, self.declared = Searched(self.plan), None
        self.doing, self.fresh = "", ""
        where = Path(self.plan.directory).expanduser()
        self.study = Study(self, "search", lambda job: self._search(job, study, where))
        self._everything()

    def _search(self, job: Study, study: Any, where: Path) -> Message:
        """The whole search, in a thread; what it evaluated is kept in its directory."""
        with Session(study, where, ThreadRunner()) as session:

            def watch(stand: SearchState) -> None:
                session.watch(stand)
                job.checkpoint()
                self.post_message(Showed("search", step_of(study, stand)))

            found = optimise(study, evaluator=session.evaluator, watch=watch)
            session.finish(_document(study, found))
        return Done("search", found)

    def action_pause(self) -> None:
        if self.study is not None:
            self.study.pause()
            self._state()

    def action_stop(self) -> None:
        if self.study is not None:
            self.study.stop()
            self.doing = "stopping after this generation"
            self._state()

    @on(Showed)
    def _showed(self, message: Showed) -> None:
        step: Step | None = message.event
        if step is not None and self.searched is not None:
            self.doing, self.fresh = step.doing, ""
            if self.searched.take(step):
                self._front()
                self._convergence()
        self._state()

    @on(Done)
    def _done(self, message: Done) -> None:
        assert self.searched is not None
        self.study, self.searched.result = None, message.result
        self.doing = f"finished: {len(message.result['pareto'])} designs on the front"
        if message.result["warnings"]:
            self.notify("\n".join(message.result["warnings"]), title="Mind", timeout=12)
        self._everything()
        if message.result["knee"] is not None:
            self.query_one("#designs", Bars).choose(message.result["knee"])

    @on(Failed)
    def _failed(self, message: Failed) -> None:
        if message.name == "look":
            self.notify(message.text, severity="warning")
            return
        self.study = None
        self.doing = "stopped: s goes on where it ended" if message.stopped else message.text
        self._everything()
        if not message.stopped:
            self.notify(message.text, severity="error", timeout=10)

    def points(self) -> tuple[FloatArray, FloatArray]:
        """Designs [n, variable] of the front and their aims [n, aim]."""
        return self.searched.points() if self.searched else (np.zeros((0, 0)), np.zeros((0, 2)))

    # drawing

    def _everything(self) -> None:
        in_turn(self, [self._front, self._convergence, self._state])

    def _state(self) -> None:
        """The vehicle, what goes on, and how long it will take."""
        stand = self.query_one("#stand", Static)
        plan = self.searched.plan if self.searched else self.plan
        text = Text(no_wrap=True, overflow="ellipsis")
        if plan is None:
            text.append("No design: ctrl+o opens one, or a study.", "dim")
            stand.update(text, layout=False)
            return
        adjusted = plan.design.adjustment
        text.append(f"{plan.design.name}\n", "bold")
        whose = f"contact as adjusted to {adjusted.campaign}" if adjusted else "contact as declared, not adjusted"
        text.append(f"{whose}\n", "" if adjusted else "yellow")
        text.append(self.doing or "s starts the search", "" if self.doing else "dim")
        text.append(f"\n{self.fresh}")
        stand.update(text, layout=False)
        study, share = self.study, self.searched.share if self.searched else 0.0
        if study is None:
            titled(stand, sub="")
            return
        left = f"{study.seconds * (1 - share) / share:.0f} s to go" if share > 0 else "beginning"
        titled(stand, sub="paused: p goes on" if study.paused else f"{100 * share:.0f} % · {left}")

    def _front(self) -> None:
        """The front and its designs."""
        plot, bars, searched = self.query_one("#front", Plot), self.query_one("#designs", Bars), self.searched
        if searched is None or not (searched.steps or searched.result):
            plot.show(EMPTY)
            bars.show([])
            return
        bars.show(searched.design_rows())
        titled(bars, sub=", ".join(searched.names))
        plot.show(searched.front_picture(bars.at))

    def _convergence(self) -> None:
        wait = Picture(Axis(""), Axis(""), wait="after two generations")
        self.query_one("#convergence", Plot).show(self.searched.convergence_picture() if self.searched else wait)

    # walking along the front

    @on(Bars.Chosen)
    def _chosen(self, event: Bars.Chosen) -> None:
        self._front()
        searched = self.searched
        values = searched.values(event.index) if searched else None
        if searched is None or values is None:
            return
        self.doing, self.fresh = searched.told(event.index), searched.told_fresh(event.index)
        self._state()
        plan = searched.plan
        case = Case(f"{plan.track} seed={plan.seeds.split(',')[0].strip()}", plan.speed)
        self.latest.ask(partial(_looked, plan.design, values, case, self.declared))

    @on(Seen)
    def _seen(self, event: Seen) -> None:
        self.declared = event.base
        quality = self.query_one("#search-quality", Static)
        width = max(24, quality.content_size.width)
        spread = self.searched.compared(self.query_one("#designs", Bars).at, width) if self.searched else ""
        text = Text(f"{spread}\n\n" if spread else "", no_wrap=True, overflow="ellipsis")
        text.append_text(comparison(event.look, event.base, quality.size.width))
        quality.update(text, layout=False)
        for name, view in (("displacement", displacement), ("comfort", acceleration)):
            self.query_one(f"#search-{name}", Plot).show(view(event.look, event.base))

    def action_front(self) -> None:
        bars = self.query_one("#designs", Bars)
        if not bars.display:
            self.view = 1
            self._arrange()
        bars.focus()
        if bars.rows:
            bars.choose(bars.at)

    def action_take(self) -> None:
        at = self.query_one("#designs", Bars).at
        values = self.searched.values(at) if self.searched else None
        if self.searched is None or values is None:
            self.notify("no design yet: s starts the search")
            return
        declared = self.searched.plan.design
        self.post_message(Offered(f"design {at + 1} of the front", declared.with_values(values), declared))

    def action_copy(self) -> None:
        self.query_one("#designs", Bars).action_copy()

    # arranging

    def on_resize(self, event: Resize) -> None:
        self._arrange()

    def _arrange(self) -> None:
        names = ("front", "designs", "search-quality", "search-displacement", "search-comfort", "convergence")
        arranged(self.query_one("#search-parts", Grid), [self.query_one(f"#{name}") for name in names], self.view)

    def action_view(self, by: int) -> None:
        self.view = (self.view + by) % 6
        self._arrange()


def _looked(design: Design, values: dict[str, float], case: Case, declared: Look | None) -> Message:
    """Looks at a design of the front beside the design as it is."""
    base = declared if declared is not None and declared.case == case else look(design, case)
    return Seen(look(design.with_values(values), case), base)


def _document(study: Any, found: dict[str, Any]) -> dict[str, Any]:
    """The result as `railui optimise` writes it."""
    import railui
    from railui.core import simd
    from railui.io.atomic import finite

    head = {"schema": "railui.optimise/1", "version": railui.__version__, "inputs": [], "seed": study.method.seed,
            "simd": simd()}  # fmt: skip
    return {**head, **finite(found)}
