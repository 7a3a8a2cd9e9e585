"""Fields of the images that a fit has: size, message and remedy."""

from dataclasses import dataclass

import numpy as np

from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.image_fields import FieldName
from lightpen.estimation.statistics.variance_components import CERTAIN
from lightpen.messages import Message, message
from lightpen.model.quantiles import chi_square_quantile
from lightpen.model.rig import of_camera


@dataclass(frozen=True)
class FoundField:
    """A field that is fitted."""

    name: FieldName
    camera: str  # name of the camera of a rig; else empty
    size: float  # root mean square shift, px
    gain: float  # twice the log likelihood ratio to no field

    @property
    def is_certain(self) -> bool:
        """Whether chance makes it less than once in a thousand."""
        return self.gain > chi_square_quantile(1, CERTAIN)

    @property
    def message(self) -> Message:
        """The message to the user: kind and size, and the remedy."""
        finding = (
            message("warning.lens-field", size=self.size)
            if self.name is FieldName.LENS
            else message("warning.camera-tilt", size=self.size)
        )
        return of_camera(self.camera, finding) if self.camera else finding


def found_fields(bundle: Bundle) -> tuple[FoundField, ...]:
    """Return the fields that a fit supports, the likeliest first."""
    names, found = bundle.state.rig.names, []
    for field, place, component in zip(
        bundle.unknowns.fields,
        bundle.layout.fields,
        bundle.components.fields,
        strict=True,
    ):
        if component.is_supported and np.isfinite(component.gain):
            seen = bundle.used[:, field.camera]
            shifts = field.columns[:, field.camera] @ bundle.values[place]
            size = float(np.sqrt(np.mean(shifts[seen] ** 2)))
            camera = names[field.camera] if names else ""
            found.append(FoundField(field.name, camera, size, component.gain))
    return tuple(sorted(found, key=lambda each: -each.gain))
