"""Search for fields of the images that improve a fit without them.

All are unknowns of one linear step about the fit, with all variance components
estimated anew, as others may have absorbed a field. One that the images support is to
be fitted. The others are held at 0, and what they may be all the same moves tip and
cone by its own covariance.
"""

from dataclasses import dataclass

import numpy as np

from lightpen.arrays import FloatArray
from lightpen.estimation.bundle.bundle import Bundle, with_fields
from lightpen.estimation.bundle.image_fields import (
    FieldComponent,
    FieldName,
    ImageField,
    image_fields,
)
from lightpen.estimation.variance_components import CERTAIN
from lightpen.messages import Message, message
from lightpen.model.information import inverse
from lightpen.model.quantiles import chi_square_quantile
from lightpen.model.rig import of_camera


@dataclass(frozen=True, eq=False)
class SearchedField:
    """A field beside a fit without it."""

    field: ImageField
    component: FieldComponent
    # (6, k), error of the effective (tip, cone) per unknown of the field if it is 0.
    by_unknowns: FloatArray

    @property
    def covariance(self) -> FloatArray:
        """Covariance of (tip, cone) by the possible size of the field, (6, 6)."""
        G = self.by_unknowns
        return np.asarray(G @ self.component.covariance @ G.T)


def search_fields(bundle: Bundle, pixels: FloatArray) -> tuple[SearchedField, ...]:
    """Search a fit for fields of the images beside those that it has.

    ``pixels`` (N, C, L, 2) are the LED centres, px.
    """
    state, known = bundle.state, bundle.unknowns.fields
    fitted = {(each.name, each.camera) for each in known}
    every = image_fields(pixels, bundle.used, state.rig.cameras, state.rotations)
    fields = [each for each in every if (each.name, each.camera) not in fitted]
    if not fields:
        return ()
    unknowns, solved = with_fields(bundle, (*known, *fields), pixels)
    places = unknowns.layout.fields[len(known) :]
    new = np.concatenate([np.arange(at.start, at.stop) for at in places])
    rest = np.delete(np.arange(unknowns.number), new)
    gain = bundle.effective @ inverse(
        (solved.information + solved.measured + solved.prior)[np.ix_(rest, rest)]
    )
    return tuple(
        SearchedField(field, found, gain @ solved.information[rest, at])
        for field, found, at in zip(
            fields, solved.components.fields[len(known) :], places, strict=True
        )
    )


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
        if field.is_supported(component) and np.isfinite(component.gain):
            seen = bundle.used[:, field.camera]
            shifts = field.columns[:, field.camera] @ bundle.values[place]
            size = float(np.sqrt(np.mean(shifts[seen] ** 2)))
            camera = names[field.camera] if names else ""
            found.append(FoundField(field.name, camera, size, component.gain))
    return tuple(sorted(found, key=lambda each: -each.gain))
