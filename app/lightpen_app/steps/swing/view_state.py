"""View state of the step Swing, as a value for the widgets."""

from collections import deque
from dataclasses import dataclass, replace
from functools import cached_property
from math import ceil

from PySide6.QtCore import QObject

from lightpen.cameras.protocol import Connection
from lightpen.estimation.reports.verdict import Verdict
from lightpen.live.pipeline import LiveImage
from lightpen.model.names import Origin
from lightpen.model.rigid import FIRST_LEAN, UPRIGHT, Posture, posture_of
from lightpen.swing.capture.guidance import Shortfall, turn_range
from lightpen.swing.capture.state import Phase, SwingSetup, SwingState
from lightpen_app.widgets.live_markers import FrameRate
from lightpen_app.widgets.posture_dial import DialValue
from lightpen_app.work.live_view import DisplayedImage
from lightpen_app.work.swing_run import SwingRun

# Of the images to go: from so many on, their number in all is rounded up to this.
STEPS = ((30, 10), (10, 5), (-1, 1))


def n_in_all_about(n_kept: int, n_more: int) -> int:
    """Return the number of images at the end, to the accuracy of the estimate."""
    step = next(step for least, step in STEPS if n_more > least)
    return ceil((n_kept + n_more) / step) * step


ENDED = (Phase.SOLVING, Phase.VERDICT)


@dataclass(frozen=True, eq=False)
class SwingViewState:
    """Input of the displayed values."""

    setup: SwingSetup
    state: SwingState
    short: Shortfall
    connection: Connection = Connection.STREAMING  # of the camera
    seen: str = ""  # content of the last image in a few words
    # Whether the last images show enough spots, but not those of the pen.
    has_unfit_spots: bool = False
    # Whether the swing was paused because an image could not be recorded.
    has_fault: bool = False
    # Progress of the solution, 0 to 1; None if it does not run.
    solving: float | None = None
    verdict: Verdict | None = None
    is_accepted: bool = False  # whether the tip is current
    # Elapsed fraction of the confirmation hold, after the verdict.
    stillness: float = 0.0
    origin: Origin | None = None  # of the images
    # Whether the pen is led by the mouse, so that it leans as the camera sees it.
    is_simulated: bool = False
    is_away: bool = False  # whether another step is shown
    time_left: str = ""  # of reading recorded images, or of the computation

    @cached_property
    def dial(self) -> DialValue:
        """Content of the dial."""
        return _dial(self)

    @property
    def posture(self) -> Posture | None:
        """How the pen leans in the last image; None if it is not seen."""
        detection = self.state.detection
        if detection is None:
            return None
        return posture_of(self.setup.pen, detection.rotation)

    @property
    def n_in_all(self) -> int:
        """The number of images at the end, as it is displayed."""
        return n_in_all_about(self.state.n_kept, self.short.n_more)

    @property
    def fraction(self) -> float | None:
        """Fraction done, 0 to 1; None with the verdict."""
        progress = self.state.progress
        match self.state.phase:
            case Phase.VERDICT:
                return None
            case Phase.SOLVING:
                return self.solving or 0.0
        if self.setup.is_recording:
            return progress.n_read / max(progress.n_images, 1)
        return self.state.n_kept / max(self.n_in_all, 1)

    @property
    def asks_upright(self) -> bool:
        """Whether the pen held upright and still leads to the review."""
        asks = self.verdict is not None and not self.is_accepted
        return asks and not (self.setup.is_recording or self.is_away)

    @property
    def lacks_images(self) -> bool:
        """Whether the swing waits for the camera."""
        streams = self.connection is Connection.STREAMING
        return not streams and self.state.phase not in ENDED

    @property
    def knows_side(self) -> bool:
        """Whether the arrow accounts for the operator's position."""
        is_capturing = self.state.phase is Phase.CAPTURING
        return is_capturing and self.state.heading is not None

    @property
    def is_unsolved(self) -> bool:
        """Whether the tip could be computed, but is not being."""
        return self.state.phase is Phase.SOLVING and self.solving is None


def _dial(moment: SwingViewState) -> DialValue:
    state, wanted = moment.state, moment.short.wanted
    counts = state.counts
    is_capturing = state.phase is Phase.CAPTURING and not moment.lacks_images
    posture, target = moment.posture, state.target if is_capturing else None
    if moment.asks_upright:
        turn = 0.0 if posture is None else posture.turn
        target = replace(UPRIGHT, turn=turn)
    elif state.phase in ENDED or moment.lacks_images:
        posture = None
    if state.heading is None and not moment.setup.is_recording:
        # Nobody knows yet how the operator sees the pen lean; right is his own right.
        first = FIRST_LEAN if state.was_upright else UPRIGHT
        if posture is not None and not moment.is_simulated and state.was_upright:
            posture = UPRIGHT
        target = first if is_capturing else target
    return DialValue(
        counts=counts[1:],
        needed=wanted[1:],
        n_upright=int(counts[0, 0]),
        n_upright_needed=int(wanted[0, 0]),
        posture=posture,
        target=target,
        turns=turn_range(moment.setup.pen, state.kept.rotations),
        heading=-(state.heading or 0.0),
    )


N_LAST = 20  # images that decide whether the spots match the pen
MOST = 0.8  # of them
MISSED = 2  # LEDs, more than a finger and a stray light explain


class LiveDetectionView(QObject):
    """Shows the live detection beside its swing."""

    def __init__(self, run: SwingRun, parent: QObject | None = None) -> None:
        super().__init__(parent)
        self._run = run
        self._seen: LiveImage | None = None
        self._rate = FrameRate()
        self._unfit: deque[bool] = deque(maxlen=N_LAST)

    def add_image(self, shown: DisplayedImage) -> None:
        """Process one more image."""
        self._seen = shown.seen
        self._unfit.append(self._is_unfit(shown.seen))
        self._rate.add(shown.seen.frame)

    def words(self) -> str:
        """Return the content of the last image in a few words; empty without one."""
        seen, setup = self._seen, self._run.status.setup
        if seen is None or setup is None:
            return ""
        if not setup.camera.fits(seen.frame.image):
            return self.tr("Image size does not match this swing.")
        if seen.detection is None or not seen.detection.has_pose:
            text = self.tr("Bright spots: {0}, {1} fps")
            return text.format(len(seen.spots), round(self._rate.value()))
        n_leds = seen.detection.n_leds
        text = self.tr("{0} of {1} LEDs, {2} fps")
        return text.format(n_leds, setup.pen.n_leds, round(self._rate.value()))

    def has_unfit_spots(self) -> bool:
        """Return whether enough spots are seen that do not match the pen."""
        return sum(self._unfit) >= MOST * N_LAST

    def _is_unfit(self, seen: LiveImage) -> bool:
        setup, found = self._run.status.setup, seen.detection
        if setup is None or found is None or len(seen.spots) < setup.pen.n_leds:
            return False
        return not found.has_pose or found.n_leds <= setup.pen.n_leds - MISSED
