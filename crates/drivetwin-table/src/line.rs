// SPDX-License-Identifier: MIT
//! Fields of one line.

use std::ops::Range;

/// What stands between the fields of a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Separator {
    /// One byte; fields may be quoted.
    Byte(u8),
    /// Any number of blanks or tabs.
    Blanks,
}

/// Fields of a line as ranges of `text`, without the quotes.
#[derive(Default)]
pub struct Fields {
    text: Vec<u8>,
    ranges: Vec<Range<usize>>,
}

impl Fields {
    /// Split a line; an error describes a quoted field that does not end where it should.
    pub fn split(&mut self, line: &[u8], separator: Separator) -> Result<(), &'static str> {
        self.text.clear();
        self.ranges.clear();
        match separator {
            Separator::Blanks => {
                self.text.extend_from_slice(line);
                self.split_at_blanks();
            }
            Separator::Byte(byte) if line.contains(&b'"') => self.split_quoted(line, byte)?,
            Separator::Byte(byte) => {
                self.text.extend_from_slice(line);
                let mut start = 0;
                for (at, &one) in line.iter().enumerate() {
                    if one == byte {
                        self.ranges.push(start..at);
                        start = at + 1;
                    }
                }
                self.ranges.push(start..line.len());
            }
        }
        Ok(())
    }

    fn split_at_blanks(&mut self) {
        let mut start = None;
        for (at, byte) in self.text.iter().enumerate() {
            match (start, is_blank(*byte)) {
                (None, false) => start = Some(at),
                (Some(first), true) => {
                    self.ranges.push(first..at);
                    start = None;
                }
                _ => {}
            }
        }
        self.ranges.extend(start.map(|first| first..self.text.len()));
    }

    fn split_quoted(&mut self, line: &[u8], separator: u8) -> Result<(), &'static str> {
        let mut rest = line;
        loop {
            let blanks = rest.iter().take_while(|byte| **byte == b' ').count();
            rest = &rest[blanks..];
            let start = self.text.len();
            if rest.first() == Some(&b'"') {
                rest = self.copy_quoted(&rest[1..])?;
                if !rest.is_empty() && rest[0] != separator {
                    return Err("text follows the closing quote");
                }
            } else {
                let end = rest.iter().position(|byte| *byte == separator).unwrap_or(rest.len());
                self.text.extend_from_slice(&rest[..end]);
                rest = &rest[end..];
            }
            self.ranges.push(start..self.text.len());
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
            self.text.extend_from_slice(&rest[..end]);
            rest = &rest[end + 1..];
            if rest.first() != Some(&b'"') {
                return Ok(rest);
            }
            self.text.push(b'"');
            rest = &rest[1..];
        }
    }

    /// Number of fields.
    pub fn len(&self) -> usize {
        self.ranges.len()
    }

    /// The field at `index` without blanks around it; empty beyond the last.
    pub fn get(&self, index: usize) -> &[u8] {
        self.ranges.get(index).map_or(&[], |range| trim(&self.text[range.clone()]))
    }

    /// All fields without blanks around them.
    pub fn iter(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.len()).map(|index| self.get(index))
    }
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
        Ok(fields.iter().map(|field| String::from_utf8_lossy(field).into_owned()).collect())
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
