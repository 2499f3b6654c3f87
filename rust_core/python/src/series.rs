//! Series from Python: splines through them, filters along them.
use crate::{Matrix, to_py_error};
use numpy::{PyArray1, PyReadonlyArray1, PyReadwriteArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use railui_core::error::expect_len;
use railui_core::numeric::biquad::pass;
use railui_core::numeric::spline;

/// A not-a-knot cubic spline through y [sample, column] at the places x.
#[pyclass(frozen)]
pub struct Spline(spline::Spline);

#[pymethods]
impl Spline {
    #[new]
    fn new(py: Python<'_>, x: PyReadonlyArray1<'_, f64>, y: Matrix<'_>) -> PyResult<Self> {
        let (x, columns, y) = (x.as_slice()?, y.shape()[1], y.as_slice()?);
        Ok(Spline(py.detach(|| spline::Spline::new(x, y, columns)).map_err(to_py_error)?))
    }

    /// Values, first or second derivatives, place after place.
    fn at<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray1<'py, f64>,
        derivative: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let places = places.as_slice()?;
        Ok(PyArray1::from_vec(py, py.detach(|| self.0.at(places, derivative))))
    }

    /// Add values, and slopes where they have a column, along the places of a table's first column, so far behind.
    fn add_behind(
        &self,
        py: Python<'_>,
        mut table: PyReadwriteArray2<'_, f64>,
        behind: f64,
        into: Vec<(usize, Option<usize>)>,
    ) -> PyResult<()> {
        let width = table.shape()[1];
        let largest = into.iter().flat_map(|(value, slope)| [Some(*value), *slope]).flatten().max();
        expect_len("columns that the splines need", width, width.max(largest.map_or(1, |i| i + 1)))
            .map_err(to_py_error)?;
        let rows = table.as_slice_mut()?;
        py.detach(|| self.0.add_behind(rows, width, behind, &into));
        Ok(())
    }

    /// Factors of the powers, highest first, column after column of interval after interval.
    fn factors<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_slice(py, self.0.factors().as_flattened())
    }
}

/// Series [series, sample] behind sections [section, 6], which begin with memory [series, section x 2], one after the
/// other.
#[pyfunction]
pub fn passed<'py>(
    py: Python<'py>,
    sections: Matrix<'py>,
    memory: Matrix<'py>,
    series: Matrix<'py>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let (sections, samples) = (sections.as_slice()?.as_chunks().0, series.shape()[1]);
    expect_len("memory of sections", memory.len(), 2 * sections.len() * series.shape()[0]).map_err(to_py_error)?;
    let (mut memory, mut found) = (memory.as_slice()?.to_vec(), series.as_slice()?.to_vec());
    py.detach(|| {
        for (memory, x) in memory.chunks_mut(2 * sections.len().max(1)).zip(found.chunks_mut(samples.max(1))) {
            pass(sections, memory.as_chunks_mut().0, x);
        }
    });
    Ok(PyArray1::from_vec(py, found))
}
