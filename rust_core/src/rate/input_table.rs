//! The way of a run: the rows of its input table, their number and their time.
use crate::error::{Error, Result, expect_len};
use crate::vehicle::plain_bogie::{BOGIE_COLUMNS, CROSS_LEVEL};

/// One row per half step, so that RK4 finds t, t + h/2 and t + h; see `input_table` of the track.
#[derive(Clone, Copy, Debug)]
pub struct InputTable<'a> {
    pub table: &'a [f64],
    pub columns: usize,
    /// RK4 steps per sample.
    pub steps: usize,
    /// Time between samples [s] at speed scale 1.
    pub dt: f64,
    /// Is the track known to have no cross-level?
    pub level: bool,
}

impl<'a> InputTable<'a> {
    /// Wrap a table; that of a bogie is searched for cross-level, which other vehicles do not need to know.
    pub fn new(table: &'a [f64], columns: usize, steps: usize, dt: f64) -> Self {
        let level = |row: &[f64]| CROSS_LEVEL.iter().all(|i| row[*i] == 0.0);
        let level = columns == BOGIE_COLUMNS && table.chunks_exact(columns).all(level);
        InputTable { table, columns, steps, dt, level }
    }

    pub fn samples(&self) -> usize {
        (self.table.len() / self.columns - 1) / (2 * self.steps) + 1
    }

    pub fn step_count(&self) -> usize {
        (self.samples() - 1) * self.steps
    }

    pub fn check(&self, columns: usize) -> Result<()> {
        expect_len("columns of the input table", self.columns, columns)?;
        let rows = self.table.len() / self.columns.max(1);
        if rows == 0 || self.steps == 0 || !(rows - 1).is_multiple_of(2 * self.steps) {
            let expected = 2 * self.steps * (rows.saturating_sub(1) / (2 * self.steps).max(1)) + 1;
            return Err(Error::Shape { what: "rows of the input table".into(), got: rows, expected });
        }
        Ok(())
    }
}
