"""View state of the step Swing, as a value for the widgets."""

from dataclasses import dataclass, replace
from functools import cached_property

from lightpen.cameras.worker_events import Connection
from lightpen.estimation.reports.verdict import Verdict
from lightpen.model.origin import Origin
from lightpen.model.posture import FIRST_LEAN, UPRIGHT, Posture, posture_of
from lightpen.swing.capture.shortfall import Shortfall, turn_range
from lightpen.swing.capture.state import Phase, SwingSetup, SwingState
from lightpen_app.steps.swing.remaining_images import RemainingImages
from lightpen_app.widgets.posture_dial import DialValue

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
    to_go: RemainingImages | None = None
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
    def remaining(self) -> RemainingImages:
        """The number of images, as it is displayed."""
        first = RemainingImages.first(self.short.n_more, self.state.n_kept)
        return first if self.to_go is None else self.to_go

    @property
    def n_more(self) -> int:
        """Remaining images, no more than displayed."""
        return min(self.short.n_more, self.remaining.n_images)

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
        return self.remaining.fraction

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
