"""Page of the commands: help text, options, and an example that a test runs."""

import inspect
import re
from pathlib import Path

import click
from markdown_text import code, plain, table

from railui.cli import COMMANDS, cli

EXAMPLES = Path(__file__).parents[1] / "examples"
EXAMPLE_LINK = re.compile(r"\]\((\w+)\.md\)")
COMMON = ("json_to", "quiet", "verbose", "seed", "jobs", "help")
INTRODUCTION = """# Commands

Results go to stdout, messages to stderr. Numbers are SI or carry a unit (`"144 km/h"`). `path=value` after a design overrides a
number of the vehicle: `vehicle.primary.lateral_stiffness=4e6`. `railui COMMAND --help` prints the text of this page.

| exit code | meaning |
| --- | --- |
| 0 | done |
| 1 | failed |
| 2 | usage error or faulty file: every problem with file, line, column, key and remedy |
| 3 | temporary failure: try again later |
| 4 | done, but a limit is violated |
| 130 | interrupted with ctrl-c; an interrupted search is continued by the same command |

Options of every command that computes:

"""


def page() -> str:
    """Return a section for each command in the order of `railui --help`."""
    context = click.Context(cli, info_name="railui")
    ride = cli.get_command(context, "ride")
    assert ride is not None
    common = table(("option", "meaning"), [_row(p) for p in ride.params if p.name in COMMON])
    parts = [INTRODUCTION, common]
    for name, summary in COMMANDS.items():
        command = cli.get_command(context, name)
        assert command is not None
        parts += [f"\n## railui {name}\n\n{summary}\n\n", _section(f"railui {name}", command), _example(name)]
        for sub in command.commands.values() if isinstance(command, click.Group) else ():
            title = f"railui {name} {sub.name}"
            parts += [f"\n### {title}\n\n", _section(title, sub), _example(f"{name}_{sub.name}")]
    return "".join(parts)


def _section(name: str, command: click.Command) -> str:
    context = click.Context(command, info_name=name, terminal_width=100)
    usage = command.get_usage(context).removeprefix("Usage: ")
    options = [p for p in command.params if isinstance(p, click.Option) and p.name not in COMMON]
    parts = [f"```\n{usage}\n```\n\n", _help(command.help or "")]
    if options:
        parts += ["\n", table(("option", "meaning"), [_row(p) for p in options])]
    return "".join(parts)


def _help(text: str) -> str:
    """Return the paragraphs of a help text; preformatted ones (\\b) as code."""
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
    suffix = f" Default {code(default)}." if default not in (None, 0, "") else ""
    return names + metavar, plain(option.help or "") + suffix


def _example(name: str) -> str:
    """Return the example of a command, links to other examples as such within the page; without a file the build fails."""
    text = EXAMPLE_LINK.sub(lambda m: f"](#railui-{m[1].replace('_', '-')})", (EXAMPLES / f"{name}.md").read_text())
    return f"\n**Example**\n\n{text}"
