"""The page of the commands: what each says of itself, its options, and an example that a test runs."""

import inspect
from pathlib import Path

import click
from words import code, plain, table

from railui.cli import COMMANDS, cli

EXAMPLES = Path(__file__).parents[1] / "examples"
COMMON = ("json_to", "quiet", "verbose", "seed", "jobs", "help")
INTRODUCTION = """# Commands

stdout is data, stderr is narration. Numbers are SI or carry a unit (`"144 km/h"`). A vehicle's numbers are overridden by their
path behind the design: `vehicle.primary.lateral_stiffness=4e6`. `railui COMMAND --help` tells what stands here.

| exit code | meaning |
| --- | --- |
| 0 | done |
| 1 | failed |
| 2 | wrong use, or a wrong file: every fault with file, line, column, key and remedy |
| 3 | may work later |
| 4 | done, but a limit is violated |
| 130 | interrupted with ctrl-c; what was found is kept, the same command goes on |

Options of every command that computes:

"""


def page() -> str:
    """All commands in the order of `railui --help`."""
    context = click.Context(cli, info_name="railui")
    first = cli.get_command(context, "ride")
    assert first is not None
    shared = table(("option", "meaning"), [_row(p) for p in first.params if p.name in COMMON])
    parts = [INTRODUCTION, shared]
    for name, question in COMMANDS.items():
        command = cli.get_command(context, name)
        assert command is not None
        parts += [f"\n## railui {name}\n\n{question}\n\n", _section(f"railui {name}", command), _example(name)]
        for part in command.commands.values() if isinstance(command, click.Group) else ():
            parts += [f"\n### railui {name} {part.name}\n\n", _section(f"railui {name} {part.name}", part),
                      _example(f"{name}_{part.name}")]  # fmt: skip
    return "".join(parts)


def _section(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name, terminal_width=100)
    usage = command.get_usage(context).removeprefix("Usage: ")
    own = [p for p in command.params if isinstance(p, click.Option) and p.name not in COMMON]
    told = [f"```\n{usage}\n```\n\n", _help(command.help or "")]
    if own:
        told += ["\n", table(("option", "meaning"), [_row(p) for p in own])]
    return "".join(told)


def _help(text: str) -> str:
    """Paragraphs of a help text; those that are to stay as they are typed (\\b) as code."""
    paragraphs = []
    for paragraph in inspect.cleandoc(text).split("\n\n"):
        if paragraph.startswith("\b"):
            paragraphs.append("```\n" + paragraph.removeprefix("\b").strip("\n") + "\n```")
        else:
            paragraphs.append(plain(" ".join(paragraph.split())))
    return "\n\n".join(paragraphs) + "\n"


def _row(option: click.Parameter) -> tuple[str, str]:
    assert isinstance(option, click.Option)
    names = ", ".join(code(name) for name in option.opts)
    metavar = "" if option.is_flag or option.count else f" {code(option.make_metavar(click.Context(cli)))}"
    default = option.default if isinstance(option.default, int | float | str) and not option.is_flag else None
    told = f" Default {code(default)}." if default not in (None, 0, "") else ""
    return names + metavar, plain(option.help or "") + told


def _example(name: str) -> str:
    """The example kept in a file; a command without one fails the build."""
    text = (EXAMPLES / f"{name}.md").read_text()
    return f"\n**Example**\n\n{text}"
