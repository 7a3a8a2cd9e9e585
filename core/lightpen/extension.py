"""What an extension adds to the program."""

from argparse import ArgumentParser
from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Subcommand:
    """A command of the command line."""

    name: str
    purpose: str  # a few words for the list of commands
    # Adds the options and ``run``; called, and what it needs imported, only when given.
    add_options: Callable[[ArgumentParser], None]


@dataclass(frozen=True)
class Extension:
    """What an extension adds to the program, also without a window."""

    key: str
    commands: tuple[Subcommand, ...] = ()
