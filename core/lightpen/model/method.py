"""The estimators of a tip."""

from typing import Literal, TypeAlias

Method: TypeAlias = Literal["joint", "two-stage"]
METHODS: tuple[Method, ...] = ("joint", "two-stage")
