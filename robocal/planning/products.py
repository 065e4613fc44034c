"""Products of a small matrix with many columns, in pieces too small to be shared among threads.

A search makes thousands of such products; for each of them starting the threads of the linear
algebra library costs more than the product, and takes the cores from the other processes.
"""

import numpy as np
from jaxtyping import Float
from numpy import ndarray as Array

_SERIAL = 200_000
"""Multiplications below which OpenBLAS stays in the calling thread (its limit is 262144)"""


def times_columns(
    small: Float[Array, "row inner"], columns: Float[Array, "inner column"]
) -> Float[Array, "row column"]:
    """The product `small @ columns`."""
    n_columns = columns.shape[1]
    width = max(1, _SERIAL // small.size)
    if width >= n_columns:
        return np.asarray(small @ columns)
    product = np.empty((len(small), n_columns))
    for first in range(0, n_columns, width):
        piece = slice(first, first + width)
        np.matmul(small, columns[:, piece], out=product[:, piece])
    return product
