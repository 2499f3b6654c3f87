"""Numerical routines of the kernel: spline, filter cascade, eigenvalues."""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from railui import _core
from railui.arrays import ComplexArray, FloatArray
from railui.core.alignment import kernel_array


class Spline:
    """Cubic spline, not-a-knot, through y [n] or [n, column] at increasing x [n], n >= 4.

    Equal to scipy's CubicSpline, whose import takes 0.25 s. The first and the last cubic continue beyond the ends.

    Raises
    ------
    ValueError
        If x does not increase, or y has another length.

    Examples
    --------
    >>> Spline(np.arange(5.0), np.arange(5.0) ** 3)(np.array([1.5, 6.0]), derivative=1).round(9).tolist()
    [6.75, 108.0]
    """

    def __init__(self, x: ArrayLike, y: ArrayLike) -> None:
        self.x = kernel_array(x)
        columns = np.asarray(y, dtype=float)
        self.shape = columns.shape[1:]
        self._core = _core.Spline(self.x, kernel_array(columns.reshape(len(columns), -1)))

    def __call__(self, at: ArrayLike, derivative: Literal[0, 1, 2] = 0) -> FloatArray:
        """Return values, first or second derivatives at points [...]: [...] or [..., column]."""
        points = np.asarray(at, dtype=float)
        return self._core.at(kernel_array(points.ravel()), derivative).reshape(points.shape + self.shape)

    def add_behind(self, table: FloatArray, behind: float, into: Sequence[tuple[int, int | None]]) -> None:
        """Add the columns of y to those of a table [row, column], in place, along the points in its first column.

        Parameters
        ----------
        behind
            Distance of the point of a row behind its first column. What is behind has the first value and no slope
            before it comes to the first point.
        into
            Column of the table for the values of each column of y, and for its first derivatives; None: not added.

        Raises
        ------
        ValueError
            If the table lacks a column.

        Examples
        --------
        >>> table = np.array([[0.0, 10.0, 0.0], [2.0, 10.0, 0.0]])
        >>> Spline(np.arange(4.0), 3.0 * np.arange(4.0)).add_behind(table, 1.0, [(1, 2)])
        >>> table.tolist()
        [[0.0, 10.0, 0.0], [2.0, 13.0, 3.0]]
        """
        readable = kernel_array(table)
        self._core.add_behind(readable, behind, list(into))
        if readable is not table:
            table[...] = readable

    @property
    def coefficients(self) -> FloatArray:
        """Coefficients [column, power, interval] of the distance from an interval's start, highest power first."""
        flat = self._core.factors().reshape(len(self.x) - 1, -1, 4)
        return np.ascontiguousarray(flat.transpose(1, 2, 0))


def sosfilt(sos: FloatArray, series: FloatArray, zi: FloatArray | None = None) -> FloatArray:
    """Filter series [..., sample] by second-order sections [section, 6] (b0 b1 b2 1 a1 a2).

    zi [..., section, 2]: initial state of the transposed form II; zero by default.

    >>> sosfilt(np.array([[1.0, 0.0, 0.0, 1.0, -0.5, 0.0]]), np.array([1.0, 0.0, 0.0])).tolist()
    [1.0, 0.5, 0.25]
    """
    rows = kernel_array(series).reshape(-1, series.shape[-1])
    state = np.zeros((len(rows), 2 * len(sos))) if zi is None else zi.reshape(len(rows), -1)
    return _core.passed(kernel_array(sos), kernel_array(state), rows).reshape(series.shape)


def matrix_eigenvalues(matrices: FloatArray) -> ComplexArray:
    """Return the eigenvalues [n, state] of matrices [n, state, state], largest real part first.

    NaN for a matrix that is not finite or whose iteration does not converge.

    >>> matrix_eigenvalues(np.array([[[-3.0, 1.0], [0.0, -2.0]], [[np.inf, 0.0], [0.0, 1.0]]])).real.tolist()
    [[-2.0, -3.0], [nan, nan]]
    """
    values = np.full(matrices.shape[:2], complex(np.nan, np.nan))
    for i in np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2))):
        with contextlib.suppress(np.linalg.LinAlgError):
            values[i] = np.linalg.eigvals(matrices[i])
    order = np.lexsort((-values.imag, -values.real), axis=1)
    return np.asarray(np.take_along_axis(values, order, axis=1))
