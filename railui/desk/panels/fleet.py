"""Fleet panel: vehicles by quantities, alarms with their evidence, the history of a quantity."""

from __future__ import annotations

from pathlib import Path
from typing import Any, ClassVar, Final

from rich.text import Text
from textual import on
from textual.app import ComposeResult
from textual.binding import Binding
from textual.containers import Grid, VerticalScroll
from textual.widgets import Static

from railui.desk.messages import FileOffered, JobDone, JobFailed, ProgressMessage
from railui.desk.panels.common import STOP, VIEW, JobPanel, Pane, set_titles
from railui.desk.panels.search_layout import Layout, Placed, apply_layout
from railui.desk.presenters.fleet_history import NO_HISTORY, history_plot
from railui.desk.presenters.fleet_tables import FIRST_QUANTITY, alarm_columns, quantity_heads, vehicle_columns
from railui.desk.presenters.fleet_text import evidence_text, summary_text
from railui.desk.services.fleet_computation import FleetResults, load_results
from railui.desk.services.fleet_job import update
from railui.desk.services.jobs import BackgroundJob
from railui.desk.widgets.plot import Plot
from railui.desk.widgets.table import Table
from railui.fleet.block_means import BlockMeans
from railui.fleet.fleet_file import load_fleet

VEHICLES, ALARMS, HISTORY, EVIDENCE = "fleet-vehicles", "fleet-alarms", "fleet-history", "fleet-evidence"
PARTS: Final = (VEHICLES, ALARMS, HISTORY, EVIDENCE)
WIDE: Final = (120, 24)  # cells from which all parts are shown
NO_FLEET: Final = "ctrl+o opens a fleet.yaml"


