"""Error for a vehicle whose numbers an analysis cannot use, apart from errors of the program."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

# messages of the kernel on the numbers of a vehicle, see rust_core/src/error.rs: all its errors are ValueErrors
OF_NUMBERS: Final = re.compile(
    r"the fastest motion needs |mass of .* it must be positive|.* it must be (finite|a number)\Z"
)


class NoResultError(ValueError):
    """Error for the numbers of a vehicle for which an analysis has no result: the vehicle fails, not the program."""


@contextmanager
def kernel_errors() -> Iterator[None]:
    """Raise the errors of the kernel that are of the numbers of a vehicle as `NoResultError`.

    >>> with kernel_errors():
    ...     raise ValueError("mass of y.frame is 0, it must be positive")
    Traceback (most recent call last):
    railui.core.errors.NoResultError: mass of y.frame is 0, it must be positive
    """
    try:
        yield
    except ValueError as error:
        if OF_NUMBERS.match(str(error)):
            raise NoResultError(str(error)) from None
        raise
