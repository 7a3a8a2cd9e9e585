"""Frames of two cameras are paired by their moments; none is lost without a word."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np
import pytest

from lightpen.cameras.pairing import (
    LONGEST_WAITING,
    WAITING,
    FramePairs,
    held_up,
    not_synchronised,
)
from lightpen.cameras.protocol import Frame, sealed

PERIOD_MS = 50.0
IMAGE = sealed(np.zeros((2, 2), np.uint8))
N_FRAMES = 40


def frames(
    *,
    late_ms: float = 0.0,
    ahead_ms: float | None = 0.0,
    jitter_ms: float = 0.0,
    period_ms: float = PERIOD_MS,
    without: Sequence[int] = (),
    held_up_ms: Mapping[int, float] | None = None,
) -> Iterator[Frame]:
    """Yield what a camera sends, whose clock is ahead of the machine's, or is none.

    Some frames are held up on their way, by their numbers.
    """
    rng = np.random.default_rng(3)
    for seq in range(N_FRAMES):
        taken = 1000.0 + seq * period_ms + late_ms
        there = taken + 12.0 + jitter_ms * rng.exponential()
        there += (held_up_ms or {}).get(seq, 0.0)
        device = None if ahead_ms is None else round((taken + ahead_ms) * 1e6)
        if seq not in without:
            yield Frame(IMAGE, seq, round(there * 1e6), device)


def paired(
    first: Iterator[Frame], second: Iterator[Frame], n_images: int | None = None
) -> tuple[FramePairs, list[tuple[int, int]]]:
    """Return what became of frames that are taken in the order in which they came."""
    pairs, found = FramePairs(), []
    came = [(frame, 0) for frame in first] + [(frame, 1) for frame in second]
    for frame, c in sorted(came, key=lambda each: each[0].host_ts_ns):
        pairs.add(c, frame)
        while (moment := pairs.next_frame(n_images)) is not None:
            found.append((moment.seq, moment.others[0].seq))
    return pairs, found


def test_frames_of_one_trigger_are_paired_whatever_their_clocks_say() -> None:
    for ahead_ms in (0.0, 3.6e6):
        second = frames(ahead_ms=ahead_ms, jitter_ms=5.0)
        pairs, found = paired(frames(jitter_ms=4.0), second)
        assert found == [(i, i) for i in range(N_FRAMES)]
        assert pairs.n_unpaired == 0
        assert pairs.lag_ms == pytest.approx(0.0, abs=0.6)


def test_cameras_without_clocks_are_paired_by_when_their_frames_came() -> None:
    none = {"ahead_ms": None, "jitter_ms": 1.0}
    _, found = paired(frames(**none), frames(**none))  # type: ignore[arg-type]
    assert found == [(i, i) for i in range(N_FRAMES)]


def test_a_frame_that_got_lost_leaves_its_partner_unpaired_and_counted() -> None:
    pairs, found = paired(frames(without=(7, 20)), frames(without=(12,)))
    assert found == [(i, i) for i in range(N_FRAMES) if i not in {7, 12, 20}]
    assert pairs.n_unpaired == 3


def test_a_camera_whose_clock_began_anew_is_paired_by_the_new_one() -> None:
    hour_ns = round(3.6e12)

    def restarted() -> Iterator[Frame]:
        for frame in frames(ahead_ms=3.6e6):
            assert frame.device_ts_ns is not None
            is_new = frame.seq >= N_FRAMES // 2
            clock_ns = frame.device_ts_ns - (hour_ns if is_new else 0)
            yield replace(frame, device_ts_ns=clock_ns)

    _, found = paired(frames(), restarted())
    assert found == [(i, i) for i in range(N_FRAMES)]


def test_frames_that_come_all_at_once_at_first_are_paired_rightly() -> None:
    at_once = {seq: PERIOD_MS * (8 - seq) for seq in range(8)}
    second = frames(ahead_ms=3.6e6, held_up_ms=at_once)
    pairs, found = paired(frames(), second)
    assert found == [(i, i) for i in range(N_FRAMES)]
    assert pairs.moved_ms() is None


@pytest.mark.parametrize("ahead_ms", [0.0, 3.6e6])
def test_a_camera_held_up_for_long_is_reported_and_paired_rightly_afterwards(
    ahead_ms: float,
) -> None:
    n_held_up = 20
    late = dict.fromkeys(range(n_held_up), 1.5 * PERIOD_MS)
    second = frames(ahead_ms=ahead_ms, held_up_ms=late)
    pairs, found = paired(frames(), second)
    assert [each for each in found if each[0] > n_held_up] == [
        (i, i) for i in range(n_held_up + 1, N_FRAMES)
    ]
    moved_ms = pairs.moved_ms()
    assert moved_ms is not None
    assert moved_ms == pytest.approx(1.5 * PERIOD_MS)
    assert pairs.moved_ms() is None  # reported once
    assert pairs.lag_ms == pytest.approx(0.0, abs=0.1)
    assert "75 ms apart" in str(held_up(moved_ms))


@pytest.mark.slow
def test_clocks_that_drift_apart_are_not_reported_as_held_up() -> None:
    pairs = FramePairs()
    for seq in range(2000):
        for c, clock in enumerate((1.0, 1.001)):  # 100 ms by the end
            taken_ns = seq * PERIOD_MS * 1e6
            there_ns = round(taken_ns + 12e6)
            pairs.add(
                c, Frame(IMAGE, seq, there_ns, round(clock * taken_ns + 1e12 * c))
            )
        while (moment := pairs.next_frame()) is not None:
            assert moment.seq == moment.others[0].seq
        assert pairs.moved_ms() is None


def test_numbers_need_not_agree() -> None:
    second = (replace(frame, seq=frame.seq + 900) for frame in frames())
    _, found = paired(frames(), second)
    assert found == [(i, 900 + i) for i in range(N_FRAMES)]


@pytest.mark.parametrize("late_ms", [12.5, -20.0])
def test_cameras_out_of_step_are_paired_and_their_lag_is_known(late_ms: float) -> None:
    pairs, found = paired(frames(), frames(late_ms=late_ms))
    assert len(found) == N_FRAMES
    assert pairs.lag_ms == pytest.approx(late_ms)


def test_a_faster_camera_is_left_with_frames_of_its_own() -> None:
    pairs, found = paired(frames(), frames(period_ms=PERIOD_MS / 2))
    assert len(found) >= N_FRAMES // 2 - 1
    assert pairs.n_unpaired >= N_FRAMES // 2 - 2
    assert all(2 * first == second for first, second in found)


def test_frames_wait_for_a_camera_that_is_gone_but_not_without_end() -> None:
    pairs = FramePairs()
    for frame in frames():
        pairs.add(0, frame)
        assert pairs.next_frame() is None
    assert pairs.wanted == 1
    assert pairs.n_unpaired == N_FRAMES - LONGEST_WAITING
    for frame in list(frames())[: N_FRAMES // 2]:
        pairs.add(1, frame)  # whose clock is known by then
        pairs.next_frame()
    for frame in frames(late_ms=PERIOD_MS * N_FRAMES):
        pairs.add(0, frame)
        assert pairs.next_frame() is None
    n_unpaired = pairs.n_unpaired
    assert n_unpaired == 2.5 * N_FRAMES - WAITING
    pairs.forget()
    assert pairs.n_unpaired == n_unpaired


def test_recordings_are_paired_by_number_wherever_each_began() -> None:
    n_images = 8
    second = (
        replace(frame, seq=frame.seq + 3 * n_images)
        for frame in frames(without=(0, 1), late_ms=400.0)
    )
    _, found = paired(frames(), second, n_images)
    assert found
    assert all(first % n_images == other % n_images for first, other in found)


def test_what_a_lag_costs_is_said_at_the_pens_speed() -> None:
    assert not_synchronised(None, None) is None
    assert not_synchronised(0.4, 2.0) is None
    reported = str(not_synchronised(-12.5, None))
    assert "12.5 ms apart" in reported
    assert "1.25 mm" in reported
    assert "2.5 px" in str(not_synchronised(12.5, 2.0))
