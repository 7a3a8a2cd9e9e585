"""Standard deviations of all kinds of errors that the images tell."""

from typing import NamedTuple

from lightpen.estimation.seat_forms import FORMS
from lightpen.estimation.variance_components import Component, Jitter

NONE = Component(0.0, 0.0)


class Components(NamedTuple):
    """Standard deviations that the images tell.

    Attributes
    ----------
    leds : Component
        Of one LED coordinate, mm; none where the file states it and the images do
        not deny it.
    seat : tuple of Component
        Of the seat by each kind of form in which it may follow the lean, mm.
    oval : Component
        Of the two numbers of an oval seat, see `oval_seat`, mm.
    drift : Component
        Of the cone over the whole of each of its ways, mm.
    jitter : Jitter
        Of the seat from image to image.
    """

    leds: Component
    seat: tuple[Component, ...]
    oval: Component
    drift: Component
    jitter: Jitter


NO_COMPONENTS = Components(NONE, (NONE,) * len(FORMS), NONE, NONE, Jitter(None, 0.0))
