"""The command `synctrl` and its subcommands."""

from __future__ import annotations

from typing import Annotated

import typer

from .advise import advise
from .compare import compare
from .doctor import doctor
from .inspect import inspect
from .new import new
from .reproduce import reproduce
from .run import run
from .show import show
from .sweep import sweep
from .tune import tune

app = typer.Typer(
    help="Adaptive synchronized control of robot cells: run, compare, sweep, tune and look, without Python.",
    epilog="Ends with 0 if done, 1 if something is refused, 2 for a wrong command line, 3 if a run had to "
    "stop, 4 if something was found wanting, 130 after Ctrl-C.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)


def _version(asked: bool) -> None:
    if asked:
        from importlib.metadata import version

        typer.echo(f"synctrl {version('synctrl')}")
        raise typer.Exit


@app.callback()
def synctrl(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="Print the version.")
    ] = False,
) -> None:
    """What all subcommands have in common: nothing but the version."""


for command in (new, advise, run, show, compare, sweep, tune, inspect, reproduce, doctor):
    app.command()(command)
