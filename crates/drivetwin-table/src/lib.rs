// SPDX-License-Identifier: MIT
//! Rows of a text table to columns of numbers, in one pass over blocks of bytes.
//!
//! The caller knows the layout: separator, width and place of the time column. Cells that hold no
//! number are counted by their text, so that the caller decides what each text means.

mod column;
mod line;
mod number;
mod scanner;

pub use column::{Column, Kind, Text};
pub use line::Separator;
pub use number::{DecimalSign, Number, parse_number};
pub use scanner::{Decimals, Layout, Scanner, Table};
