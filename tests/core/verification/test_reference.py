"""What each verification task finds, records and shows is as before.

That it is right is shown by the other tests; that nothing changes unnoticed, here.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import asdict, fields, replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from msgspec import structs
from tests.reference import assert_as_before, parts_of, text_figures

from lightpen.arrays import FloatArray
from lightpen.estimation.uncertainty.instrument import Instrument
from lightpen.measuring.plan import Plan
from lightpen.messages import Message
from lightpen.model.limits import VerificationLimits, rule_in_words
from lightpen.simulator.plate import plate_plan
from lightpen.simulator.swings import PAPER_CONE, PAPER_TIP
from lightpen.verification.reports.charts import write_chart
from lightpen.verification.reports.records import (
    repeatability_entries,
    verification_record,
)
from lightpen.verification.reports.summaries import found_text, repeatability_text
from lightpen.verification.tasks.articulation import ArticulationOptions
from lightpen.verification.tasks.circle import CircleOptions
from lightpen.verification.tasks.drift import DriftOptions
from lightpen.verification.tasks.fixed_point import FixedPointOptions
from lightpen.verification.tasks.length import LengthOptions
from lightpen.verification.tasks.part import PART
from lightpen.verification.tasks.part_course import PartOptions
from lightpen.verification.tasks.plane import PlaneOptions
from lightpen.verification.tasks.probed_point import ProbedPoint
from lightpen.verification.tasks.registry import ALL_TASKS, AnyTask, task_of
from lightpen.verification.tasks.repeatability import (
    STUDY,
    TipEstimate,
    measure_repeatability,
)
from lightpen.verification.tasks.sphere import (
    SIMULATED_AXES,
    SphereOptions,
    sphere_directions,
)
from lightpen.verification.tasks.task import (
    Conditions,
    ResultTable,
    Surface,
    TaskOptions,
    TaskProgress,
)

Touching = Callable[..., tuple[ProbedPoint, ...]]
Ring = Callable[..., FloatArray]
Named = tuple[tuple[str, tuple[ProbedPoint, ...]], ...]

ENDS = PAPER_CONE + np.array([[-75.0, 0.0, 0.0], [75.0, 4.0, 20.0]])
LIMITS = VerificationLimits(form=0.12)
PLATE = plate_plan()
HOLES = Plan("Holes", PLATE.features[:4])
SOME = Plan("Some", PLATE.features[1:3])
OF_NO_KIND = Plan("Some", tuple(structs.replace(f, kind=None) for f in SOME.features))
DENTS = 0.003 * (-1.0) ** np.arange(25)
DRIFT = np.array([0.004, 0.001, 0.006])


def spread(points: FloatArray, seed: int, by: float = 0.01) -> FloatArray:
    """Return points that are off by as much, mm."""
    return points + by * np.random.default_rng(seed).standard_normal(points.shape)


def plate_runs(
    touching: Touching, plan: Plan
) -> Iterator[tuple[str, tuple[ProbedPoint, ...]]]:
    """Return the points of features of the simulated plate."""
    options = PartOptions(plan)
    for run, planned in enumerate(plan.features):
        places = []
        for step in range(planned.n_touches):
            goal = PART.hand(options, run, step)
            assert goal.point is not None
            assert goal.outwards is not None
            places.append(PAPER_CONE + goal.point + 5.0 * goal.outwards)
        yield planned.name, touching(spread(np.array(places), run), seed=run)


@pytest.fixture(scope="module")
def runs(touching: Touching, ring: Ring) -> Mapping[str, tuple[TaskOptions, Named]]:
    """What is touched in each task, and how it is chosen."""
    cone, off = np.tile(PAPER_CONE, (8, 1)), PAPER_TIP + np.array([0.15, 0.0, -0.1])
    lifted = cone.copy()
    lifted[5] += [0.0, -9.0, 2.0]
    lobes = 1 + 0.0025 * np.cos(5 * np.linspace(0, 2 * np.pi, 24, endpoint=False))
    middle = ring(24).mean(axis=0)
    lobed = middle + lobes[:, None] * (ring(24) - middle)
    beside = spread(ring(24), 5)
    beside[7] += [0.5, 0.0, -6.0]
    ball = spread(PAPER_CONE + 20 * sphere_directions(25) @ SIMULATED_AXES, 6)
    dented = PAPER_CONE + (1 + DENTS[:, None]) * (ball - PAPER_CONE)
    plate = np.stack(np.meshgrid([-60.0, 0.0, 60.0], [-40.0, 0.0, 40.0]), axis=-1)
    tilted = plate.reshape(-1, 2) @ [[1.0, 0.1, 0.0], [0.0, 0.9, 0.4]]
    postures = [
        (str(k), touching(np.tile(PAPER_CONE, (5, 1)), seed=k, tilt=0.1 + 0.1 * k))
        for k in range(5)
    ]
    again = [tuple(replace(t, rotation=p[0].rotation) for t in p) for _, p in postures]
    circles = [
        (f"run {k}", touching(spread(ring(20 + k), k), seed=k, n_frames=1 + k))
        for k in range(3)
    ]
    whole = tuple(plate_runs(touching, PLATE))
    return {
        "fixed point": (FixedPointOptions(), (("", touching(spread(cone, 1))),)),
        "fixed point, lifted": (
            FixedPointOptions(n_touches=8),
            (("", touching(lifted, n_frames=3)),),
        ),
        "fixed point, another tip": (
            FixedPointOptions(),
            (("", touching(cone, tip_pen=off)),),
        ),
        "circle": (CircleOptions(31.75, 0.002, n_runs=3), tuple(circles)),
        "circle, one run": (CircleOptions(31.7), tuple(circles[:1])),
        "circle, not round": (
            CircleOptions(26.751, 0.002, Surface.BOSS, n_runs=2),
            (circles[0], ("lobed", touching(lobed))),
        ),
        "circle, lifted": (CircleOptions(31.751), (("", touching(beside)),)),
        "circle, uncertain": (CircleOptions(31.751, 0.2), tuple(circles[:1])),
        "circle, another": (CircleOptions(20.0, n_runs=3), tuple(circles)),
        **{
            f"sphere, {name}": (
                SphereOptions(diameter, u, Surface.BOSS),
                (("", touching(points)),),
            )
            for name, diameter, u, points in (
                ("good", 30.0, 0.001, ball),
                ("too large", 29.9, 0.001, ball),
                ("another", 20.0, 0.001, ball),
                ("uncertain", 30.0, 0.4, ball),
                ("not round", 30.0, 0.002, dented),
                ("lifted", 30.0, 0.002, np.concatenate([ball, ball[:1] + 5.0])),
            )
        },
        "length": (
            LengthOptions(151.5, 0.003, n_places=2),
            (
                ("here", touching(spread(np.repeat(ENDS, 3, axis=0), 2), n_frames=2)),
                ("there", touching(spread(ENDS + np.array([0.0, 30.0, 60.0]), 3))),
            ),
        ),
        "plane": (
            PlaneOptions(0.004, 9),
            (("", touching(spread(PAPER_CONE + tilted, 4), n_frames=2)),),
        ),
        "part": (PartOptions(HOLES), tuple(plate_runs(touching, HOLES))),
        "part, recognised": (
            PartOptions(OF_NO_KIND),
            tuple(plate_runs(touching, SOME)),
        ),
        "part, whole": (PartOptions(PLATE), whole),
        "part, not whole": (PartOptions(PLATE), whole[:6]),
        "articulation": (
            ArticulationOptions(),
            tuple(zip("abcde", again, strict=True)),
        ),
        "articulation, one run": (ArticulationOptions(), (("", sum(again, ())),)),
        "drift": (
            DriftOptions(),
            tuple(
                (name, touching(cone[:3] + k * DRIFT, seed=k, n_frames=4))
                for k, name in enumerate(("before", "between", "after"))
            ),
        ),
    }


COURSES = (
    *("fixed point", "fixed point, lifted", "fixed point, another tip", "circle"),
    *("circle, one run", "sphere, good", "length", "plane", "articulation", "drift"),
)
CASES = (
    *COURSES,
    *("circle, not round", "circle, lifted", "circle, uncertain", "circle, another"),
    *("sphere, too large", "sphere, another", "sphere, uncertain", "sphere, not round"),
    *("sphere, lifted", "articulation, one run"),
    *("part", "part, whole", "part, not whole", "part, recognised"),
)


@pytest.fixture(scope="module")
def conditions(instrument: Instrument) -> Conditions:
    return Conditions(
        instrument,
        LIMITS,
        ball_diameter=10.0,
        nominal_tip=np.array([0.0, -90.0, -25.0]),
        cone_cam=PAPER_CONE + np.array([0.002, 0.0, 0.001]),
        drift=DRIFT,
    )


def shown(tables: tuple[ResultTable, ...]) -> dict[str, Any]:
    """Return tables by their codes; each quantity apart, whatever its size."""
    return {"titles": [table.title for table in tables]} | {
        table.title.code: {
            "columns": [{"name": code_of(each)} for each in table.columns],
            "notes": table.notes,
            "rows": [
                {
                    code_of(row.name): {
                        "decimals": row.decimals,
                        "remark": row.remark,
                        "values": {str(i): v for i, v in enumerate(row.values)},
                    }
                }
                for row in table.rows
            ],
        }
        for table in tables
    }


def code_of(name: Message | str) -> str:
    """Return what a row or column is known by, however it is worded."""
    return name.code if isinstance(name, Message) else name


@pytest.mark.parametrize("case", CASES)
def test_what_a_task_finds_is_as_before(
    case: str, runs: Mapping[str, tuple[TaskOptions, Named]], conditions: Conditions
) -> None:
    options, named = runs[case]
    task = task_of(case.partition(",")[0])
    found = task.measure(named, conditions, options)
    record = verification_record(
        *(task.kind, task.entries(found, conditions.instrument), found.assessment),
        *({name: getattr(LIMITS, name) for name in task.limits}, {}),
    )
    del record["program"], record["created"]

    assert_as_before(
        f"verification-{case.replace(', ', '-').replace(' ', '-')}",
        {
            "record": record,
            "found": parts_of(found),
            "tables": shown(task.tables(found, conditions)),
            "text": text_figures(
                found_text(
                    task.tables(found, conditions),
                    found.assessment,
                    (),
                    rule_in_words(LIMITS),
                )
            ),
        },
    )


def step_of(
    task: AnyTask, options: TaskOptions, progress: TaskProgress, conditions: Conditions
) -> dict[str, Any]:
    """Return what is said and counted after some points."""
    said = [
        task.counted(options, progress),
        task.instruction(options, progress),
        *(task.headline(progress, is_next=is_next) for is_next in (False, True)),
    ]
    step = {"done": task.done(options, progress)}
    if not progress.points:
        return step | {"said": said}
    screened = task.screen(options, conditions, progress)
    if screened.fault is not None:
        said.append(screened.fault)
    return step | {
        "said": said,
        "kept": list(screened.kept),
        "figures": shown(task.figures_so_far(options, progress, conditions)),
    }


@pytest.mark.parametrize(
    "case",
    [
        *(each for each in COURSES if each != "circle"),
        *("part", "part, recognised"),
        pytest.param("circle", marks=pytest.mark.slow),
    ],
)
def test_how_a_task_goes_on_is_as_before(
    case: str, runs: Mapping[str, tuple[TaskOptions, Named]], conditions: Conditions
) -> None:
    options, named = runs[case]
    task = task_of(case.partition(",")[0])
    steps: list[dict[str, Any]] = []
    for i, (_, points) in enumerate(named):
        for n in range(len(points) + 1):
            progress = TaskProgress(
                points[:n], tuple(each for _, each in named[:i]), n_runs=len(named)
            )
            steps.append(step_of(task, options, progress, conditions))
    goals = [task.hand(options, i, k) for i in range(2) for k in range(6)]
    about = {
        "hand": [[g.point, g.tilt, g.direction] for g in goals],
        "newness": dict(zip(("turn", "distance"), task.newness(options), strict=True)),
        "needed": [task.n_points(options), task.n_runs(options)],
    }

    name = case.replace(", ", "-").replace(" ", "-")
    assert_as_before(f"course-{name}", {"steps": steps, **about})


def test_how_well_tips_repeat_is_as_before(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    tips = [
        TipEstimate(f"{i}", tip, np.array([0.003, 0.004, 0.006]))
        for i, tip in enumerate(PAPER_TIP + 0.003 * rng.standard_normal((12, 3)))
    ]
    found = measure_repeatability(
        *(tips, VerificationLimits()), tolerance=0.05, reference=PAPER_TIP
    )

    off = [
        replace(tips[0], name=f"off {by}", tip_pen=PAPER_TIP + by) for by in (-0.1, 0.1)
    ]
    charts = []
    for shown_tips in (tips, [*tips, off[0]], [*tips, off[1]]):
        for name in ("chart.svg", "chart.csv"):
            chart = tmp_path / name
            write_chart(
                measure_repeatability(shown_tips, LIMITS, tolerance=0.05), chart
            )
            charts.append(text_figures(chart.read_text(encoding="utf-8")))
    few = measure_repeatability(tips[:3], VerificationLimits())
    for n_tips in (STUDY - 1, STUDY):
        many = measure_repeatability(
            (3 * tips)[:n_tips], VerificationLimits(), tolerance=0.05
        )
        is_short = f"a study takes {STUDY}" in repeatability_text(many)
        assert is_short == (n_tips < STUDY)

    assert_as_before(
        "repeatability",
        {
            **repeatability_entries(found),
            "charts": charts,
            "texts": [text_figures(repeatability_text(each)) for each in (found, few)],
        },
    )


def test_what_can_be_entered_is_as_before() -> None:
    tasks = {
        task.kind: {
            "fields": {
                each.name: asdict(each) | {"usual": getattr(task.options(), each.name)}
                for each in task.fields
            },
            "traits": {
                each.name: value
                for each in fields(task)
                if isinstance(value := getattr(task, each.name), bool)
            },
            "scans": [task.scans(task.options(), run) for run in range(2)],
        }
        for task in ALL_TASKS
    }

    assert_as_before("verification-tasks", tasks)


@pytest.mark.parametrize(
    ("options", "ball", "code"),
    [
        (CircleOptions(), 10.0, "verification.no-radius"),
        (CircleOptions(20.0), None, "verification.no-certificate-u"),
        (CircleOptions(20.0, 0.001), None, None),
        (
            CircleOptions(20.0, 0.001, surface=Surface.BORE),
            None,
            "verification.no-ball",
        ),
        (CircleOptions(20.0, 0.001, surface=Surface.BOSS), 10.0, None),
        (LengthOptions(), 10.0, "verification.no-length"),
        (LengthOptions(100.0), None, "verification.no-certificate-u"),
        (LengthOptions(100.0, 0.001), None, None),
        (
            LengthOptions(100.0, 0.001, surface=Surface.BOSS),
            None,
            "verification.no-ball",
        ),
        (LengthOptions(100.0, 0.001, surface=Surface.BORE), 10.0, None),
        (FixedPointOptions(), None, None),
    ],
)
def test_what_has_to_be_entered_before_is_named(
    options: TaskOptions, ball: float | None, code: str | None
) -> None:
    kind = str(type(options).__struct_config__.tag)
    missing = task_of(kind).missing(options, ball)

    assert (None if missing is None else missing.code) == code
