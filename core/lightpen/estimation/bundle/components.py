"""Variance components of all random effects of a swing."""

from typing import NamedTuple

import numpy as np

from lightpen.estimation.bundle.image_fields import FieldComponent, ImageField, held
from lightpen.estimation.bundle.seat_modes import MODE_COUNTS
from lightpen.estimation.statistics.variance_components import Component, RandomEffect

NONE = Component(0.0, 0.0)


class Components(NamedTuple):
    """Estimated standard deviations of the random effects."""

    leds: Component  # of an LED coordinate, mm; 0 if the images agree with the file
    seat: tuple[Component, ...]  # of the seat by each kind of mode, mm
    oval: Component  # of the two coefficients of an oval seat, see `oval_seat`, mm
    drift: Component  # of the cone over the whole range of each drift mode, mm
    jitter: RandomEffect  # seating from image to image
    fields: tuple[FieldComponent, ...] = ()  # fitted ones

    @property
    def sigmas(self) -> list[float]:
        """Standard deviations by which the unknowns are fitted, mm."""
        found: list[Component | FieldComponent] = [self.leds, *self.seat, self.oval]
        found += [self.drift, *self.fields]
        jitter = self.jitter.covariance
        by_axis = [] if jitter is None else np.sqrt(np.diag(jitter)).tolist()
        return [*(each.sigma for each in found), *by_axis]

    def with_no_fields(self, fields: tuple[ImageField, ...]) -> "Components":
        """Return these with the fields held at 0, or as stated."""
        return self._replace(fields=tuple(held(field) for field in fields))


NO_COMPONENTS = Components(
    NONE, (NONE,) * len(MODE_COUNTS), NONE, NONE, RandomEffect(None, 0.0)
)
