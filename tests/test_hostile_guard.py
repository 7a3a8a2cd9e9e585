"""Damaged limits and imports are refused; killed changes lose nothing; in small."""

import os

import pytest
from benchmarks.hostile_guard import CHANGES, damage, guarded_folder, killed_changes

N_MUTATIONS, N_KILLS = 150, 2


@pytest.mark.slow
def test_damaged_limits_and_imports_are_refused_or_as_they_were_set() -> None:
    with guarded_folder() as guarded:
        outcomes = damage(guarded, N_MUTATIONS)
    assert outcomes["wrong"] == 0
    assert outcomes["refused"] > N_MUTATIONS // 2


@pytest.mark.slow
@pytest.mark.skipif(not hasattr(os, "fork"), reason="needs processes that fork")
def test_a_killed_change_of_limits_keys_or_entries_loses_nothing() -> None:
    with guarded_folder() as guarded:
        for kind in CHANGES:
            assert killed_changes(guarded, kind, N_KILLS) == N_KILLS
