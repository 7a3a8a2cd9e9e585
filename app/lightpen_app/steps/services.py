"""What the application gives to its pages."""

from dataclasses import dataclass

from lightpen_app.look.sounds import Sounds
from lightpen_app.work.workbench import Workbench


@dataclass(frozen=True, eq=False)
class Services:
    """What a page may need from the application.

    Attributes
    ----------
    workbench : Workbench
    sounds : Sounds
    """

    workbench: Workbench
    sounds: Sounds
