"""How arguments of kernels are laid out in memory, looked up once for all the arrays of a run."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from softhand.numerics.arrays import AnyArray
from softhand.numerics.prepared import PLACE_WORD, words_of


class Layouts:
    """What is the same for all runs of one structure: shapes, and which arrays are views of one memory, and where.

    Attributes:
        memories: arrays that own the numbers, in the order in which they were met.
        places: address of each.
    """

    def __init__(self) -> None:
        self.memories: list[AnyArray] = []
        self.places: list[int] = []
        self._numbers: dict[int, int] = {}
        self._known: dict[int, tuple[Any, Any]] = {}

    def of(self, argument: Any) -> Any:
        """Layout of an array, of a number that a run chooses ("number"), of a tuple of them; whole numbers as such."""
        if isinstance(argument, float):
            return "number"
        if not isinstance(argument, tuple | np.ndarray):
            return argument
        known = self._known.get(id(argument))
        if known is None:
            layout = tuple(map(self.of, argument)) if isinstance(argument, tuple) else self._of_array(argument)
            self._known[id(argument)] = known = argument, layout
        return known[1]

    def number_of(self, array: AnyArray) -> tuple[int, int]:
        """Number of the memory that an array lies in, and how many bytes behind its begin."""
        whole = array
        while isinstance(whole.base, np.ndarray):
            whole = whole.base
        number = self._numbers.get(id(whole))
        if number is None:
            number = self._numbers[id(whole)] = len(self.memories)
            self.memories.append(whole)
            self.places.append(whole.ctypes.data)
        return number, 0 if whole is array else array.ctypes.data - self.places[number]

    def words(self, arguments: tuple[Any, ...]) -> NDArray[np.int64]:
        """As `prepared.words_of`, from what they are for all arguments of this layout."""
        layout = self.of(arguments)
        if layout not in _templates:
            _templates[layout] = _template(arguments, self)
        words, where, memories, shifts, reals = _templates[layout]
        words = words.copy()
        words[where] = np.array(self.places)[memories] + shifts
        words[reals] = np.array(numbers_in(arguments)).view(np.int64)
        return words

    def places_of_numbers(self, arguments: tuple[Any, ...]) -> list[int]:
        """Which of the `words` are the reals."""
        places: list[int] = _templates[self.of(arguments)][-1]
        return places

    def _of_array(self, array: AnyArray) -> Any:
        return *self.number_of(array), array.dtype, array.shape, array.strides, array.flags.writeable


_templates: dict[Any, Any] = {}


def _template(arguments: tuple[Any, ...], layouts: Layouts) -> Any:
    """Words, and which of them are addresses of what, and which are reals."""
    words: list[int] = []
    where: list[tuple[int, int, int]] = []
    reals: list[int] = []

    def walk(argument: Any) -> None:
        if isinstance(argument, tuple):
            for item in argument:
                walk(item)
            return
        if isinstance(argument, np.ndarray):
            where.append((len(words) + PLACE_WORD, *layouts.number_of(argument)))
        elif isinstance(argument, float):
            reals.append(len(words))
        words.extend(words_of(argument))

    walk(arguments)
    return (np.array(words, dtype=np.int64), *np.array(where, dtype=np.int64).reshape(-1, 3).T, reals)


def numbers_in(argument: Any) -> list[float]:
    """The reals of an argument, in their order."""
    if isinstance(argument, tuple):
        return [number for item in argument for number in numbers_in(item)]
    return [argument] if isinstance(argument, float) else []
