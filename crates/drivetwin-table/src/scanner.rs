// SPDX-License-Identifier: MIT
//! Rows of a table from blocks of bytes.

use crate::column::{Column, Text};
use crate::line::{Fields, Separator, trim};
use crate::number::DecimalSign;

/// Lines that are no rows, of which the text is kept.
const MOST_REMARKS: usize = 1000;

/// Layout of a table.
#[derive(Clone, Debug)]
pub struct Layout {
    /// Separator of the fields.
    pub separator: Separator,
    /// Number of columns.
    pub width: usize,
    /// Fewest fields of a row: the last columns may be left out.
    pub least: usize,
    /// Index of the first time column.
    pub time: usize,
    /// Time is written as a text with digits, such as a clock time.
    pub time_is_text: bool,
    /// Lines of the head, left out.
    pub skip: usize,
    /// First fields of the lines of the head: a line that starts with one is no row.
    pub labels: Vec<Vec<u8>>,
}

/// How the numbers of one column, or of all, are written.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Decimals {
    /// The first number with a decimal point.
    pub point: Option<Vec<u8>>,
    /// The first number with a decimal comma.
    pub comma: Option<Vec<u8>>,
    /// The first number without either.
    pub whole: Option<Vec<u8>>,
    /// A comma that cannot stand between thousands.
    pub has_decimal_comma: bool,
}

/// Rows of a table.
#[derive(Debug, Default)]
pub struct Table {
    /// Number of rows.
    pub rows: usize,
    /// Number of the last line that is no comment.
    pub last_line: usize,
    /// All columns; those that were asked for keep their cells.
    pub columns: Vec<Column>,
    /// Cells of the columns of texts, one after the other, and where each ends.
    pub texts: Vec<(Vec<u8>, Vec<u64>)>,
    /// How the numbers of each column of the table are written.
    pub decimals: Vec<Decimals>,
    /// Rows that do not stand on the line after the row before: row and line, from the first.
    pub lines: Vec<(usize, usize)>,
    /// Lines between the rows that are none.
    pub remarks: Vec<Text>,
    /// Number of such lines.
    pub remark_count: usize,
    /// First line with too few or too many fields, and their number.
    pub ragged: Option<(usize, usize)>,
    /// Number of such lines.
    pub ragged_count: usize,
    /// Line with a quoted field that does not end, and the reason.
    pub quote: Option<(usize, &'static str)>,
    /// Position of a byte that is no text.
    pub binary: Option<usize>,
}

/// Reader of a table in blocks.
pub struct Scanner {
    layout: Layout,
    texts: Vec<usize>,
    pending: Vec<u8>,
    position: usize,
    line: usize,
    fields: Fields,
    table: Table,
}

impl Scanner {
    /// Read the columns `numbers` as numbers and `texts` as texts; `rows` are expected.
    pub fn new(layout: Layout, numbers: &[usize], texts: &[usize], rows: usize) -> Self {
        let make = |index| {
            if numbers.contains(&index) { Column::keep(rows) } else { Column::default() }
        };
        let table = Table {
            columns: (0..layout.width).map(make).collect(),
            texts: vec![(Vec::new(), Vec::new()); texts.len()],
            decimals: vec![Decimals::default(); layout.width],
            ..Table::default()
        };
        Self {
            texts: texts.to_vec(),
            pending: Vec::new(),
            position: 0,
            line: 0,
            fields: Fields::default(),
            layout,
            table,
        }
    }

    /// Read the next bytes of the file.
    pub fn feed(&mut self, block: &[u8]) {
        if self.table.binary.is_none() {
            self.table.binary = find_binary(block).map(|at| self.position + at);
        }
        self.position += block.len();
        let mut text = std::mem::take(&mut self.pending);
        text.extend_from_slice(block);
        let mut start = 0;
        while let Some((end, next)) = find_line_end(&text, start) {
            self.take_line(&text[start..end]);
            start = next;
        }
        text.drain(..start);
        self.pending = text;
    }

    /// Read the last line and return the table.
    pub fn finish(mut self) -> Table {
        let last = std::mem::take(&mut self.pending);
        let end = last.len() - usize::from(last.ends_with(b"\r"));
        if end > 0 {
            self.take_line(&last[..end]);
        }
        self.table
    }

