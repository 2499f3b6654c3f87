"""railui adjust: adjust a model's parameters to a measured campaign."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from railui.cli.common import Invocation, options

if TYPE_CHECKING:
    from railui.study.loop import Found


@click.command("adjust")
@click.argument("campaign", metavar="CAMPAIGN")
@options
def command(campaign: str, call: Invocation) -> None:
    """Adjust the declared vehicle of a measured CAMPAIGN, without looking for effects.

    \b
    railui adjust designs/campaigns/worn_axle_box --json -

    Output-error least squares over all channels of the runs of role adjust; the error stands for the runs of
    role validate.
    """
    from railui.cli.loop import narrator
    from railui.files.campaign import load_campaign
    from railui.report.loop import loop_report
    from railui.study.loop import adjust_only
    from railui.study.measured import read

    loaded = load_campaign(campaign)
    call.warn(loaded.warnings)
    found = adjust_only(read(loaded), seed=call.seed or 0, jobs=call.jobs, report=narrator(call, []))
    data = loop_report(found)
    data = data | {"schema": "railui.adjust/1"}
    for key in ("verdict", "sentence", "ranking", "traces", "detectable", "classes", "outside"):
        data.pop(key)
    show(call, found, data)
    call.emit(data)


def show(call: Invocation, found: Found, data: dict[str, Any]) -> None:
    """Parameters before and after, and the error."""
    from rich.table import Table

    from railui.files.display import display

    table = Table(title="adjusted parameters", title_justify="left")
    for name in ("path", "declared", "adjusted", "standard deviation", ""):
        table.add_column(name)
    for path, p in data["parameters"].items():
        cells = [display(p[k], p["unit"]) for k in ("declared", "value", "sd")]
        table.add_row(path, *cells, p["flag"] or "")
    call.show(table)
    error, floor = data["after"]["nrmse"], data["floor"]["nrmse"]
    declared = data["declared"]["nrmse"]
    told = ["-" if x is None else f"{x:.3f}" for x in (declared, error, floor)]
    call.show(f"error on runs that no fit has seen: declared {told[0]}, adjusted {told[1]}, noise floor {told[2]}")
    call.say(f"{found.before.simulations} simulations")
