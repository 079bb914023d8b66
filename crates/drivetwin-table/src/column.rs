// SPDX-License-Identifier: MIT
//! Cells of one column.

/// Content of a cell: a number, nothing, or the text at an index.
pub type Kind = u8;

/// A number.
pub const NUMBER: Kind = 0;
/// Nothing.
pub const BLANK: Kind = 1;
/// The first of the texts.
pub const FIRST_TEXT: Kind = 2;
/// Any text of a column with more texts than are kept.
pub const OTHER_TEXT: Kind = u8::MAX;

/// A text that is no number, and the line of the file where it stands first.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Text {
    /// The cell without blanks around it.
    pub text: Vec<u8>,
    /// Line of the file, from 1.
    pub line: usize,
}

/// Cells of one column as numbers.
#[derive(Clone, Debug, Default)]
pub struct Column {
    /// Number of cells that hold a number.
    pub count: usize,
    /// One value a row, NaN where the cell holds no number; empty if not kept.
    pub values: Vec<f64>,
    /// One kind a row; empty if not kept or where all cells are numbers.
    pub kinds: Vec<Kind>,
    /// The different texts in the order of their first lines.
    pub texts: Vec<Text>,
    is_kept: bool,
}

impl Column {
    /// An empty column that keeps its cells, with room for `rows`.
    pub fn keep(rows: usize) -> Self {
        Self { values: Vec::with_capacity(rows), is_kept: true, ..Self::default() }
    }

    /// Append a number.
    pub fn push_number(&mut self, value: f64) {
        self.count += 1;
        if self.is_kept {
            self.values.push(value);
            if !self.kinds.is_empty() {
                self.kinds.push(NUMBER);
            }
        }
    }

    /// Append a cell that is blank or holds a text.
    pub fn push_text(&mut self, cell: &[u8], line: usize) {
        let kind = if cell.is_empty() { BLANK } else { self.find_kind(cell, line) };
        if self.is_kept {
            self.kinds.resize(self.values.len(), NUMBER);
            self.kinds.push(kind);
            self.values.push(f64::NAN);
        }
    }

    fn find_kind(&mut self, cell: &[u8], line: usize) -> Kind {
        if self.texts.len() == usize::from(OTHER_TEXT - FIRST_TEXT) {
            return OTHER_TEXT;
        }
        let index = self.texts.iter().position(|one| one.text == cell).unwrap_or_else(|| {
            self.texts.push(Text { text: cell.to_vec(), line });
            self.texts.len() - 1
        });
        FIRST_TEXT + Kind::try_from(index).unwrap_or(OTHER_TEXT - FIRST_TEXT)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_counted_once() {
        let mut column = Column::keep(4);
        column.push_number(1.0);
        column.push_text(b"-", 2);
        column.push_text(b"", 3);
        column.push_text(b"-", 4);
        column.push_number(2.0);
        assert_eq!(column.kinds, [NUMBER, FIRST_TEXT, BLANK, FIRST_TEXT, NUMBER]);
        assert_eq!(column.texts, [Text { text: b"-".to_vec(), line: 2 }]);
    }

    #[test]
    fn a_column_of_texts_does_not_grow_without_end() {
        let mut column = Column::keep(0);
        for line in 0..1000 {
            column.push_text(format!("text {line}").as_bytes(), line);
        }
        assert_eq!(column.texts.len(), 253);
        assert_eq!(column.kinds[999], OTHER_TEXT);
    }
}
