"""Significant effects of a station: size, message and remedy."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from lightpen.estimation.bundle.bundle import Bundle
from lightpen.estimation.bundle.effects import EffectName
from lightpen.estimation.statistics.variance_components import CERTAIN
from lightpen.messages import Message, message
from lightpen.model.quantiles import chi_square_quantile
from lightpen.swing_messages import lateness, time_span

_LENGTHS: Mapping[EffectName, Callable[[float], Message]] = {
    EffectName.LENS: lambda size: message("warning.effect-lens", size=size),
    EffectName.COMPLIANCE: lambda size: message("warning.effect-compliance", size=size),
    EffectName.LOOSE: lambda size: message("warning.effect-loose-stylus", size=size),
    EffectName.SAG: lambda size: message("warning.effect-sag", size=size),
    EffectName.TILT: lambda size: message("warning.effect-camera-tilt", size=size),
}
_TIMES: Mapping[EffectName, Callable[[float, float | None], Message]] = {
    EffectName.DELAY: lambda n, ms: message(
        "warning.effect-late-camera", time=lateness(n, ms)
    ),
    EffectName.SHUTTER: lambda n, ms: message(
        "warning.effect-shutter", time=time_span(n, ms)
    ),
    EffectName.STROBE: lambda n, ms: message(
        "warning.effect-strobe", time=time_span(n, ms)
    ),
}

OF_ONE_CAMERA = EffectName.LENS, EffectName.TILT, EffectName.DELAY, EffectName.SHUTTER


@dataclass(frozen=True)
class FoundEffect:
    """An effect that is fitted."""

    name: EffectName
    camera: str  # name of the camera of a rig whose images it shifts; else empty
    # Value (norm of several unknowns, RMS shift of a lens): mm; of lens and camera tilt
    # px, of timing image intervals.
    size: float
    sigma: float | None  # standard uncertainty of the size; None of a lens
    gain: float  # twice the log likelihood ratio to no effect
    interval_ms: float | None = None  # between successive images, if known

    @property
    def is_certain(self) -> bool:
        """Whether chance, or another effect, makes it less than once in a thousand.

        What is smaller than its uncertainty beside the others may be part of these.
        """
        is_known = self.sigma is None or abs(self.size) > self.sigma
        return is_known and self.gain > chi_square_quantile(1, CERTAIN)

    @property
    def message(self) -> Message:
        """The message to the user: kind and size of the effect, and the remedy."""
        if self.name in _TIMES:
            finding = _TIMES[self.name](self.size, self.interval_ms)
        else:
            finding = _LENGTHS[self.name](self.size)
        if not self.camera:
            return finding
        return message("rig.of-camera", camera=self.camera, fault=finding)


def found_effects(
    bundle: Bundle, interval_ms: float | None = None
) -> tuple[FoundEffect, ...]:
    """Return the effects that a fit supports, the likeliest first.

    ``interval_ms`` is the time from one image to the next, if known.
    """
    names = bundle.state.rig.names
    found = []
    for effect, place, component in zip(
        bundle.unknowns.effects,
        bundle.layout.effects,
        bundle.components.effects,
        strict=True,
    ):
        if not (component.is_supported and np.isfinite(component.gain)):
            continue
        values, sigma = bundle.values[place], None
        if effect.name is EffectName.LENS:
            seen = bundle.used[:, effect.camera]
            shifts = (effect.columns[:, effect.camera] @ values)[seen]
            size = float(np.sqrt(np.mean(shifts**2)))
        elif effect.number == 1:
            size = float(values[0])
            sigma = float(np.sqrt(bundle.covariance[place, place][0, 0]))
        else:
            size = float(np.linalg.norm(values))
            along = values / max(size, np.finfo(float).tiny)
            sigma = float(np.sqrt(along @ bundle.covariance[place, place] @ along))
        of_camera = effect.name in OF_ONE_CAMERA and names
        found.append(
            FoundEffect(
                effect.name,
                names[effect.camera] if of_camera else "",
                size,
                sigma,
                component.gain,
                interval_ms,
            )
        )
    return tuple(sorted(found, key=lambda each: -each.gain))
