"""The command line: `synctrl run cell.toml`, and what else there is without writing Python."""

from __future__ import annotations

__all__ = ["main"]


def main() -> None:
    """Do what the words of the command line say, and end the process with a code, see `codes.py`."""
    from .app import app
    from .codes import INTERRUPTED

    try:
        app(prog_name="synctrl")
    except KeyboardInterrupt:  # before a command could answer for itself
        raise SystemExit(INTERRUPTED) from None
