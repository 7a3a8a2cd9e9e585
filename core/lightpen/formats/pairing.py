"""Pair simultaneous images of several cameras by their names or their order."""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import PurePath
from typing import TypeAlias

import numpy as np

from lightpen.arrays import IntArray
from lightpen.errors import FileError
from lightpen.formats.images import natural_order

NONE = -1
SHARED = 0.5  # share of images that must match, of the camera with fewest

Key: TypeAlias = str | int


@dataclass(frozen=True, eq=False)
class Pairing:
    """The images of C cameras at N moments."""

    images: IntArray  # (N, C), index of the image, from 0; -1 for none
    by_order: bool = False  # as the names do not match


def pair_images(names: Sequence[Sequence[str]], cameras: Sequence[str]) -> Pairing:
    """Pair the images of cameras by name, by the last number in the names, or by order.

    Raises `FileError` if the names do not match and the numbers of images differ.
    """
    for key_of in (_stem, _last_number):
        paired = _paired(names, key_of)
        if paired is not None:
            return Pairing(paired)
    counts = [len(each) for each in names]
    if min(counts) < max(counts):
        few, many = counts.index(min(counts)), counts.index(max(counts))
        raise FileError(
            "rig.names-tell-nothing",
            n_few=counts[few],
            few=cameras[few],
            n_many=counts[many],
            many=cameras[many],
            example=names[few][0],
            other=names[many][0],
        )
    return Pairing(np.tile(np.arange(counts[0])[:, None], (1, len(names))), True)


def _paired(
    names: Sequence[Sequence[str]], key_of: Callable[[str], Key | None]
) -> IntArray | None:
    """Return the images of each key in order; None if the keys do not match."""
    places: list[dict[Key, int]] = []
    for each in names:
        keys = [key_of(name) for name in each]
        if None in keys or len(set(keys)) < len(keys):
            return None
        places.append({key: i for i, key in enumerate(keys) if key is not None})
    every = set[Key]().union(*places)
    n_shared = sum(sum(key in each for each in places) > 1 for key in every)
    if n_shared < SHARED * min(map(len, places)):
        return None
    ordered = sorted(every, key=lambda key: natural_order(str(key)))
    return np.array([[each.get(key, NONE) for each in places] for key in ordered])


def _stem(name: str) -> str:
    return PurePath(name).stem


def _last_number(name: str) -> int | None:
    digits = re.findall(r"(?a:\d+)", _stem(name))
    return int(digits[-1]) if digits else None
