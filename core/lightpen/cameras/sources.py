"""All sources of images there are: another one is a module, and a line here."""

from lightpen.cameras.aravis import ARAVIS
from lightpen.cameras.basler import BASLER
from lightpen.cameras.genicam import GENICAM
from lightpen.cameras.replay import RECORDED
from lightpen.cameras.source import Needs, Source
from lightpen.cameras.webcam import WEBCAM
from lightpen.sentences import Sentence, sentence

SIMULATED = Source(
    "simulated", sentence("source.simulated", "Simulated pen"), Needs.NOTHING
)
SOURCES = (
    SIMULATED,
    RECORDED,
    GENICAM,
    ARAVIS,
    BASLER,
    WEBCAM,
)


def source_named(key: str) -> Source | None:
    """Return a source by its key; None for one of a later version."""
    return next((source for source in SOURCES if source.key == key), None)


def absent_sources() -> dict[str, Sentence]:
    """Return what has to be installed first, by the keys of the sources; slow."""
    told = ((source.key, source.why_absent()) for source in SOURCES)
    return {key: why_absent for key, why_absent in told if why_absent is not None}
