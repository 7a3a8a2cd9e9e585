"""Damaged limits and imports are refused; killed changes lose nothing; in small."""

import os

import pytest
from benchmarks.hostile_guard import damage, guarded_folder, killed_changes

N_MUTATIONS, N_KILLS = 150, 3


def test_damaged_limits_and_imports_are_refused_or_as_they_were_set() -> None:
    with guarded_folder() as guarded:
        outcomes = damage(guarded, N_MUTATIONS)
    assert outcomes["wrong"] == 0
    assert outcomes["refused"] > N_MUTATIONS // 2


@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
def test_a_killed_change_of_limits_loses_nothing() -> None:
    with guarded_folder() as guarded:
        assert killed_changes(guarded, N_KILLS) == N_KILLS
