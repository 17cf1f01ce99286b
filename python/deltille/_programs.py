"""The programs ``deltille`` and ``deltag``: entry points that hand over to the compiled part."""

import os
import sys

from ._core import _run

__all__ = ["deltag", "deltille"]


def deltille() -> None:
    """Run ``deltille`` with the arguments of the command line; does not return."""
    _leave("deltille")


def deltag() -> None:
    """Run ``deltag`` with the arguments of the command line; does not return."""
    _leave("deltag")


def _leave(name: str) -> None:
    code = _run(name, [name, *sys.argv[1:]])
    # Nothing of Python is left to be tidied up, and what was printed is flushed.
    os._exit(code)
