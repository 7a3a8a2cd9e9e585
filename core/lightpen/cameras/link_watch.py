"""Watches the link to a camera: lost images, and a rate that is not reached."""

from dataclasses import dataclass, replace
from typing import Self

from lightpen.cameras.protocol import (
    CameraFailure,
    CameraSettings,
    ConfigError,
    FrameIncomplete,
    Stats,
    TriggerMode,
)

WATCHED = 3.0  # s, after which one window ends and the next begins
LOST_SHARE = 0.05  # of the images; the odd one costs nothing
LEAST_LOST = 3
SLOW_SHARE = 0.8  # of the rate that is set


@dataclass(frozen=True)
class LinkWatch:
    """Frame counters of a time window."""

    since: Stats | None = None  # counts at the beginning of the window
    began: float = 0.0  # s
    is_reported: bool = False  # one fault for each set of settings

    def after(
        self, stats: Stats, now: float, settings: CameraSettings
    ) -> tuple[Self, CameraFailure | None]:
        """Return the state after an image, and a fault of the link or None.

        ``now`` is the arrival time of the image, s.
        """
        if self.since is None:
            return replace(self, since=stats, began=now), None
        seconds = now - self.began
        if self.is_reported or seconds < WATCHED:
            return self, None
        fault = _fault(stats.since(self.since), seconds, settings)
        is_reported = fault is not None
        return replace(self, since=stats, began=now, is_reported=is_reported), fault


def _fault(
    came: Stats, seconds: float, settings: CameraSettings
) -> CameraFailure | None:
    n_lost = came.incomplete + came.missed
    n_sent = came.delivered + n_lost
    if n_lost >= max(LEAST_LOST, LOST_SHARE * n_sent):
        return FrameIncomplete(
            "camera.link-loses",
            n_sent=n_sent,
            n_incomplete=came.incomplete,
            n_missed=came.missed,
        )
    rate = settings.frame_rate
    is_free = settings.trigger is not TriggerMode.SOFTWARE
    if rate is not None and is_free and n_sent < SLOW_SHARE * rate * seconds:
        return ConfigError(
            "camera.rate-not-reached", sent=n_sent / seconds, wanted=rate
        )
    return None
