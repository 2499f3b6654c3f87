"""railui schema: JSON Schema of our YAML files, for editors."""

from __future__ import annotations

import click

from railui.cli.common import Invocation, options


@click.command("schema")
@click.argument("kind", type=click.Choice(["design", "campaign", "study"]))
@options
def command(kind: str, call: Invocation) -> None:
    """Print the JSON Schema of a design, a campaign or a study; an editor checks and completes by it.

    \b
    railui schema design > design.schema.json
    # yaml-language-server: $schema=design.schema.json    as the first line of a design
    """
    import json

    from railui.documents.schema import schema

    made = schema(kind)
    if call.json is None:
        call.show(json.dumps(made, indent=1, ensure_ascii=False))
    call.emit(made)
