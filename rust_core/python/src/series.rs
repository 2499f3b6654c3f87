//! Series from Python: splines through them, filters along them.
use crate::{Matrix, to_py_error};
use numpy::{PyArray1, PyReadonlyArray1, PyUntypedArrayMethods};
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
    fn new(x: PyReadonlyArray1<'_, f64>, y: Matrix<'_>) -> PyResult<Self> {
        Ok(Spline(spline::Spline::new(x.as_slice()?, y.as_slice()?, y.shape()[1]).map_err(to_py_error)?))
    }

    /// Values, first or second derivatives, place after place.
    fn at<'py>(
        &self,
        py: Python<'py>,
        places: PyReadonlyArray1<'py, f64>,
        derivative: usize,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        Ok(PyArray1::from_vec(py, self.0.at(places.as_slice()?, derivative)))
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
    for (memory, x) in memory.chunks_mut(2 * sections.len().max(1)).zip(found.chunks_mut(samples.max(1))) {
        pass(sections, memory.as_chunks_mut().0, x);
    }
    Ok(PyArray1::from_vec(py, found))
}
