"""What a station verifies, as its settings keep it."""

from dataclasses import replace

from lightpen.verification.choices import Surface, TaskKind, VerificationChoices
from lightpen.verification.touching import FAST
from lightpen_app.work.settings import Station

BETWEEN = "; "  # in the text that names what is touched
MOST_TOUCHES = 100  # also of images in one


def choices_of(station: Station) -> VerificationChoices:
    """Return what a station verifies; what makes no sense is as usual."""
    usual = VerificationChoices()
    named = station.verified.split(BETWEEN)
    return replace(
        usual,
        kinds=tuple(kind for kind in TaskKind if kind.value in named),
        n_touches=_count(station.fixed_point_touches, usual.n_touches),
        radius=max(station.ring_radius, 0.0),
        radius_uncertainty=max(station.ring_uncertainty, 0.0),
        surface=_surface(station.ring_surface),
        n_runs=_count(station.ring_runs, 1),
        length=max(station.bar_length, 0.0),
        length_uncertainty=max(station.bar_uncertainty, 0.0),
        length_surface=_surface(station.bar_surface),
        n_places=_count(station.bar_places, 1),
        n_frames=_count(station.touch_images, FAST),
    )


def with_choices(station: Station, choices: VerificationChoices) -> Station:
    """Return what a station keeps, with its choices."""
    return replace(
        station,
        verified=BETWEEN.join(choices.kinds),
        fixed_point_touches=choices.n_touches,
        ring_radius=choices.radius,
        ring_uncertainty=choices.radius_uncertainty,
        ring_surface=str(choices.surface),
        ring_runs=choices.n_runs,
        bar_length=choices.length,
        bar_uncertainty=choices.length_uncertainty,
        bar_surface=str(choices.length_surface),
        bar_places=choices.n_places,
        touch_images=choices.n_frames,
    )


def _surface(kept: str) -> Surface:
    return Surface(kept) if kept in set(Surface) else Surface.GROOVE


def _count(kept: int, usual: int) -> int:
    return kept if 1 <= kept <= MOST_TOUCHES else usual
