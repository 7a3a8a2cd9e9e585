"""What became of the images of a camera since a swing began."""

from dataclasses import dataclass, field
from typing import Self

from lightpen.cameras.protocol import Stats


@dataclass(frozen=True)
class Tally:
    """Counts over a swing, also over several sessions and cameras.

    Attributes
    ----------
    total : Stats
        Since the swing began.
    last : Stats or None
        What the camera had counted by the last image; None before the first.
    """

    total: Stats = field(default_factory=Stats)
    last: Stats | None = None

    def after(self, stats: Stats) -> Self:
        """Return the tally after an image, by when the camera has counted so many."""
        last = self.last
        if last is None:
            return type(self)(self.total, stats)
        if stats.delivered < last.delivered:  # another camera, which began with none
            last = Stats()
        return type(self)(self.total.and_then(stats.since(last)), stats)
