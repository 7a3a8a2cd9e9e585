"""All image sources; extensions add theirs."""

from contextlib import suppress

from lightpen.cameras.protocol import CameraFailure
from lightpen.cameras.replay import RECORDED
from lightpen.cameras.source import FoundDevice, Source, SourceNeeds
from lightpen.messages import Message, message

SIMULATED = Source("simulated", message("source.simulated"), SourceNeeds.NOTHING)
# Before a source is chosen.
UNCHOSEN = Source("", message("source.unchosen"), SourceNeeds.CHOICE)
SOURCES = [SIMULATED, RECORDED]  # extended where extensions are put together


def source_named(key: str) -> Source | None:
    """Return a source by its key; None if it is unknown."""
    return next((source for source in SOURCES if source.key == key), None)


def absent_sources() -> dict[str, Message]:
    """Return the missing installations by the keys of the sources; slow."""
    reasons = ((source.key, source.why_absent()) for source in SOURCES)
    return {key: why_absent for key, why_absent in reasons if why_absent is not None}


def found_cameras() -> tuple[tuple[Source, FoundDevice], ...]:
    """Return the cameras of all sources; takes seconds, while no camera streams.

    A source that is not installed, or cannot search, finds none.
    """
    found: list[tuple[Source, FoundDevice]] = []
    for source in SOURCES:
        if source.why_absent() is None:
            with suppress(CameraFailure):
                found.extend((source, device) for device in source.find(""))
    return tuple(found)
