"""The Optimise panel: a search set up from the form, its front as it grows, a walk along it, one design taken back."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray
from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, Horizontal, Vertical
from textual.events import Resize
from textual.message import Message
from textual.widgets import Static

from railui.desk.axis import Axis
from railui.desk.bars import Bar, Bars
from railui.desk.dialogs import Faults, Pick
from railui.desk.form import Form, pretty
from railui.desk.form_side import FormSide
from railui.desk.look import Case, Look, look
from railui.desk.messages import Done, Failed, Offered, Seen, Showed
from railui.desk.panels.common import arranged, in_turn, titled
from railui.desk.plan import Plan, aim_unit, variables
from railui.desk.plot import Line, Mark, Picture, Plot
from railui.desk.quality import comparison
from railui.desk.views import acceleration, displacement
from railui.desk.work import Latest, Study
from railui.engine.local import Local
from railui.engine.session import Session
from railui.files.design import Design
from railui.files.display import display
from railui.files.problems import FileProblems
from railui.study.aims import violations
from railui.study.optimise import Stand, optimise
from railui.study.pareto import hypervolumes, knee

Floats = NDArray[np.float64]
EMPTY = Picture(Axis(""), Axis(""), wait="s starts the search")


@dataclass(frozen=True, eq=False)
class Step:
    """A generation as the panel keeps it: designs, aims, which keep all limits, aims of the design as it is."""

    x: Floats
    aims: Floats
    kept: NDArray[np.bool_]
    evaluations: int
    failed: int
    doing: str
    baseline: Floats


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
show what each design does beside the design as it is. `t` takes it into the form.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.plan: Plan | None = None
        self.study: Study | None = None
        self.view, self.touched = 0, False
        self.latest = Latest(self, "look")
        self.declared: Look | None = None
        self._forget()

    def _forget(self) -> None:
        self.steps: list[Step] = []
        self.result: dict[str, Any] | None = None
        self.searched: Plan | None = None
        self.doing = ""

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
        self._forget()
        self.searched = self.plan
        self.declared = None
        where = Path(self.plan.directory).expanduser()
        self.study = Study(self, "search", lambda job: self._search(job, study, where))
        self._everything()

    def _search(self, job: Study, study: Any, where: Path) -> Message:
        """The whole search, in a thread; what it evaluated is kept in its directory."""
        with Session(study, where, Local()) as session:

            def watch(stand: Stand) -> None:
                session.watch(stand)
                job.checkpoint()
                self.post_message(Showed("search", _step(study, stand)))

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
        if step is not None:
            self.doing = step.doing
            if not self.steps or step.evaluations > self.steps[-1].evaluations:
                self.steps.append(step)
                self._front()
                self._convergence()
        self._state()

    @on(Done)
    def _done(self, message: Done) -> None:
        self.study, self.result = None, message.result
        self.doing = f"finished: {len(message.result['pareto'])} designs on the front"
        if message.result["warnings"]:
            self.notify("\n".join(message.result["warnings"]), title="Mind", timeout=12)
        self._everything()
        if self.result and self.result["knee"] is not None:
            self.query_one("#designs", Bars).choose(self.result["knee"])

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

    # what is known

    def points(self) -> tuple[Floats, Floats]:
        """Designs [n, variable] of the front and their aims [n, aim]: the result's, or the best so far."""
        plan = self.searched
        if plan is None or (not self.steps and self.result is None):
            return np.zeros((0, 0)), np.zeros((0, 2))
        if self.result is not None:
            found = self.result["pareto"]
            x = np.array([list(p["variables"].values()) for p in found]).reshape(len(found), -1)
            told = [[np.nan if v is None else v for v in p["objectives"]] for p in found]
            return x, np.array(told, dtype=float).reshape(len(found), -1)
        x = np.vstack([step.x[step.kept] for step in self.steps])
        aims = np.vstack([step.aims[step.kept] for step in self.steps])
        if not len(aims):
            return x, aims
        better = aims * senses(plan)
        worse = np.all(better[:, None] >= better, axis=2) & np.any(better[:, None] > better, axis=2)
        kept = np.flatnonzero(~worse.any(axis=1))
        order = kept[np.argsort(better[kept, 0], kind="stable")]
        return x[order], aims[order]

    # drawing

    def _everything(self) -> None:
        in_turn(self, [self._front, self._convergence, self._state])

    def _state(self) -> None:
        """The vehicle, what goes on, and how long it will take."""
        stand, plan = self.query_one("#stand", Static), self.searched or self.plan
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
        stand.update(text, layout=False)
        study = self.study
        if study is None:
            titled(stand, sub="")
            return
        share = (self.steps[-1].evaluations if self.steps else 0) / (plan.population * plan.generations)
        left = f"{study.seconds * (1 - share) / share:.0f} s to go" if share > 0 else "beginning"
        titled(stand, sub="paused: p goes on" if study.paused else f"{100 * share:.0f} % · {left}")

    def _front(self) -> None:
        """All designs tried, the front, the design as it is, the one under the cursor."""
        plan, plot, bars = self.searched, self.query_one("#front", Plot), self.query_one("#designs", Bars)
        x, aims = self.points()
        if plan is None or not (self.steps or self.result):
            plot.show(EMPTY)
            bars.show([])
            return
        self._designs(plan, bars, x, aims)
        if len(plan.aims) < 2:
            plot.show(Picture(Axis(""), Axis(""), wait="one aim: see the convergence"))
            return
        names = [Axis(aim.split()[-1].replace("_", " "), aim_unit(aim)) for aim, _ in plan.aims]
        lines = []
        tried = np.vstack([step.aims[step.kept] for step in self.steps]) if self.steps else np.zeros((0, 2))
        if len(tried):
            low, high = _frame(np.vstack([aims, tried]) if len(aims) else tried)
            near = np.all((tried[:, :2] >= low) & (tried[:, :2] <= high), axis=1)
            lines.append(Line(tried[near, 0], tried[near, 1], "tried", "base", points=True))
        lines.append(Line(aims[:, 0], aims[:, 1], "front", "now"))
        marks = []
        if self.steps and np.all(np.isfinite(self.steps[-1].baseline)):
            one = self.steps[-1].baseline
            marks.append(Mark(float(one[0]), float(one[1]), "x", "as it is", "other"))
            lines.append(Line(one[:1], one[1:2], "", "other", points=True))
        if bars.rows and bars.at < len(aims):
            marks.append(Mark(float(aims[bars.at, 0]), float(aims[bars.at, 1]), "o", f"{bars.at + 1}", "limit"))
        plot.show(Picture(names[0], names[1], lines, marks=marks))

    def _designs(self, plan: Plan, bars: Bars, x: Floats, aims: Floats) -> None:
        """A row per design of the front: its aims, and where it lies between the best and the worst of the first."""
        best = self.result["knee"] if self.result is not None else None
        if best is None and len(aims) > 1:
            best = knee(aims, senses(plan))
        width = float(np.ptp(aims[:, 0])) if len(aims) else 0.0
        rows = []
        for i, values in enumerate(aims):
            told = "  ".join(f"{value:8.4g}" for value in values)
            share = 1 - abs(values[0] - aims[0, 0]) / width if width else 1.0
            rows.append(Bar(f"{i + 1}{' knee' if i == best else ''}", float(share), told, strong=i == best))
        bars.show(rows)
        titled(bars, sub=", ".join(aim.split()[-1].replace("_", " ") for aim, _ in plan.aims))

    def _convergence(self) -> None:
        plot, plan = self.query_one("#convergence", Plot), self.searched
        if plan is None or len(self.steps) < 2:
            plot.show(Picture(Axis(""), Axis(""), wait="after two generations"))
            return
        count = np.array([float(step.evaluations) for step in self.steps])
        if len(plan.aims) == 1:
            best = senses(plan)[0] * np.array(
                [np.min(s.aims[s.kept] * senses(plan), initial=np.inf) for s in self.steps]
            )
            aim = plan.aims[0][0]
            name = Axis(aim.split()[-1].replace("_", " "), aim_unit(aim))
            plot.show(Picture(Axis("designs"), name, [Line(count, best, "best")]))
            return
        volumes = hypervolumes([(s.evaluations, s.aims[s.kept] * senses(plan)) for s in self.steps])
        if volumes:
            y = np.array([one["hypervolume"] for one in volumes])
            plot.show(Picture(Axis("designs"), Axis("hypervolume", low=0.0, high=1.05), [Line(count, y, "")]))

    # walking along the front

    @on(Bars.Chosen)
    def _chosen(self, event: Bars.Chosen) -> None:
        x, _ = self.points()
        self._front()
        if self.searched is None or event.index >= len(x):
            return
        plan = self.searched
        values = dict(zip(plan.bounds, x[event.index].tolist(), strict=True))
        self.doing = _told(plan.design, values)
        self._state()
        case = Case(f"{plan.track} seed={plan.seeds.split(',')[0].strip()}", plan.speed)
        self.latest.ask(partial(_looked, plan.design, values, case, self.declared))

    @on(Seen)
    def _seen(self, event: Seen) -> None:
        self.declared = event.base
        quality = self.query_one("#search-quality", Static)
        quality.update(comparison(event.look, event.base, quality.size.width), layout=False)
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
        x, _ = self.points()
        at = self.query_one("#designs", Bars).at
        if self.searched is None or at >= len(x):
            self.notify("no design yet: s starts the search")
            return
        values = dict(zip(self.searched.bounds, x[at].tolist(), strict=True))
        declared = self.searched.design
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