    fn take_line(&mut self, line: &[u8]) {
        self.line += 1;
        let start = trim(line);
        let is_comment =
            start.is_empty() || start[0] == b'#' || start[0] == b'%' || start.starts_with(b"//");
        if self.line <= self.layout.skip || is_comment {
            return;
        }
        self.table.last_line = self.line;
        if let Err(reason) = self.fields.split(line, self.layout.separator) {
            if is_text(start) {
                self.add_remark(line);
            } else {
                self.table.quote.get_or_insert((self.line, reason));
            }
            return;
        }
        let has_numbers = self.fields.numbers().iter().take(self.layout.width).any(Option::is_some);
        let mut surplus = self.layout.width..self.fields.len();
        let fits = self.fields.len() >= self.layout.least
            && surplus.all(|index| self.fields.get(line, index).is_empty());
        if !has_numbers && self.fields.iter(line).all(<[u8]>::is_empty) {
            return;
        }
        if self.is_remark(line, fits, has_numbers) {
            self.add_remark(line);
        } else if fits {
            self.push_row(line);
        } else {
            self.table.ragged.get_or_insert((self.line, self.fields.len()));
            self.table.ragged_count += 1;
        }
    }

    /// Return true for a line of words, or of the head, between the rows.
    fn is_remark(&self, line: &[u8], fits: bool, has_numbers: bool) -> bool {
        if self.layout.labels.iter().any(|one| one == self.fields.get(line, 0)) {
            return true;
        }
        let has_time = self.fields.len() > self.layout.time;
        let stamp = self.fields.get(line, if has_time { self.layout.time } else { 0 });
        if fits {
            let is_stamp = self.layout.time_is_text && stamp.iter().any(u8::is_ascii_digit);
            !has_numbers && !is_stamp
        } else {
            !has_numbers || is_text(stamp)
        }
    }

    fn add_remark(&mut self, line: &[u8]) {
        self.table.remark_count += 1;
        if self.table.remarks.len() < MOST_REMARKS {
            self.table.remarks.push(Text { text: line.to_vec(), line: self.line });
        }
    }

    fn push_row(&mut self, line: &[u8]) {
        let table = &mut self.table;
        let follows = table.lines.last().map(|(row, line)| line + table.rows - row);
        if follows != Some(self.line) {
            table.lines.push((table.rows, self.line));
        }
        table.rows += 1;
        for (index, column) in table.columns.iter_mut().enumerate() {
            match self.fields.numbers().get(index).copied().flatten() {
                Some(number) => {
                    column.push_number(number.value);
                    let decimals = &mut table.decimals[index];
                    if !decimals.has_example(number.sign) {
                        decimals.add(number.sign, self.fields.get(line, index));
                    }
                }
                None => column.push_text(self.fields.get(line, index), self.line),
            }
        }
        for ((text, ends), &index) in table.texts.iter_mut().zip(&self.texts) {
            text.extend_from_slice(self.fields.get(line, index));
            ends.push(text.len() as u64);
        }
    }
}

impl Decimals {
    /// Return true if no further number with this sign adds anything.
    fn has_example(&self, sign: DecimalSign) -> bool {
        match sign {
            DecimalSign::None => self.whole.is_some(),
            DecimalSign::Point => self.point.is_some(),
            DecimalSign::Comma => self.has_decimal_comma && self.comma.is_some(),
        }
    }

