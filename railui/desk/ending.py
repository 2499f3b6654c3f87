"""End of the desk: questions about unsaved changes and running computations, state of the next session, signals."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any, Final

from railui.desk.panels.common import PANELS, JobPanel
from railui.desk.panels.overview_page import OverviewPage
from railui.desk.presenters.design_plots import VIEWS
from railui.desk.services.autosave import has_content
from railui.desk.services.files import save_state
from railui.desk.services.signals import force_exit_later
from railui.desk.widgets.dialogs import QuestionDialog

if TYPE_CHECKING:
    from railui.desk.app import Desk

STORED_NOTE: Final = "The plan, the search and the verdict of this session are offered at the next start."
SIGNAL_EXIT_CODE: Final = 128  # plus the number of the signal, as in a shell


class Ending:
    """End of a desk."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk

    def on_signal(self, number: int) -> None:
        """End on SIGTERM or a closed terminal: store the session, restore the terminal."""
        force_exit_later(SIGNAL_EXIT_CODE + number)
        self._stop_jobs()
        self.desk.session.autosave.flush()
        self.desk.exit(return_code=SIGNAL_EXIT_CODE + number)

    def ask_and_quit(self) -> None:
        """Quit; ask first if a computation is running or the design has unsaved changes."""
        titles = [PANELS[str(panel.id)][1] for panel in self._busy_panels()]
        if not titles or isinstance(self.desk.screen, QuestionDialog):
            self.after_saving(self._quit)
            return

        def on_answer(answer: str | None) -> None:
            if answer == "q":
                self.after_saving(self._quit)

        subject = f"{' and '.join(titles)} {'is' if len(titles) == 1 else 'are'}"
        question = f"{subject} running. Stored evaluations and recordings remain."
        self.desk.push_screen(QuestionDialog(question, {"q": "stop and quit", "c": "cancel"}), on_answer)

    def _busy_panels(self) -> list[JobPanel]:
        return [panel for panel in self.desk.query(JobPanel) if panel.job is not None]

    def _stop_jobs(self) -> None:
        for panel in self._busy_panels():
            panel.action_stop()
        self.desk.design_panel.page.leave()

    def after_saving(self, action: Callable[[], object]) -> None:
        """Run an action that ends the work on the design; if it has unsaved changes, ask first."""
        draft = self.desk.design_panel.draft
        if draft is None or not draft.is_modified:
            action()
            return
        if isinstance(self.desk.screen, QuestionDialog):
            return

        def on_answer(answer: str | None) -> None:
            if answer == "s":
                self.desk.design_panel.save(then=action)
            elif answer == "d":
                action()

        answers = {"s": "save", "d": "discard the changes", "c": "cancel"}
        self.desk.push_screen(QuestionDialog(f"{draft.name} has unsaved changes.", answers), on_answer)

    def _quit(self) -> None:
        panel, session = self.desk.design_panel, self.desk.session
        state: dict[str, Any] = {
            "theme": self.desk.theme,
            "track": panel.conditions.track,
            "speed": panel.conditions.speed,
            "speed_unit": panel.speed_unit,
            "view": panel.query_one(OverviewPage).view % len(VIEWS),
        }
        if panel.draft is not None and panel.draft.path is not None:
            state["file"] = str(panel.draft.path.resolve())
        self._stop_jobs()
        if not self.desk.is_plain:
            save_state(self.desk.state | state)
        session.drop_form()  # saved or discarded
        session.autosave.flush()
        is_stored = has_content(session.autosave.directory)
        self.desk.exit(message=STORED_NOTE if is_stored else None)
