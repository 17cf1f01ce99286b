"""The programs ``deltille`` and ``deltag``: entry points that hand over to the compiled part."""

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
    _run(name, [name, *sys.argv[1:]])
