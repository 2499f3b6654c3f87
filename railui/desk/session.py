"""Session of the desk: what the autosave stores of its panels, and what an ended session offers."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import TYPE_CHECKING, Any, Final

from railui.desk.panels.campaign import CampaignPanel
from railui.desk.panels.optimise import OptimisePanel
from railui.desk.panels.shelf_page import ShelfPage
from railui.desk.presenters.loop_plots import FinishedLoop
from railui.desk.presenters.search_history import restore_search, search_content
from railui.desk.services.autosave import VERDICT_PARTS, Autosave, EndedSession, ended_sessions, set_aside
from railui.desk.services.verdict_file import StoredVerdict, read_verdict, verdict_bytes
from railui.desk.state.session_parts import (
    form_content,
    plan_content,
    restore_form,
    restore_plan,
    restore_shelf,
    shelf_content,
)
from railui.desk.state.shelf import Shelf
from railui.desk.widgets.dialogs import ChoiceDialog, QuestionDialog

if TYPE_CHECKING:
    from railui.desk.app import Desk

ANSWERS: Final = {"r": "restore it", "l": "later: it stays stored and is offered again", "d": "delete it"}
UNREADABLE: Final = (ValueError, KeyError, TypeError, AttributeError, OSError)  # of parts that another version wrote


class DeskSession:
    """Autosave of the panels of a desk."""

    def __init__(self, desk: Desk) -> None:
        self.desk = desk
        self.autosave = Autosave()
        self._stored: dict[str, FinishedLoop] = {}  # by part

    # storing

    def store_form(self) -> None:
        """Store the design in the form while it differs from its file."""
        draft = self.desk.design_panel.draft
        if draft is not None and draft.is_modified:
            self.autosave.put("form.json", partial(form_content, draft))
        else:
            self.drop_form()

    def drop_form(self) -> None:
        """Forget the design in the form, because it was saved or discarded."""
        self.autosave.drop("form.json")

    def store(self, part: str) -> None:
        """Store a part of a panel: plan, search, verdict or shelf."""
        {
            "plan": self._store_plan,
            "search": self._store_search,
            "verdict": self._store_verdict,
            "shelf": self._store_shelf,
        }[part]()

    def _store_shelf(self) -> None:
        shelf = self.desk.query_one(ShelfPage).shelf
        if shelf.items:
            stored = Shelf(list(shelf.items))
            self.autosave.put("shelf.json", lambda: shelf_content(stored))
        else:
            self.autosave.drop("shelf.json")

    def _store_plan(self) -> None:
        panel = self.desk.query_one(OptimisePanel)
        plan = panel.plan
        if plan is not None and panel.is_edited:
            self.autosave.put("plan.json", partial(plan_content, plan))

    def _store_search(self) -> None:
        history = self.desk.query_one(OptimisePanel).history
        if history is not None:
            self.autosave.put("search.json", lambda: {"plan": plan_content(history.plan)} | search_content(history))

    def _store_verdict(self) -> None:
        """Store the verdicts that are not stored yet, each in a part of its own; a ninth replaces the oldest."""
        for stored in self.desk.query_one(CampaignPanel).stored_verdicts():
            part = self._part_of(stored)
            if self._stored.get(part) is not stored.finished:
                self._stored[part] = stored.finished
                self.autosave.put(f"{part}.pickle", partial(verdict_bytes, stored))
                self.autosave.put(f"{part}.json", partial(_verdict_content, stored))

    def _part_of(self, stored: StoredVerdict) -> str:
        """Return the part of a verdict: that of its campaign, a free one, or that of the oldest verdict."""
        campaign = stored.finished.result.dataset.campaign
        for part, finished in self._stored.items():
            if finished.result.dataset.campaign.source == campaign.source:
                return part
        free = next((part for part in VERDICT_PARTS if part not in self._stored), None)
        if free is None:
            free = next(iter(self._stored))
            del self._stored[free]
        return free

    # restoring

    def offer(self, on_declined: Callable[[], object] | None = None) -> bool:
        """Offer the newest ended session; return False if there is none."""
        sessions = ended_sessions()
        if not sessions:
            return False
        newest = sessions[0]
        lines = [f"The session of {newest.time:%d %b %Y, %H:%M} ended with", *_descriptions(newest)]
        if len(sessions) > 1:
            lines.append(f"({len(sessions) - 1} older: ctrl+p, Restore session)")

        def on_answer(answer: str | None) -> None:
            if answer == "r":
                self.restore(newest)
                return
            if answer == "d":
                newest.delete()
            if on_declined is not None:
                on_declined()

        self.desk.push_screen(QuestionDialog("\n".join(lines), ANSWERS), on_answer)
        return True

    def restore(self, session: EndedSession) -> None:
        """Show the parts of an ended session in their panels and continue to store them."""
        restorers: dict[str, Callable[[dict[str, Any]], str]] = {
            **{part: partial(self._restore_verdict, session, part) for part in VERDICT_PARTS},
            "plan": self._restore_plan,
            "search": self._restore_search,
            "form": self._restore_form,
            "shelf": self._restore_shelf,
        }
        panels = []
        for part, restore in restorers.items():
            content = session.read(part)
            if content is None:
                continue
            try:
                panels.append(restore(content))
            except UNREADABLE as error:
                kept = set_aside(session, part)
                text = f"the {part} of the session cannot be restored, it is kept in {kept}: {error}"
                self.desk.notify(text, severity="error", timeout=12)
        self.autosave.adopt(session)
        if panels:
            self.desk.action_panel(panels[-1])

    def _restore_form(self, content: dict[str, Any]) -> str:
        self.desk.design_panel.open(restore_form(content))
        return "design"

    def _restore_shelf(self, content: dict[str, Any]) -> str:
        self.desk.query_one(ShelfPage).restore(restore_shelf(content))
        return "design"

    def _restore_plan(self, content: dict[str, Any]) -> str:
        self.desk.query_one(OptimisePanel).restore(restore_plan(content), None)
        return "optimise"

    def _restore_search(self, content: dict[str, Any]) -> str:
        panel = self.desk.query_one(OptimisePanel)
        plan = restore_plan(content["plan"])
        history = restore_search(plan, content)
        panel.restore(panel.plan if panel.is_edited and panel.plan is not None else plan, history)
        return "optimise"

    def _restore_verdict(self, session: EndedSession, part: str, _: dict[str, Any]) -> str:
        stored = read_verdict((session.directory / f"{part}.pickle").read_bytes())
        self._stored[part] = stored.finished
        self.desk.query_one(CampaignPanel).restore(stored)
        return "campaign"

    def choose(self) -> None:
        """Choose an ended session to restore."""
        sessions = ended_sessions()
        choices = [(str(i), f"{s.time:%Y-%m-%d %H:%M} {' '.join(_descriptions(s))}") for i, s in enumerate(sessions)]
        if not choices:
            self.desk.notify("no session that has ended left work to restore")
            return

        def on_answer(key: str | None) -> None:
            if key is not None:
                self.desk.ending.after_saving(lambda: self.restore(sessions[int(key)]))

        self.desk.push_screen(ChoiceDialog("Restore a session", choices), on_answer)

    # the end

    def close(self) -> None:
        """Write the rest, and let go of the session."""
        self.autosave.close()


def _verdict_content(stored: StoredVerdict) -> dict[str, Any]:
    campaign = stored.finished.result.dataset.campaign
    sentence = str(stored.finished.report["sentence"])
    return {"campaign": str(campaign.source.resolve()), "name": campaign.name, "sentence": sentence}


def _descriptions(session: EndedSession) -> list[str]:
    """Describe the parts of a session, a line each."""
    lines = []
    if (form := session.read("form")) is not None:
        lines.append(f"- the design {form.get('name')}, not saved")
    if (shelf := session.read("shelf")) is not None:
        count = len(shelf.get("items", ()))
        lines.append(f"- a shelf of {count} design{'s' if count != 1 else ''}")
    for part in VERDICT_PARTS:
        if (verdict := session.read(part)) is not None:
            lines.append(f"- the verdict of {verdict.get('name')}: {verdict.get('sentence')}")
    if (search := session.read("search")) is not None:
        state = "finished" if search.get("result") else "not finished"
        lines.append(f"- a search of {len(search.get('generations', ()))} generations, {state}")
    elif session.read("plan") is not None:
        lines.append("- the plan of a search")
    return lines
