// SPDX-License-Identifier: MIT
//! Text tables: blocks of bytes in, columns out.

use drivetwin_table::{Decimals, Layout, Scanner, Separator, Table, Text};
use numpy::{IntoPyArray, PyArray1};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use std::borrow::Cow;
use std::mem::take;

/// Values and kinds: 0 number, 1 blank, from 2 on the texts.
type Column<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray1<u8>>);
/// Text and the line where it stands first.
type Place = (Cow<'static, [u8]>, usize);
/// Examples of a number with point, with comma, without; and whether a comma is a decimal one.
type Written =
    (Option<Cow<'static, [u8]>>, Option<Cow<'static, [u8]>>, Option<Cow<'static, [u8]>>, bool);

/// Reader of a table in blocks; see `drivetwin.logs.formats.table_scan`.
#[pyclass]
pub struct TableScanner {
    scanner: Option<Scanner>,
}

#[pymethods]
impl TableScanner {
    #[new]
    #[pyo3(signature = (*, separator, width, least, time, time_is_text, skip, labels, numbers, texts,
        rows))]
    #[expect(clippy::too_many_arguments, reason = "named fields of the layout")]
    fn new(
        separator: Option<u8>,
        width: usize,
        least: usize,
        time: usize,
        time_is_text: bool,
        skip: usize,
        labels: Vec<Vec<u8>>,
        numbers: Vec<usize>,
        texts: Vec<usize>,
        rows: usize,
    ) -> PyResult<Self> {
        if numbers.iter().chain(&texts).any(|column| *column >= width) {
            return Err(PyValueError::new_err("no such column"));
        }
        let separator = separator.map_or(Separator::Blanks, Separator::Byte);
        let layout = Layout { separator, width, least, time, time_is_text, skip, labels };
        Ok(Self { scanner: Some(Scanner::new(layout, &numbers, &texts, rows)) })
    }

    /// Read the next bytes of the file.
    fn feed(&mut self, py: Python<'_>, block: &[u8]) -> PyResult<()> {
        let scanner = self.scanner.as_mut().ok_or_else(ended)?;
        py.detach(|| scanner.feed(block));
        Ok(())
    }

    /// Read the last line and return the table.
    fn finish(&mut self) -> PyResult<ScannedTable> {
        Ok(ScannedTable { table: self.scanner.take().ok_or_else(ended)?.finish() })
    }
}

/// Rows of a table.
#[pyclass]
pub struct ScannedTable {
    table: Table,
}

#[pymethods]
impl ScannedTable {
    #[getter]
    fn rows(&self) -> usize {
        self.table.rows
    }

    #[getter]
    fn last_line(&self) -> usize {
        self.table.last_line
    }

    #[getter]
    fn lines(&self) -> Vec<(usize, usize)> {
        self.table.lines.clone()
    }

    #[getter]
    fn remarks(&self) -> Vec<Place> {
        self.table.remarks.iter().map(place).collect()
    }

    #[getter]
    fn remark_count(&self) -> usize {
        self.table.remark_count
    }

    #[getter]
    fn ragged(&self) -> Option<(usize, usize)> {
        self.table.ragged
    }

    #[getter]
    fn ragged_count(&self) -> usize {
        self.table.ragged_count
    }

    #[getter]
    fn quote(&self) -> Option<(usize, &'static str)> {
        self.table.quote
    }

    #[getter]
    fn binary(&self) -> Option<usize> {
        self.table.binary
    }

    #[getter]
    fn decimals(&self) -> Vec<Written> {
        self.table.decimals.iter().map(written).collect()
    }

    /// Number of numbers, and the different texts with their first lines, of each column.
    #[getter]
    fn contents(&self) -> Vec<(usize, Vec<Place>)> {
        let columns = self.table.columns.iter();
        columns.map(|one| (one.count, one.texts.iter().map(place).collect())).collect()
    }

    /// Hand over a column of numbers; it is empty from then on.
    fn take_numbers<'py>(&mut self, py: Python<'py>, index: usize) -> Column<'py> {
        let column = &mut self.table.columns[index];
        let (mut values, kinds) = (take(&mut column.values), take(&mut column.kinds));
        values.shrink_to_fit();
        (values.into_pyarray(py), kinds.into_pyarray(py))
    }

    /// Hand over a column of texts and where each ends; it is empty from then on.
    fn take_texts<'py>(
        &mut self,
        py: Python<'py>,
        index: usize,
    ) -> (Cow<'static, [u8]>, Bound<'py, PyArray1<u64>>) {
        let (text, ends) = take(&mut self.table.texts[index]);
        (Cow::Owned(text), ends.into_pyarray(py))
    }
}

fn ended() -> PyErr {
    PyValueError::new_err("the table is complete")
}

fn place(text: &Text) -> Place {
    (Cow::Owned(text.text.clone()), text.line)
}

fn written(one: &Decimals) -> Written {
    let own = |text: &Option<Vec<u8>>| text.clone().map(Cow::Owned);
    (own(&one.point), own(&one.comma), own(&one.whole), one.has_decimal_comma)
}
