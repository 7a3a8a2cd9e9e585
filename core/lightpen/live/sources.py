"""The cameras of a chosen source, and what simulates them."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from math import inf
from pathlib import Path
from typing import Protocol, runtime_checkable

from lightpen.cameras.pairing import Clock, MachineClock
from lightpen.cameras.protocol import ImageCamera
from lightpen.cameras.source import FoundDevice, Source, SourcePlace
from lightpen.cameras.sources import SIMULATED, SOURCES, found_cameras
from lightpen.formats.opened_files import OpenedFiles
from lightpen.local_time import local_now
from lightpen.model.pen import Pen
from lightpen.swing.capture.state import SwingState
from lightpen.swing.preparation import SourceChoice


class Operator(Protocol):
    """A simulated operator with a pen; any thread may command."""

    @property
    def is_free(self) -> bool:
        """Whether the pen is away and no activity is requested."""

    def seat(self) -> None:
        """Seat the tip in the cone and hold the pen still."""

    def lift(self) -> None:
        """Lift the tip and stay above the cone."""

    def move_away(self) -> None:
        """Move the pen out of the image."""

    def swing(self) -> None:
        """Seat the pen and swing it until another request."""

    def hold(self) -> None:
        """Hold the pen still."""

    def slip(self, distance: float, seconds: float) -> None:
        """Let the tip slip out of the cone by a distance, mm, for some seconds."""

    def cover(self, seconds: float = inf, leds: Collection[int] | None = None) -> None:
        """Cover LEDs, by their numbers from 1 or all, by a hand for some seconds."""

    def uncover(self) -> None:
        """Uncover all LEDs."""


class Follower(Protocol):
    """Moves a simulated operator by the states of a swing."""

    def follow(self, state: SwingState) -> None:
        """React to a state of the swing."""


@runtime_checkable
class OperatedCamera(Protocol):
    """What a simulated camera has beside a real one."""

    is_seen: bool  # displayed; else fewer images are made

    @property
    def operator(self) -> Operator:
        """The operator in view."""

    def follower(self) -> Follower:
        """Return what leads the operator through a swing."""


class Simulator(Protocol):
    """Simulates a pen and its cameras: from an extension."""

    @property
    def pen(self) -> Pen:
        """The true pen."""

    @property
    def serial(self) -> str:
        """Serial number of the first camera."""

    def write_files(self, folder: Path) -> OpenedFiles:
        """Write the files that go with the cameras, and return them."""

    def cameras(self, n_cameras: int, clock: Clock) -> Sequence[ImageCamera]:
        """Return one or two cameras, not yet opened, that see the same pen."""


@dataclass(frozen=True, eq=False)
class SourceEnvironment:
    """Environment of sources: simulator and clocks."""

    simulator: Simulator | None = None
    clock: Clock = field(default_factory=MachineClock)
    now: Callable[[], datetime] = local_now  # returns date and time with the time zone
    found_cameras: Callable[[], tuple[tuple[Source, FoundDevice], ...]] = found_cameras

    @property
    def sources(self) -> tuple[Source, ...]:
        """The sources to choose from."""
        return tuple(s for s in SOURCES if s is not SIMULATED or self.simulator)

    def has(self, choice: SourceChoice) -> bool:
        """Return whether a source is there, and completely chosen."""
        return choice.source in self.sources and not choice.lacks_place


def cameras_of(
    choices: Sequence[SourceChoice], around: SourceEnvironment
) -> tuple[ImageCamera, ...]:
    """Return the cameras of one or two sources that are there, not yet opened."""
    clock, simulator = around.clock, around.simulator
    n_simulated = sum(choice.source.camera is None for choice in choices)
    simulated = iter(simulator.cameras(n_simulated, clock) if simulator else ())
    return tuple(
        next(simulated)
        if choice.source.camera is None
        else choice.source.camera(SourcePlace(choice.place, choice.producer), clock)
        for choice in choices
    )