class FleetPanel(JobPanel):
    """State of a fleet as it was found last; `s` computes what is new."""

    BINDINGS: ClassVar[list[Any]] = [
        Binding("s", "start(0)", "Update", tooltip="compute new runs and test all vehicles"),
        Binding("S", "start(1)", "With loop", tooltip="the same, with a full loop on the latest alarm without one"),
        STOP,
        VIEW,
        Binding("t", "type", "Type", tooltip="the next vehicle type"),
        Binding("l", "loop", "Loop", tooltip="open the campaign of the loop of the alarm under the cursor"),
    ]
    HELP = """
## Fleet
A `fleet.yaml` opened with `ctrl+o` shows what `railui fleet run` found last; `s` computes the runs that are new and
tests all vehicles, `k` stops, and what was computed stays stored. `S` adds a full loop on the latest alarm.

**Vehicles**: the largest sum of every sequential test so far over its threshold, negative for a fall; shaded from 0.5,
0.75 and 1, an alarm. Up and down choose a vehicle, left and right a quantity, whose **history** is shown: means of the
blocks, what was expected from the blocks before, and lines at the alarms of the vehicle. `t` shows the next vehicle
type. **Alarms**: the row under the cursor shows its evidence and its history; `l` opens the campaign of its loop.
"""

    def __init__(self, *, id: str | None = None) -> None:
        super().__init__(id=id)
        self.path: Path | None = None
        self.results: FleetResults | None = None
        self.type_number = 0
        self.activity = NO_FLEET

    def compose(self) -> ComposeResult:
        yield Pane("Fleet", id="fleet-summary")
        with Grid(id="fleet-parts"):
            yield Table("Vehicles", NO_FLEET, id=VEHICLES)
            yield Table("Alarms", "no alarm", id=ALARMS)
            yield Plot(NO_HISTORY, "History", id=HISTORY)
            with VerticalScroll(id=EVIDENCE, classes="pane"):
                yield Static(id="fleet-evidence-text")

    def on_mount(self) -> None:
        set_titles(self.query_one(f"#{EVIDENCE}"), "Evidence")
        self.show_status()

    # the fleet

    def open(self, path: Path) -> None:
        """Open a fleet with the results of its last update; FileProblems for a faulty file."""
        fleet = load_fleet(path)
        if self.job is not None:
            self.notify("an update is running: k stops it", severity="warning")
            return
        self.path, self.type_number = path, 0
        self.results = load_results(path)
        self.activity = "s computes new runs" if self.results else "no results yet: s computes them"
        set_titles(self.query_one("#fleet-summary"), f"Fleet {fleet.name}")
        self.show_results()

    def can_start(self) -> bool:
        return self.path is not None

    def action_start(self, loops: int) -> None:
        if self.path is None or self.job is not None:
            return
        path = self.path
        self.job = BackgroundJob(self, "fleet", lambda job: update(job, path, loops))
        self.activity = "reading the fleet"
        self.show_status()

    @on(ProgressMessage)
    def _on_progress(self, message: ProgressMessage) -> None:
        message.stop()
        self.activity = message.text
        self.show_status()

    @on(JobDone)
    def _on_done(self, message: JobDone) -> None:
        message.stop()
        self.job, self.results = None, message.result
        self.activity = "up to date"
        self.show_results()

    @on(JobFailed)
    def _on_failed(self, message: JobFailed) -> None:
        message.stop()
        self.job = None
        self.activity = "stopped: s goes on" if message.is_stopped else message.text
        if not message.is_stopped:
            self.notify(message.text, severity="error", timeout=10)
        self.show_status()

    # what is shown

    @property
    def means(self) -> BlockMeans | None:
        """Block means of the vehicle type that is shown."""
        if self.results is None or not self.results.means:
            return None
        return self.results.means[self.type_number % len(self.results.means)]

    @property
    def alarms(self) -> list[dict[str, Any]]:
        """Alarms of the vehicle type that is shown."""
        if self.results is None or self.means is None:
            return []
        return [row for row in self.results.document["alarms"] if row["type"] == self.means.type]

    @property
    def alarm(self) -> dict[str, Any] | None:
        """Alarm under the cursor."""
        rows, index = self.alarms, self.query_one(f"#{ALARMS}", Table).index
        return rows[index] if index < len(rows) else None

    def show_results(self) -> None:
        """Show other results, or those of another vehicle type."""
        vehicles, alarms = (self.query_one(f"#{name}", Table) for name in (VEHICLES, ALARMS))
        means = self.means
        vehicles.placeholder = NO_FLEET if self.path is None else "no vehicle has been tested yet"
        vehicles.show(vehicle_columns(self.results.document, means) if self.results else [])
        alarms.show(alarm_columns(self.alarms))
        set_titles(vehicles, f"Vehicles: {means.type}" if means else "Vehicles", "sum of the test over its threshold")
        self.arrange_parts()
        if self.alarms:
            alarms.select(len(self.alarms) - 1)
        else:
            self._show_history()
        self._show_evidence()
        self.show_status()

    def show_status(self) -> None:
        """Show the state of the fleet and of the computation."""
        document = self.results.document if self.results else None
        activity = f"{self.activity} (stopping)" if self.job is not None and self.job.is_stopping else self.activity
        self.query_one("#fleet-summary", Static).update(summary_text(document, activity))
        self.update_commands()

    @on(Table.RowSelected, f"#{VEHICLES}")
    @on(Table.ColumnSelected, f"#{VEHICLES}")
    def _on_vehicle_selected(self) -> None:
        self._show_history()

    @on(Table.RowSelected, f"#{ALARMS}")
    def _on_alarm_selected(self) -> None:
        """Show the evidence for an alarm, and its vehicle and quantity in the table of vehicles."""
        alarm, means = self.alarm, self.means
        if alarm is None or means is None:
            return
        vehicles = self.query_one(f"#{VEHICLES}", Table)
        name = alarm["quantity"] if alarm["quantity"] in means.quantities else alarm["raised_by"]
        vehicles.place(means.vehicles.index(alarm["vehicle"]))
        vehicles.show_column(FIRST_QUANTITY + means.quantities.index(name))
        self._show_history()
        self._show_evidence()
        self.update_commands()

    def _show_history(self) -> None:
        plot, table, means = self.query_one(Plot), self.query_one(f"#{VEHICLES}", Table), self.means
        if means is None or not table.row_count:
            plot.show(NO_HISTORY)
            return
        vehicle, quantity = table.index, max(0, table.column - FIRST_QUANTITY)
        plot.show(history_plot(means, vehicle, quantity, self.alarms))
        set_titles(plot, f"{means.vehicles[vehicle]}: {' '.join(quantity_heads(means.quantities[quantity]))}")

    def _show_evidence(self) -> None:
        alarm = self.alarm
        text = evidence_text(alarm) if alarm is not None else Text("no alarm", "dim")
        self.query_one("#fleet-evidence-text", Static).update(text)

    # commands

    def command_state(self) -> object:
        return super().command_state(), self.alarm is not None and self.alarm["loop"], self._type_count

    @property
    def _type_count(self) -> int:
        return len(self.results.means) if self.results else 0

    def check_action(self, action: str, parameters: tuple[object, ...]) -> bool | None:
        if action == "loop":
            return bool(self.is_mounted and self.alarm is not None and self.alarm["loop"])
        if action == "type":
            return self._type_count > 1
        return super().check_action(action, parameters)

    def action_type(self) -> None:
        """Show the next vehicle type."""
        self.type_number += 1
        self.show_results()

    def action_loop(self) -> None:
        """Open the campaign of the loop of the alarm under the cursor."""
        if self.results is not None and self.alarm is not None and self.alarm["loop"]:
            report = self.results.directory / self.alarm["loop"]
            self.post_message(FileOffered(report.parent.parent / "campaign.yaml"))

    # layout

    def arrange_parts(self) -> None:
        """Show all parts, or two of them where there is less room."""
        grid = self.query_one("#fleet-parts", Grid)
        width, height = grid.size.width, grid.size.height
        if width >= WIDE[0] and height >= WIDE[1]:
            parts = (Placed(VEHICLES), Placed(HISTORY), Placed(ALARMS), Placed(EVIDENCE))
            layout = Layout("3fr 2fr", "3fr 2fr", parts)
        else:
            names = ((VEHICLES, HISTORY), (ALARMS, EVIDENCE), (ALARMS, HISTORY))[self.view % 3]
            layout = Layout("1fr", "1fr 1fr", tuple(Placed(name) for name in names))
        apply_layout(grid, {name: self.query_one(f"#{name}") for name in PARTS}, layout)
