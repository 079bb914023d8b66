// SPDX-License-Identifier: MIT
//! Fields of one line.

use crate::number::{Number, parse_number, parse_plain_number};
use std::ops::Range;

/// Separator of the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// One byte; fields may be quoted.
    Byte(u8),
    /// Any number of blanks or tabs.
    Blanks,
}

/// Fields of a line, without the quotes and the blanks around them.
#[derive(Default)]
pub struct Fields {
    /// Text of a line with quotes, without them.
    unquoted: Vec<u8>,
    is_quoted: bool,
    ranges: Vec<Range<usize>>,
    /// Number of each field that is one.
    numbers: Vec<Option<Number>>,
}

impl Fields {
    /// Split a line; an error describes a quoted field that does not end where it should.
    pub fn split(&mut self, line: &[u8], separator: Separator) -> Result<(), &'static str> {
        self.ranges.clear();
        self.numbers.clear();
        self.is_quoted = false;
        match separator {
            Separator::Blanks => self.split_at_blanks(line),
            Separator::Byte(byte) if line.contains(&b'"') => self.split_quoted(line, byte)?,
            Separator::Byte(byte) => {
                self.split_plain(line, byte);
                return Ok(());
            }
        }
        let text = if self.is_quoted { &self.unquoted } else { line };
        self.numbers.extend(self.ranges.iter().map(|range| parse_number(&text[range.clone()])));
        Ok(())
    }

    /// Split a line without quotes and parse its numbers in one pass.
    fn split_plain(&mut self, line: &[u8], separator: u8) {
        let mut start = 0;
        loop {
            let plain = parse_plain_number(line, start, separator);
            let end = plain.map_or_else(|| find_end(line, start, separator), |(_, end)| end);
            let range = if plain.is_some() { start..end } else { trim_range(line, start, end) };
            let number = plain.map(|(number, _)| number);
            self.numbers.push(number.or_else(|| parse_number(&line[range.clone()])));
            self.ranges.push(range);
            if end == line.len() {
                return;
            }
            start = end + 1;
        }
    }

    fn split_at_blanks(&mut self, line: &[u8]) {
        let mut start = None;
        for (at, byte) in line.iter().enumerate() {
            match (start, is_blank(*byte)) {
                (None, false) => start = Some(at),
                (Some(first), true) => {
                    self.ranges.push(first..at);
                    start = None;
                }
                _ => {}
            }
        }
        self.ranges.extend(start.map(|first| first..line.len()));
    }

    fn split_quoted(&mut self, line: &[u8], separator: u8) -> Result<(), &'static str> {
        self.unquoted.clear();
        self.is_quoted = true;
        let mut rest = line;
        loop {
            let blanks = rest.iter().take_while(|byte| **byte == b' ').count();
            rest = &rest[blanks..];
            let start = self.unquoted.len();
            if rest.first() == Some(&b'"') {
                rest = self.copy_quoted(&rest[1..])?;
                if !rest.is_empty() && rest[0] != separator {
                    return Err("text follows the closing quote");
                }
            } else {
                let end = rest.iter().position(|byte| *byte == separator).unwrap_or(rest.len());
                self.unquoted.extend_from_slice(&rest[..end]);
                rest = &rest[end..];
            }
            self.ranges.push(trim_range(&self.unquoted, start, self.unquoted.len()));
            if rest.is_empty() {
                return Ok(());
            }
            rest = &rest[1..];
        }
    }

    /// Copy a field up to its closing quote; return what follows.
    fn copy_quoted<'a>(&mut self, mut rest: &'a [u8]) -> Result<&'a [u8], &'static str> {
        loop {
            let end = rest.iter().position(|byte| *byte == b'"').ok_or("no closing quote")?;
            self.unquoted.extend_from_slice(&rest[..end]);
            rest = &rest[end + 1..];
            if rest.first() != Some(&b'"') {
                return Ok(rest);
            }
            self.unquoted.push(b'"');
            rest = &rest[1..];
        }
    }

    /// Number of fields.
    pub fn len(&self) -> usize {
        self.ranges.len()
    }

    /// Number of each field; `None` for other texts.
    pub fn numbers(&self) -> &[Option<Number>] {
        &self.numbers
    }

    /// The field at `index` of the `line` that was split; empty beyond the last.
    pub fn get<'a>(&'a self, line: &'a [u8], index: usize) -> &'a [u8] {
        let text = if self.is_quoted { &self.unquoted } else { line };
        self.ranges.get(index).map_or(&[], |range| &text[range.clone()])
    }

    /// All fields of the `line` that was split.
    pub fn iter<'a>(&'a self, line: &'a [u8]) -> impl Iterator<Item = &'a [u8]> {
        (0..self.len()).map(move |index| self.get(line, index))
    }
}

/// End of the field from `start` on.
fn find_end(line: &[u8], start: usize, separator: u8) -> usize {
    line[start..].iter().position(|&byte| byte == separator).map_or(line.len(), |at| start + at)
}

fn trim_range(text: &[u8], start: usize, end: usize) -> Range<usize> {
    let field = &text[start..end];
    let is_plain = |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_graphic());
    if is_plain(field.first()) && is_plain(field.last()) {
        return start..end;
    }
    let trimmed = trim(field);
    let first = start + trimmed.as_ptr().addr() - field.as_ptr().addr();
    first..first + trimmed.len()
}

fn is_blank(byte: u8) -> bool {
    matches!(byte, b' ' | b'\t' | 0x0b | 0x0c)
}

/// Remove ASCII blanks and no-break spaces of UTF-8 at both ends.
pub fn trim(mut text: &[u8]) -> &[u8] {
    loop {
        text = match text {
            [first, rest @ ..] if is_blank(*first) => rest,
            [rest @ .., last] if is_blank(*last) => rest,
            [0xc2, 0xa0, rest @ ..] | [rest @ .., 0xc2, 0xa0] => rest,
            _ => return text,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn split(line: &str, separator: Separator) -> Result<Vec<String>, &'static str> {
        let mut fields = Fields::default();
        fields.split(line.as_bytes(), separator)?;
        Ok(fields
            .iter(line.as_bytes())
            .map(|field| String::from_utf8_lossy(field).into_owned())
            .collect())
    }

    #[test]
    fn fields_lie_between_separators() {
        let comma = Separator::Byte(b',');
        assert_eq!(split("1, 2 ,,", comma).unwrap(), ["1", "2", "", ""]);
        assert_eq!(split("\"a,b\", \"c\"\"d\",e", comma).unwrap(), ["a,b", "c\"d", "e"]);
        assert_eq!(split("  1 \t2  ", Separator::Blanks).unwrap(), ["1", "2"]);
        assert_eq!(split("\"1\",", comma).unwrap(), ["1", ""]);
    }

    #[test]
    fn quotes_must_close_before_a_separator() {
        let comma = Separator::Byte(b',');
        assert!(split("1,\"2", comma).is_err());
        assert!(split("\"1\"2,3", comma).is_err());
        assert_eq!(split("5\" pipe,2", comma).unwrap(), ["5\" pipe", "2"]);
    }
}
