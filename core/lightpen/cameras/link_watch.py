"""Whether cable and network carry what a camera is set to send."""

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
from lightpen.sentences import sentence

WATCHED = 3.0  # s, after which one window ends and the next begins
LOST_SHARE = 0.05  # of the images; the odd one costs nothing
LEAST_LOST = 3
SLOW_SHARE = 0.8  # of the rate that is set


@dataclass(frozen=True)
class LinkWatch:
    """What came over the link since a moment.

    Attributes
    ----------
    since : Stats or None
        Counts at the beginning of the window.
    began : float
        s.
    is_told : bool
        Whether its trouble has been told; once is enough for one set of settings.
    """

    since: Stats | None = None
    began: float = 0.0
    is_told: bool = False

    def after(
        self, stats: Stats, now: float, settings: CameraSettings
    ) -> tuple[Self, CameraFailure | None]:
        """Return the watch after one more image, and what is wrong with the link.

        Parameters
        ----------
        now : float
            When the image came, s.
        settings : CameraSettings
            In force.
        """
        if self.since is None:
            return replace(self, since=stats, began=now), None
        seconds = now - self.began
        if self.is_told or seconds < WATCHED:
            return self, None
        trouble = _trouble(stats.since(self.since), seconds, settings)
        is_told = trouble is not None
        return replace(self, since=stats, began=now, is_told=is_told), trouble


def _trouble(
    came: Stats, seconds: float, settings: CameraSettings
) -> CameraFailure | None:
    n_lost = came.incomplete + came.missed
    n_sent = came.delivered + n_lost
    if n_lost >= max(LEAST_LOST, LOST_SHARE * n_sent):
        return FrameIncomplete(
            sentence(
                "camera.link-loses",
                "The link to the camera loses images: of {n_sent}, {n_incomplete} came "
                "incomplete and {n_missed} not at all. Lower the frame rate, take a "
                "smaller region or larger packets, or check cable and switch.",
                n_sent=n_sent,
                n_incomplete=came.incomplete,
                n_missed=came.missed,
            )
        )
    rate = settings.frame_rate
    is_free = settings.trigger is not TriggerMode.SOFTWARE
    if rate is not None and is_free and n_sent < SLOW_SHARE * rate * seconds:
        return ConfigError(
            sentence(
                "camera.rate-not-reached",
                "The camera sends {sent:.1f} images a second, not the {wanted:.1f} "
                "that are set: its link or its exposure allows no more. Lower the "
                "frame rate, or take a smaller region or a shorter exposure.",
                sent=n_sent / seconds,
                wanted=rate,
            )
        )
    return None
