"""All image sources; a new one is a module and an entry here."""

from lightpen.cameras.aravis import ARAVIS
from lightpen.cameras.basler import BASLER
from lightpen.cameras.genicam import GENICAM
from lightpen.cameras.replay import RECORDED
from lightpen.cameras.source import Source, SourceNeeds
from lightpen.cameras.webcam import WEBCAM
from lightpen.messages import Message, message

SIMULATED = Source("simulated", message("source.simulated"), SourceNeeds.NOTHING)
SOURCES = (SIMULATED, RECORDED, GENICAM, ARAVIS, BASLER, WEBCAM)


def source_named(key: str) -> Source | None:
    """Return a source by its key; None if it is unknown."""
    return next((source for source in SOURCES if source.key == key), None)


def absent_sources() -> dict[str, Message]:
    """Return the missing installations by the keys of the sources; slow."""
    reasons = ((source.key, source.why_absent()) for source in SOURCES)
    return {key: why_absent for key, why_absent in reasons if why_absent is not None}
