"""A verification under way, of which something else is chosen now."""

from dataclasses import replace

from lightpen.verification.choices import TaskKind, VerificationChoices
from lightpen.verification.session import touched_anew
from lightpen.verification.session_state import (
    SessionSetup,
    SessionState,
    without_touches,
)


def with_other_choices(
    setup: SessionSetup, state: SessionState, choices: VerificationChoices
) -> tuple[SessionSetup, SessionState]:
    """Return a verification as it goes on by other choices.

    What was found of another artefact than is chosen now is found anew; all else stays.
    Where another task is to be touched now, the touches at hand are forgotten, and the
    state has another `touching`.
    """
    task = state.task(setup)
    for kind in TaskKind:
        is_found = state.found(kind) is not None
        if is_found and _asks_otherwise(kind, setup.choices, choices):
            state = touched_anew(state, kind)
    setup = replace(setup, choices=choices)
    if state.task(setup) is not task:
        state = without_touches(state)
    if state.task(setup) is not None and state.drift is not None:
        state = replace(without_touches(state), drift=None)  # it was of others
    if state.unwitnessed and not state.is_witnessed(setup):
        state = replace(state, unwitnessed=())
    return setup, state


def _asks_otherwise(
    kind: TaskKind, one: VerificationChoices, other: VerificationChoices
) -> bool:
    """Return whether what a task has found is of another artefact."""
    artefacts = [
        {
            TaskKind.FIXED_POINT: (),
            TaskKind.CIRCLE: (of.radius, of.radius_uncertainty, of.surface),
            TaskKind.LENGTH: (
                of.length,
                of.length_uncertainty,
                of.length_surface,
            ),
            TaskKind.ARTICULATION: (),
            TaskKind.DRIFT: (),
        }[kind]
        for of in (one, other)
    ]
    return artefacts[0] != artefacts[1]
