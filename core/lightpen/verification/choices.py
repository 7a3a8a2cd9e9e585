"""What a station verifies, with which artefacts, and by which limits."""

from dataclasses import dataclass, field
from enum import StrEnum

from lightpen.model.limits import VerificationLimits
from lightpen.sentences import sentence
from lightpen.verification.fixed_point import USUAL_TOUCHES
from lightpen.verification.touching import FAST


class TaskKind(StrEnum):
    """What is touched."""

    FIXED_POINT = "fixed point"
    CIRCLE = "circle"
    LENGTH = "length"
    ARTICULATION = "articulation"
    DRIFT = "drift"  # of a cone that stands still, before, between and after the others


WHOLE = TaskKind.FIXED_POINT, TaskKind.CIRCLE, TaskKind.LENGTH  # the paper's three


class Surface(StrEnum):
    """What of a ring, or of the ends of a length, the ball touches."""

    GROOVE = "groove"  # in which the centre of the ball runs, or cones
    BORE = "bore"  # or inner faces
    BOSS = "boss"  # or outer faces


class Wanting(StrEnum):
    """What keeps a verification from being begun."""

    TASK = "task"
    RADIUS = "radius"
    LENGTH = "length"
    BALL = "ball"


WANTING = {
    Wanting.TASK: sentence(
        "verification.no-task",
        "Nothing is chosen to be touched. Choose the fixed point, the ring or the "
        "length.",
    ),
    Wanting.RADIUS: sentence(
        "verification.no-radius",
        "The radius of the ring is not known. Enter the certified one.",
    ),
    Wanting.BALL: sentence(
        "verification.no-ball",
        "The diameter of the ball is not known, which a ring or a length touched at "
        "its faces needs. Enter it where the tip is named.",
    ),
    Wanting.LENGTH: sentence(
        "verification.no-length",
        "The length is not known. Enter the certified one.",
    ),
}


@dataclass(frozen=True)
class VerificationChoices:
    """What is verified, and how.

    Attributes
    ----------
    kinds : tuple of TaskKind
        In the order of `TaskKind`.
    n_touches : int
        Of the fixed point.
    radius, radius_uncertainty : float
        Certified radius of the ring, 0 where it is not known, and its U (k = 2), mm.
    n_runs : int
        Round the ring.
    length, length_uncertainty : float
        As those of the radius.
    length_surface : Surface
        What the ball touches at its ends.
    n_places : int
        At which the length is touched.
    n_frames : int
        Images of a touch.
    """

    kinds: tuple[TaskKind, ...] = (TaskKind.FIXED_POINT,)
    n_touches: int = USUAL_TOUCHES
    radius: float = 0.0
    radius_uncertainty: float = 0.0
    surface: Surface = Surface.GROOVE
    n_runs: int = 1
    length: float = 0.0
    length_uncertainty: float = 0.0
    length_surface: Surface = Surface.GROOVE
    n_places: int = 1
    n_frames: int = FAST
    limits: VerificationLimits = field(default_factory=VerificationLimits)

    def wanting(self, ball_diameter: float | None) -> tuple[Wanting, ...]:
        """Return what is missing, with a ball of this diameter, mm."""
        wants_ring = TaskKind.CIRCLE in self.kinds
        wants_length = TaskKind.LENGTH in self.kinds
        touched = (wants_ring, self.surface), (wants_length, self.length_surface)
        is_offset = any(
            wanted and surface is not Surface.GROOVE for wanted, surface in touched
        )
        wanting = {
            Wanting.TASK: not self.kinds,
            Wanting.RADIUS: wants_ring and not self.radius,
            Wanting.BALL: is_offset and not ball_diameter,
            Wanting.LENGTH: wants_length and not self.length,
        }
        return tuple(each for each, is_wanting in wanting.items() if is_wanting)


def ball_offset(surface: Surface, ball_diameter: float | None) -> float:
    """Return by how much a surface lies farther out than the tip's centre, mm.

    That is to be added to the radius of a circle of tip centres, and to each end of a
    length.
    """
    sign = {Surface.GROOVE: 0.0, Surface.BORE: 1.0, Surface.BOSS: -1.0}[surface]
    return sign * (ball_diameter or 0.0) / 2
