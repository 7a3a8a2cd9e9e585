from dataclasses import replace

import numpy as np
import pytest

from lightpen.detection.labelling.constellation import constellation_of
from lightpen_extensions.simulator.swings import flat_pen, paper_pen


def test_six_leds_are_needed_where_the_pen_has_more() -> None:
    assert constellation_of(paper_pen()).min_leds == 6


def test_a_small_pen_needs_all_its_leds() -> None:
    pen = flat_pen("four", [(0, 0, 0), (60, 20, 0), (-50, 90, -25), (10, 150, 0)])
    assert constellation_of(pen).min_leds == 4


def test_leds_on_a_line_form_no_triple() -> None:
    triples = {
        tuple(triple) for triple in constellation_of(paper_pen()).triples.tolist()
    }
    assert (0, 1, 2) not in triples  # three of the back row
    assert (0, 4, 7) in triples
    assert len(triples) == 10 * 9 * 8 - 4 * 6 - 2 * 0 - 6 * 0 - 12


def test_sides_belong_to_their_triples() -> None:
    constellation = constellation_of(paper_pen())
    a, b, c = (constellation.leds[constellation.triples[:, k]] for k in range(3))
    sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (a, c), (b, c))]
    np.testing.assert_allclose(constellation.sides, np.stack(sides, axis=1))


def test_half_a_turn_brings_the_papers_pen_nearly_onto_itself() -> None:
    constellation = constellation_of(paper_pen())
    turns = constellation.self_rotations
    half_turn = np.diag([-1.0, -1.0, 1.0])
    assert min(np.abs(turn - half_turn).max() for turn in turns) < 0.1


def test_a_hexagon_has_the_five_turns_of_its_symmetry() -> None:
    angles = np.arange(6) * np.pi / 3
    pen = flat_pen("hexagon", [(70 * np.cos(a), 70 * np.sin(a), 0) for a in angles])
    constellation = constellation_of(pen)
    assert len(constellation.self_rotations) == 5
    moved = pen.leds @ np.swapaxes(constellation.self_rotations, 1, 2)
    moved += constellation.self_translations[:, None]
    gaps = np.linalg.norm(moved[:, :, None] - pen.leds, axis=-1).min(axis=2)
    np.testing.assert_allclose(gaps, 0, atol=1e-9)


def test_motions_that_turn_the_discs_away_are_no_symmetry() -> None:
    # Turned about y the rectangle and its middle coincide, but the discs look back.
    corners = [
        (-40, 0, 0),
        (40, 0, 0),
        (-40, 90, 0),
        (40, 90, 0),
        (-15, 30, 0),
        (15, 30, 0),
    ]
    assert len(constellation_of(flat_pen("trapezium", corners)).self_rotations) == 0


def test_a_pen_on_one_line_is_a_bug_of_the_caller() -> None:
    pen = flat_pen("line", [(0, y, 0) for y in (0, 30, 70, 150)])
    with pytest.raises(ValueError, match="one line"):
        constellation_of(pen)


def test_another_geometry_is_worked_out_anew() -> None:
    pen = paper_pen()
    doubled = replace(pen, leds=2 * pen.leds)
    ratio = constellation_of(doubled).size / constellation_of(pen).size
    assert ratio == pytest.approx(2)
