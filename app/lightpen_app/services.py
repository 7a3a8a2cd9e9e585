"""What the application gives to its pages."""

from dataclasses import dataclass

from lightpen_app.bench import Bench
from lightpen_app.sounds import Sounds


@dataclass(frozen=True, eq=False)
class Services:
    """What a page may need from the application.

    Attributes
    ----------
    bench : Bench
    sounds : Sounds
    """

    bench: Bench
    sounds: Sounds
