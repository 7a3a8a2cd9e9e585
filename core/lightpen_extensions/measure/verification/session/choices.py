"""The task of a verification at a station, with options and limits."""

from dataclasses import dataclass, field, replace

from lightpen.messages import Message
from lightpen.model.limits import VerificationLimits
from lightpen_extensions.measure.verification.probing.probing import FAST
from lightpen_extensions.measure.verification.tasks.fixed_point import FIXED_POINT
from lightpen_extensions.measure.verification.tasks.registry import (
    ALL_TASKS,
    AnyOptions,
    AnyTask,
    TaskKind,
    task_of,
)
from lightpen_extensions.measure.verification.tasks.task import (
    FoundT,
    OptionsT,
    VerificationTask,
)


@dataclass(frozen=True)
class VerificationChoices:
    """The selected task, and the options of all."""

    kind: TaskKind = FIXED_POINT.kind
    options: tuple[AnyOptions, ...] = ()  # that differ from the defaults
    n_frames: int = FAST  # images of a point
    limits: VerificationLimits = field(default_factory=VerificationLimits)

    @property
    def task(self) -> AnyTask:
        """The task that is chosen."""
        return task_of(self.kind)

    def options_of(self, task: VerificationTask[OptionsT, FoundT]) -> OptionsT:
        """Return the options of a task."""
        own = (each for each in self.options if isinstance(each, task.options))
        return next(own, task.options())

    def frames_of(self, task: AnyTask) -> int:
        """Return the number of images of a point of a task."""
        return task.n_frames(self.options_of(task)) or self.n_frames

    def with_options(self, options: AnyOptions) -> "VerificationChoices":
        """Return a copy with other options of a task."""
        chosen = {type(each): each for each in (*self.options, options)}
        ordered = (chosen.get(task.options) for task in ALL_TASKS)
        unusual = (each for each in ordered if each and each != type(each)())
        return replace(self, options=tuple(unusual))

    def missing(self, ball_diameter: float | None) -> Message | None:
        """Return the missing entry, with a ball of this diameter, mm."""
        return self.task.missing(self.options_of(self.task), ball_diameter)
