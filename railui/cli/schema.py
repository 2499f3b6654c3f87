"""railui schema: JSON Schema of the YAML files, for editors."""

from __future__ import annotations

import click

from railui.cli.invocation import Invocation, common_options


@click.command("schema")
@click.argument("kind", type=click.Choice(["design", "campaign", "study", "plan", "element", "line", "map", "fleet"]))
@common_options
def command(kind: str, call: Invocation) -> None:
    """Print the JSON Schema of a kind of file, with which an editor validates and completes it.

    \b
    railui schema design > design.schema.json
    # yaml-language-server: $schema=design.schema.json    as the first line of a design
    """
    import json

    from railui.api.files import schema

    document = schema(kind)
    if call.json is None:
        call.show(json.dumps(document, indent=1, ensure_ascii=False))
    call.write_json(document)