def senses(plan: Plan) -> Floats:
    """1 for every aim of which less is better, -1 where more is."""
    return np.array([1.0 if aim.startswith("minimise") else -1.0 for aim, _ in plan.aims])


def _step(study: Any, stand: Stand) -> Step | None:
    """What the panel keeps of a generation; copied, for the search goes on."""
    one = stand.latest
    if one is None:
        return None
    kept = np.all(violations(study, one.judged) <= 0, axis=1)
    baseline = stand.baseline.objectives[0] if stand.baseline is not None else np.full(len(study.objectives), np.nan)
    return Step(
        one.x.copy(), one.judged.objectives.copy(), kept, stand.evaluations, stand.failed, stand.doing, baseline
    )


def _frame(aims: Floats) -> tuple[Floats, Floats]:
    """Ends between which points are drawn: those far outside would hide the front."""
    low, high = np.nanpercentile(aims[:, :2], [0, 90], axis=0)
    spread = high - low
    return low - 0.5 * spread, high + 0.5 * spread


def _told(design: Design, values: dict[str, float]) -> str:
    """A design of the front in words: each variable beside what it is now."""
    parts = []
    for path, value in values.items():
        unit, name = design.unit(path), path.split(".")[-1].replace("_", " ")
        parts.append(f"{name} {pretty(display(value, unit, 3))} (is {pretty(display(design.value(path), unit, 3))})")
    return ", ".join(parts)


def _looked(design: Design, values: dict[str, float], case: Case, declared: Look | None) -> Message:
    """Looks at a design of the front beside the design as it is."""
    base = declared if declared is not None and declared.case == case else look(design, case)
    return Seen(look(design.with_values(values), case), base)


def _document(study: Any, found: dict[str, Any]) -> dict[str, Any]:
    """The result as `railui optimise` writes it."""
    import railui
    from railui.core import simd
    from railui.files.writing import finite

    head = {"schema": "railui.optimise/1", "version": railui.__version__, "inputs": [], "seed": study.method.seed,
            "simd": simd()}  # fmt: skip
    return {**head, **finite(found)}
