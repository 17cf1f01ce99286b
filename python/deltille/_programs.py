"""Entry points of the programs ``deltille`` and ``deltag``, which run in the compiled module."""

import signal
import sys

# Until the program installs its own handlers, Ctrl-C ends the process immediately, because no Python code runs that could
# raise KeyboardInterrupt.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from ._core import _run  # noqa: E402

__all__ = ["deltag", "deltille"]


def deltille() -> None:
    """Runs ``deltille`` with the arguments of the command line; does not return."""
    _leave("deltille")


def deltag() -> None:
    """Runs ``deltag`` with the arguments of the command line; does not return."""
    _leave("deltag")


def _leave(name: str) -> None:
    _run(name, [name, *sys.argv[1:]])
