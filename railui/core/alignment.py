"""Arrays as the kernel reads them: doubles of this machine, contiguous and aligned."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from railui.arrays import FloatArray


def kernel_array(values: ArrayLike) -> FloatArray:
    """Return an array that the kernel can read, the same object if it can be.

    The kernel refuses arrays that begin at an address which is no multiple of 8, as those in a message from another
    process or in a memory map may. All arrays of this package pass through this function on their way to the kernel.

    >>> message = np.frombuffer(bytes(1) + np.array([1.0, 2.0]).tobytes(), offset=1)
    >>> message.flags.aligned, kernel_array(message).flags.aligned, kernel_array(message).tolist()
    (False, True, [1.0, 2.0])
    """
    array = np.ascontiguousarray(values, dtype=float)
    return array if array.flags.aligned else array.copy()
