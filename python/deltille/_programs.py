"""The programs ``deltille`` and ``deltag``: entry points that hand over to the compiled part."""

import signal
import sys

# Until the program has handlers of its own a signal ends it, and does not wait for Python code that never comes.
signal.signal(signal.SIGINT, signal.SIG_DFL)

from ._core import _run  # noqa: E402

__all__ = ["deltag", "deltille"]


def deltille() -> None:
    """Run ``deltille`` with the arguments of the command line; does not return."""
    _leave("deltille")


def deltag() -> None:
    """Run ``deltag`` with the arguments of the command line; does not return."""
    _leave("deltag")


def _leave(name: str) -> None:
    _run(name, [name, *sys.argv[1:]])
