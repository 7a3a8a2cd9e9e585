"""Named points of a part that is measured, as a message of the stream."""

from collections.abc import Sequence
from dataclasses import dataclass

from lightpen_extensions.measure.session.session import SessionSetup, SessionState
from lightpen_extensions.measure.tasks.part import PART
from lightpen_extensions.measure.tasks.part_course import planned_at

POINTS = "Points"


@dataclass(frozen=True)
class NamedPoint:
    """A probed point: its feature, its number there from 1, camera frame, mm."""

    feature: str
    number: int
    place: tuple[float, ...]


def points_of(setup: SessionSetup, state: SessionState) -> tuple[NamedPoint, ...]:
    """Return the points of a part so far, in their order."""
    found = state.found_by(PART)
    if found is not None:
        named = list(found.points)
    else:
        named = []
        for i, points in enumerate((*state.runs, state.touches)):
            planned = planned_at(setup.choices, i)
            named += [("" if planned is None else planned.name, p) for p in points]
    counts: dict[str, int] = {}
    result = []
    for name, point in named:
        counts[name] = counts.get(name, 0) + 1
        result.append(NamedPoint(name, counts[name], tuple(point.point_cam.tolist())))
    return tuple(result)


def points_message(points: Sequence[NamedPoint], at: float) -> bytes:
    """Return the message of points; ``at`` is the time, s since 1970 (UTC)."""
    # Not there without the extra "stream", and not needed before a client connects.
    from pyigtl import PointMessage

    message = PointMessage(
        positions=[each.place for each in points],
        names=[_ascii(f"{each.feature} {each.number}", 64) for each in points],
        groups=[_ascii(each.feature, 32) for each in points],
        timestamp=at,
        device_name=POINTS,
    )
    return bytes(message.pack())


def _ascii(text: str, length: int) -> str:
    """Return a text as a field of the message holds it."""
    return text.encode("ascii", "backslashreplace").decode()[: length - 1]
