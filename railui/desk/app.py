"""The desk itself: its panels, files, keys and commands; what the panels do is in the panels."""

from __future__ import annotations

import asyncio
from collections.abc import Iterable
from pathlib import Path
from typing import Any, ClassVar

from rich.text import Text
from textual import on
from textual.app import App, ComposeResult, SystemCommand
from textual.binding import Binding
from textual.containers import Horizontal
from textual.dom import DOMNode
from textual.screen import Screen
from textual.widgets import ContentSwitcher, Footer, Static

from railui.desk import log
from railui.desk.heartbeat import Heartbeat, settled, unhindered
from railui.desk.messages import Offered
from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.capture import CapturePanel
from railui.desk.panels.design import DesignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.panels.track import TrackPanel
from railui.desk.presenters.look import Case
from railui.desk.services.ours import files_below, kind_of
from railui.desk.state.draft import Draft
from railui.desk.widgets.dialogs import Ask, Faults, Help, Pick
from railui.desk.widgets.tabs import PANELS, Tabs
from railui.io.problems import FileProblems, one_problem

SMALLEST = (60, 18)


class Desk(App[None]):
    """The terminal desk of railui."""

    CSS_PATH = "desk.tcss"
    TITLE = "railui"
    HORIZONTAL_BREAKPOINTS = [  # noqa: RUF012
        (0, "-tiny"), (SMALLEST[0], "-narrow"), (100, "-mid"), (140, "-wide"),
    ]  # fmt: skip
    VERTICAL_BREAKPOINTS = [  # noqa: RUF012
        (0, "-flat"), (SMALLEST[1], "-low"), (36, "-high"),
    ]  # fmt: skip
    BINDINGS: ClassVar[list[Any]] = [
        *(Binding(key, f"panel('{name}')", title, show=False) for name, (key, title) in PANELS.items()),
        Binding("f1", "help", "Help"),
        Binding("ctrl+p", "command_palette", "All"),
        Binding("ctrl+o", "open", "Open"),
        Binding("ctrl+s", "save", "Save"),
        Binding("ctrl+q", "quit", "Quit", priority=True),
    ]

    def __init__(self, path: Path | None = None, *, plain: bool = False) -> None:
        super().__init__()
        self.path, self.plain = path, plain
        self.heartbeat = Heartbeat()
        self.state = log.remembered()
        self._shown = ""
        self._beating: asyncio.Task[None] | None = None

    def compose(self) -> ComposeResult:
        with Horizontal(id="bar"):
            yield Tabs(id="tabs")
            yield Static(id="status")
        yield Static(id="small")
        with ContentSwitcher(initial="design"):
            yield DesignPanel(id="design")
            yield CampaignPanel(id="campaign")
            yield OptimisePanel(id="optimise")
            yield TrackPanel(id="track")
            yield CapturePanel(id="capture")
        yield Footer(compact=True, show_command_palette=False)

    def on_mount(self) -> None:
        self.theme = "ansi-dark" if self.plain else self._theme()
        self.screen.set_class(self.plain, "-plain")
        if self.plain:
            self.animation_level = "none"
        self._beating = asyncio.get_running_loop().create_task(self.heartbeat.beat())
        self.call_after_refresh(settled)
        self.action_panel("design")
        panel = self.query_one(DesignPanel)
        panel.case = Case(str(self.state.get("track", Case.track)), float(self.state.get("speed", Case.speed)))
        panel.view = int(self.state.get("view", 0))
        start = self.path or self.state.get("file")
        if start is not None and (self.path is not None or Path(start).exists()):
            self.open(Path(start))
        else:
            self.call_after_refresh(self.action_open)

    def notify(self, message: str, **more: Any) -> None:
        """Says it as it is: messages hold units in square brackets and names out of files, never markup."""
        super().notify(message, **(more | {"markup": False}))

    def _theme(self) -> str:
        wanted = str(self.state.get("theme", "textual-dark"))
        return wanted if wanted in self.available_themes else "textual-dark"

    def on_resize(self, event: Any) -> None:
        told = f"{event.size.width} x {event.size.height}: the desk wants {SMALLEST[0]} x {SMALLEST[1]}"
        self.query_one("#small", Static).update(told)

    # files

    def open(self, path: Path) -> None:
        """Opens a design in the form, a campaign in its panel; faults of the file are shown where they stand."""
        try:
            kind = kind_of(path)
            if kind == "campaign":
                self.query_one(CampaignPanel).open(path)
                self.action_panel("campaign")
                return
            if kind == "study":
                self.query_one(OptimisePanel).open(path)
                self.action_panel("optimise")
                return
            draft = Draft.load(path)
        except FileProblems as error:
            self.push_screen(Faults(str(path), error), lambda answer: self.open(path) if answer else None)
            return
        except OSError as error:
            self._fault(path, str(error))
            return
        self.query_one(DesignPanel).open(draft)
        self.action_panel("design")
        for problem in draft.design.warnings:
            self.notify(f"{problem.key}: {problem.message}, {problem.remedy}", severity="warning", timeout=8)

    def _fault(self, path: Path, what: str) -> None:
        self.push_screen(Faults(str(path), one_problem(path, what, "")))

    def action_open(self) -> None:
        here = Path.cwd()
        choices = [(str(p), str(p.relative_to(here))) for p in files_below(here)]
        self.push_screen(Pick("Open a design or a campaign", choices, free=True), self._opened)

    def _opened(self, chosen: str | None) -> None:
        if chosen is not None:
            self._unless_unsaved(lambda: self.open(Path(chosen).expanduser()))

    def action_save(self) -> None:
        self.query_one(DesignPanel).save()

    # panels

    def action_panel(self, name: str) -> None:
        self.query_one(ContentSwitcher).current = name
        if name == "track":
            form = self.query_one(DesignPanel)
            rides = form.draft is not None and form.draft.design.kind != "rig"
            vehicle = (form.draft.design, form.case.speed) if form.draft is not None and rides else None
            self.query_one(TrackPanel).begin(form.case.track, vehicle)
        self.query_one(Tabs).show(name)
        panel = self.query_one(f"#{name}")
        first = next((w for w in panel.walk_children() if getattr(w, "can_focus", False) and w.display), None)
        if first is not None:
            self.set_focus(first)  # type: ignore[arg-type]

    @property
    def panel(self) -> DOMNode:
        """The panel that is open."""
        return self.query_one(f"#{self.query_one(ContentSwitcher).current}")

    @on(DesignPanel.Changed)
    def _named(self) -> None:
        draft = self.query_one(DesignPanel).draft
        if draft is not None:
            status = Text(f"{draft.name}{' ●' if draft.dirty else '  '}")
            self.query_one("#status", Static).update(status, layout=draft.name != self._shown)
            self._shown = draft.name
        panel = self.query_one(OptimisePanel)
        if draft is not None and draft.design.kind != "rig":
            panel.begin(draft.design, self.query_one(DesignPanel).case)

    @on(TrackPanel.Used)
    def _used(self, event: TrackPanel.Used) -> None:
        if self.query_one(DesignPanel).set("case.track", event.track):
            self.action_panel("design")

    @on(OptimisePanel.Wished)
    def _wished(self) -> None:
        draft = self.query_one(DesignPanel).draft
        if draft is not None:
            self.query_one(OptimisePanel).take_design(draft.design)
            self.notify(f"the plan varies {draft.name} as it is now", timeout=3)

    @on(Offered)
    def _offered(self, event: Offered) -> None:
        """A design that a study found goes into the form beside the declared one; undo takes it out again."""

        def take() -> None:
            draft = Draft(event.declared)
            draft.push(event.design, event.what)
            self.query_one(DesignPanel).open(draft)
            self.action_panel("design")
            self.notify(event.what, timeout=4)

        self._unless_unsaved(take)

    # help, copying, quitting

    def action_help(self) -> None:
        keys = [
            (self.get_key_display(b.binding), b.binding.description)
            for b in self.screen.active_bindings.values()
            if b.binding.description
        ]
        nodes = [self.panel, *([self.focused] if self.focused is not None else [])]
        texts = [text for node in nodes if (text := getattr(node, "HELP", None))]
        self.push_screen(Help(texts, keys))

    def action_help_quit(self) -> None:
        """ctrl+c copies; ctrl+q quits."""
        for node in (self.focused, self.panel):
            if node is not None and hasattr(node, "action_copy"):
                node.action_copy()
                return
        self.notify("ctrl+c copies, ctrl+q quits")

    async def action_quit(self) -> None:
        busy = [PANELS[str(panel.id)][1] for panel in self._busy()]
        if not busy or isinstance(self.screen, Ask):
            self._unless_unsaved(self._leave)
            return

        def answered(answer: str | None) -> None:
            if answer == "q":
                self._unless_unsaved(self._leave)

        told = (
            f"{' and '.join(busy)} {'is' if len(busy) == 1 else 'are'} at work. What was evaluated or recorded is kept."
        )
        self.push_screen(Ask(told, {"q": "stop it and quit", "c": "stay here"}), answered)

    def _busy(self) -> list[CampaignPanel | OptimisePanel | CapturePanel]:
        """The panels in which a study runs."""
        panels = (self.query_one(CampaignPanel), self.query_one(OptimisePanel), self.query_one(CapturePanel))
        return [panel for panel in panels if panel.study is not None]

    def _unless_unsaved(self, go: Any) -> None:
        """Goes on, after asking where changes would be lost."""
        draft = self.query_one(DesignPanel).draft
        if draft is None or not draft.dirty:
            go()
            return
        if isinstance(self.screen, Ask):
            return

        def answered(answer: str | None) -> None:
            if answer == "s":
                self.action_save()
                if not draft.dirty:
                    go()
            elif answer == "d":
                go()

        answers = {"s": "save", "d": "discard the changes", "c": "stay here"}
        self.push_screen(Ask(f"{draft.name} has changes that are not saved.", answers), answered)

    def _leave(self) -> None:
        panel = self.query_one(DesignPanel)
        state = {"theme": self.theme, "track": panel.case.track, "speed": panel.case.speed, "view": panel.view}
        if panel.draft is not None and panel.draft.file.source is not None:
            state["file"] = str(panel.draft.file.source.resolve())
        for busy in self._busy():
            busy.action_stop()
        if not self.plain:
            log.remember(self.state | state)
        self.exit()

    def get_system_commands(self, screen: Screen[Any]) -> Iterable[SystemCommand]:
        yield from super().get_system_commands(screen)
        for name, (key, title) in PANELS.items():
            yield SystemCommand(title, f"the {title} panel ({key})", lambda name=name: self.action_panel(name))
        yield SystemCommand("Open", "a design or a campaign (ctrl+o)", self.action_open)
        yield SystemCommand("Save", "the design into its file (ctrl+s)", self.action_save)
        yield SystemCommand("Save as", "the design under a name", self.query_one(DesignPanel).save_as)
        beat = f"the longest that the desk itself kept the screen waiting: {1e3 * self.heartbeat.longest:.0f} ms"
        yield SystemCommand("Heartbeat", beat, lambda: self.notify(beat))
        for node in (self.panel, self.focused):
            for binding in getattr(node, "BINDINGS", ()):
                if isinstance(binding, Binding) and binding.description:
                    action, told = binding.action, f"key {self.get_key_display(binding)}"
                    yield SystemCommand(binding.description, told, self._runner(action, node))

    def _runner(self, action: str, node: Any) -> Any:
        async def run() -> None:
            await self.run_action(action, node)

        return run

    def _fatal_error(self) -> None:
        """A fault of our own: the terminal is given back, the trace is in the log, and its name is said."""
        import sys

        error = sys.exc_info()[1]
        if error is not None:
            path = log.keep_trace(error)
            self._exit_renderables.append(
                Text(f"railui desk: {type(error).__name__}: {error}\nthe whole trace: {path}")
            )
        self._close_messages_no_wait()


def run(path: Path | None = None, *, plain: bool = False) -> int:
    """Opens the desk until it is quit; returns the exit code."""
    unhindered()
    desk = Desk(path, plain=plain)
    desk.run()
    return desk.return_code or 0
