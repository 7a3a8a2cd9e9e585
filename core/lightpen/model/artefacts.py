"""Reference artefacts with their certificates.

A size is certified for 20 degrees Celsius and grows with the temperature of its
artefact.
"""

from enum import StrEnum
from typing import Annotated

import numpy as np
from msgspec import Meta, Struct

from lightpen.messages import Message, message

REFERENCE = 20.0  # degrees Celsius, for which a size is certified
KNOWN_EXPANSION = 0.1  # U (k = 2) of an expansion coefficient, relative

Size = Annotated[float, Meta(ge=0)]


class Side(StrEnum):
    """On which side of a surface the ball was."""

    AUTO = "auto"  # decided from the touches
    INSIDE = "inside"  # of a bore, or of the inner faces of a length
    OUTSIDE = "outside"  # of a boss, a ball, or the outer faces of a length
    CENTRE = "centre"  # the centre of the ball is meant, as in a cone or a groove


SIDES = {
    Side.INSIDE: message("measuring.inside"),
    Side.OUTSIDE: message("measuring.outside"),
    Side.CENTRE: message("measuring.centre"),
}


class ArtefactKind(StrEnum):
    """Kinds of artefacts, each with its certified size."""

    RING = "ring"  # radius
    LENGTH = "length"  # of a bar, or between two cones
    SPHERE = "sphere"  # diameter
    PLATE = "plate"  # flatness


KIND_WORDS: dict[ArtefactKind, Message] = {
    ArtefactKind.RING: message("artefact.ring"),
    ArtefactKind.LENGTH: message("artefact.length"),
    ArtefactKind.SPHERE: message("artefact.sphere"),
    ArtefactKind.PLATE: message("artefact.plate"),
}


class Artefact(Struct, frozen=True):
    """An artefact with its certificate."""

    kind: ArtefactKind
    certified: Size  # mm, at 20 degrees Celsius
    uncertainty: Size = 0.0  # U (k = 2) of the certificate, mm
    side: Side = Side.CENTRE  # that the ball touches; its centre in cones and grooves
    temperature: float = REFERENCE  # degrees Celsius
    temperature_uncertainty: Size = 1.0  # U (k = 2), K
    expansion: Size = 0.0  # ppm/K; 0 for none

    def size(self) -> tuple[float, float]:
        """Return the size at the temperature, and its U (k = 2), mm."""
        per_kelvin = 1e-6 * self.expansion * self.certified
        warmer = self.temperature - REFERENCE
        by_heat = per_kelvin * np.hypot(
            self.temperature_uncertainty, warmer * KNOWN_EXPANSION
        )
        known = float(np.hypot(self.uncertainty, by_heat))
        return self.certified + per_kelvin * warmer, known
