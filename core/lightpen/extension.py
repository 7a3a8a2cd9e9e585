"""What an extension adds to the program."""

from argparse import ArgumentParser, _SubParsersAction
from collections.abc import Callable
from dataclasses import dataclass
from pkgutil import resolve_name
from typing import TYPE_CHECKING, TypeAlias

if TYPE_CHECKING:
    from lightpen.archive.logbook import Replicate
    from lightpen.cameras.source import Source
    from lightpen.live.sources import Simulator

SubParsers: TypeAlias = "_SubParsersAction[ArgumentParser]"


@dataclass(frozen=True)
class Subcommand:
    """A command of the command line."""

    name: str
    purpose: str  # a few words for the list of commands
    function: str  # "module:name" of what adds the options and ``run``

    def add_options(self, parser: ArgumentParser) -> None:
        """Add the options and ``run``; what they need is imported only now."""
        resolve_name(self.function)(parser)


@dataclass(frozen=True)
class Extension:
    """What an extension adds to the program, also without a window."""

    key: str
    commands: tuple[Subcommand, ...] = ()
    sources: "tuple[Source, ...]" = ()  # of images
    # Adds actions to ``lightpen archive``, and options to its action ``check``.
    add_archive_actions: Callable[[SubParsers, ArgumentParser], None] | None = None
    replicate: "Replicate | None" = None  # delivers entries to a server
    # Imports what simulates pen and cameras: for trial, demo and self-test.
    load_simulator: "Callable[[], Simulator] | None" = None