    fn add(&mut self, sign: DecimalSign, cell: &[u8]) {
        let first = match sign {
            DecimalSign::None => &mut self.whole,
            DecimalSign::Point => &mut self.point,
            DecimalSign::Comma => {
                self.has_decimal_comma |= !may_group_thousands(cell);
                &mut self.comma
            }
        };
        if first.is_none() {
            *first = Some(cell.to_vec());
        }
    }
}

/// Place of the first byte that is no text.
fn find_binary(block: &[u8]) -> Option<usize> {
    let is_binary = |byte: &u8| matches!(byte, 0..=8 | 0x0e..=0x1f);
    let size = 4096; // without an early end the inner loop runs in vectors
    let has_any = |part: &[u8]| part.iter().fold(false, |any, byte| any | is_binary(byte));
    let number = block.chunks(size).position(has_any)?;
    let start = number * size;
    block[start..].iter().position(is_binary).map(|at| start + at)
}

/// Return true for `1,234`, which may be a whole number from a thousand to a million.
fn may_group_thousands(cell: &[u8]) -> bool {
    let cell = cell.strip_prefix(b"-").or(cell.strip_prefix(b"+")).unwrap_or(cell);
    let Some(comma) = cell.iter().position(|byte| *byte == b',') else {
        return false;
    };
    let (whole, rest) = (&cell[..comma], &cell[comma + 1..]);
    matches!(whole.len(), 1..=3)
        && whole[0] != b'0'
        && rest.len() == 3
        && whole.iter().chain(rest).all(u8::is_ascii_digit)
}

/// Return true for a text that starts as no number does.
fn is_text(cell: &[u8]) -> bool {
    cell.first().is_some_and(|byte| !byte.is_ascii_digit() && !b"+-.,;\"".contains(byte))
}

/// End of the line from `start` and start of the next one; `None` if the text may go on.
fn find_line_end(text: &[u8], start: usize) -> Option<(usize, usize)> {
    let at = start + find_break(&text[start..])?;
    match (text[at], text.get(at + 1)) {
        (b'\r', None) => None,
        (b'\r', Some(b'\n')) => Some((at, at + 2)),
        _ => Some((at, at + 1)),
    }
}

/// Place of the first line feed or carriage return, eight bytes at a time.
fn find_break(text: &[u8]) -> Option<usize> {
    const ONES: u64 = u64::MAX / 255;
    // Bit 7 of the lowest byte that equals `byte`, and of none below it.
    let find = |word: u64, byte: u8| {
        let differs = word ^ (ONES * u64::from(byte));
        differs.wrapping_sub(ONES) & !differs & (ONES << 7)
    };
    let mut words = text.chunks_exact(8);
    let full = text.len() - text.len() % 8;
    for (number, chunk) in words.by_ref().enumerate() {
        let word = u64::from_le_bytes(chunk.try_into().expect("eight bytes"));
        let found = find(word, b'\n') | find(word, b'\r');
        if found != 0 {
            return Some(8 * number + found.trailing_zeros() as usize / 8);
        }
    }
    let rest = words.remainder().iter().position(|byte| matches!(byte, b'\n' | b'\r'))?;
    Some(full + rest)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn layout(width: usize) -> Layout {
        Layout {
            separator: Separator::Byte(b','),
            width,
            least: width,
            time: 0,
            time_is_text: false,
            skip: 1,
            labels: vec![b"t".to_vec()],
        }
    }

    fn scan(text: &str, block: usize) -> Table {
        let mut scanner = Scanner::new(layout(2), &[0, 1], &[1], 0);
        text.as_bytes().chunks(block).for_each(|part| scanner.feed(part));
        scanner.finish()
    }

    #[test]
    fn blocks_of_any_size_give_the_same_rows() {
        for end in ["\n", "\r\n", "\r"] {
            let text = "t,a\n0,1.5\n# x\n\n1,-\nMARK 1, by hand\n2,3\nt,a\n3,4".replace('\n', end);
            for block in 1..9 {
                let table = scan(&text, block);
                assert_eq!(table.rows, 4);
                assert_eq!(table.columns[0].values, [0.0, 1.0, 2.0, 3.0]);
                assert_eq!(table.columns[1].kinds, [0, 2, 0, 0]);
                assert_eq!(table.lines, [(0, 2), (1, 5), (2, 7), (3, 9)]);
                assert_eq!(table.remark_count, 2);
                assert_eq!(table.texts[0], (b"1.5-34".to_vec(), vec![3, 4, 5, 6]));
                assert_eq!(table.last_line, 9);
            }
        }
    }

    #[test]
    fn damage_has_a_place() {
        let table = scan("t,a\n0,1\n1\n2,3,4\n3,\"4\n5,\x01\n", 100);
        assert_eq!((table.ragged, table.ragged_count), (Some((3, 1)), 2));
        assert_eq!(table.quote.map(|one| one.0), Some(5));
        assert_eq!(table.binary, Some(23));
    }

    #[test]
    fn thousands_are_told_from_decimals() {
        assert!(may_group_thousands(b"-121,500"));
        for cell in ["0,990", "1,5", "1,0021", "1001,002", ",500", "1,001e3"] {
            assert!(!may_group_thousands(cell.as_bytes()), "{cell}");
        }
    }
}
