// SPDX-License-Identifier: MIT
//! Numbers with a decimal point or comma, rounded correctly.

/// Sign between the whole and the fraction of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DecimalSign {
    /// A whole number.
    None,
    /// `1.5`.
    Point,
    /// `1,5`.
    Comma,
}

/// A number as written in a cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// The nearest `f64`.
    pub value: f64,
    /// How its fraction is written.
    pub sign: DecimalSign,
}

const EXACT_POWERS: [f64; 23] = [
    1e0, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e7, 1e8, 1e9, 1e10, 1e11, 1e12, 1e13, 1e14, 1e15, 1e16,
    1e17, 1e18, 1e19, 1e20, 1e21, 1e22,
];
/// Digits that a `u64` holds in any case.
const MAX_DIGITS: u32 = 19;

/// Parse `[+-]` digits with a decimal point or comma and an exponent; `None` for any other text.
pub fn parse_number(cell: &[u8]) -> Option<Number> {
    let negative = cell.first() == Some(&b'-');
    let unsigned = &cell[usize::from(negative || cell.first() == Some(&b'+'))..];
    let mut sign = DecimalSign::None;
    let (mut mantissa, mut digits, mut significant, mut exponent) = (0_u64, 0_u32, 0_u32, 0_i32);
    let mut at = 0;
    while at < unsigned.len() {
        let byte = unsigned[at];
        if byte.is_ascii_digit() {
            digits += 1;
            significant += u32::from(mantissa > 0 || byte > b'0');
            if significant <= MAX_DIGITS {
                mantissa = 10 * mantissa + u64::from(byte - b'0');
                exponent -= i32::from(sign != DecimalSign::None);
            }
        } else if (byte == b'.' || byte == b',') && sign == DecimalSign::None {
            sign = if byte == b'.' { DecimalSign::Point } else { DecimalSign::Comma };
        } else {
            break;
        }
        at += 1;
    }
    if digits == 0 {
        return None;
    }
    let stated = parse_exponent(&unsigned[at..])?;
    exponent = exponent.saturating_add(stated);
    let is_exact = significant <= MAX_DIGITS && mantissa <= 1 << 53 && exponent.abs() <= 22;
    let size = if is_exact {
        let power = EXACT_POWERS[exponent.unsigned_abs() as usize];
        if exponent < 0 { mantissa as f64 / power } else { mantissa as f64 * power }
    } else {
        parse_slowly(unsigned)?
    };
    Some(Number { value: if negative { -size } else { size }, sign })
}

/// Parse digits with a decimal point or comma from `start` on, up to the `separator` or the end of a line, and
/// return the number and its end; `None` for all other cells.
pub fn parse_plain_number(line: &[u8], start: usize, separator: u8) -> Option<(Number, usize)> {
    let mut at = start + usize::from(line.get(start) == Some(&b'-'));
    let (first, mut fraction) = (at, None);
    let mut mantissa = 0_u64;
    while let Some(&byte) = line.get(at) {
        if byte.is_ascii_digit() {
            mantissa = mantissa.wrapping_mul(10).wrapping_add(u64::from(byte - b'0'));
        } else if byte == separator {
            break;
        } else if matches!(byte, b'.' | b',') && fraction.is_none() {
            fraction = Some((at, byte));
        } else {
            return None;
        }
        at += 1;
    }
    let signs = usize::from(fraction.is_some());
    // So many digits are below 2^53.
    if !(1..=15).contains(&(at - first - signs)) {
        return None;
    }
    let decimals = fraction.map_or(0, |(place, _)| at - place - 1);
    let size = mantissa as f64 / EXACT_POWERS[decimals];
    let sign = match fraction {
        None => DecimalSign::None,
        Some((_, b'.')) => DecimalSign::Point,
        Some(_) => DecimalSign::Comma,
    };
    Some((Number { value: if first > start { -size } else { size }, sign }, at))
}

/// Return the exponent after the digits, zero without one; `None` for any other text.
fn parse_exponent(rest: &[u8]) -> Option<i32> {
    let Some((first, power)) = rest.split_first() else {
        return Some(0);
    };
    let signed = matches!(power.first(), Some(b'+' | b'-'));
    let digits = &power[usize::from(signed)..];
    if !matches!(first, b'e' | b'E') || digits.is_empty() || !digits.iter().all(u8::is_ascii_digit)
    {
        return None;
    }
    let size = digits
        .iter()
        .fold(0_i32, |sum, digit| sum.saturating_mul(10).saturating_add(i32::from(digit - b'0')));
    Some(if power[0] == b'-' { -size } else { size })
}

/// Numbers of many digits or of a large exponent.
fn parse_slowly(unsigned: &[u8]) -> Option<f64> {
    let pointed: Vec<u8> =
        unsigned.iter().map(|&byte| if byte == b',' { b'.' } else { byte }).collect();
    std::str::from_utf8(&pointed).ok()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn value(text: &str) -> Option<f64> {
        parse_number(text.as_bytes()).map(|number| number.value)
    }

    #[test]
    fn numbers_of_any_layout_are_read() {
        for (text, expected) in [
            ("1", 1.0),
            ("-1.5", -1.5),
            ("+.5", 0.5),
            ("5.", 5.0),
            ("1,25", 1.25),
            ("1e3", 1e3),
            ("1.0E-03", 1e-3),
            ("1e400", f64::INFINITY),
            ("0.1", 0.1),
            ("1e-400", 0.0),
            ("123456789012345678901234567890", 123456789012345678901234567890.0),
            ("0.000000000000000000000000000001", 1e-30),
            ("9007199254740993", 9007199254740993_i64 as f64),
        ] {
            assert_eq!(value(text), Some(expected), "{text}");
        }
        assert!(value("-0").unwrap().is_sign_negative());
    }

    #[test]
    fn other_texts_are_none() {
        for text in [
            "", "-", ".", "+", "e5", "1e", "1e+", "1.2.3", "1,2,3", "1 2", "1_0", "0x1", "nan",
            "inf", "1.5x", "--1", "1e5.0", "1,234.5",
        ] {
            assert_eq!(parse_number(text.as_bytes()), None, "{text}");
        }
    }

    proptest! {
        #[test]
        fn plain_numbers_are_those_of_their_cells(
            cell in "[+-]?[0-9]{0,17}[.,]?[0-9]{0,17}(e[0-9])?", rest in "(;[0-9]{0,3})?"
        ) {
            let line = format!("1;{cell}{rest}");
            if let Some((number, end)) = parse_plain_number(line.as_bytes(), 2, b';') {
                prop_assert_eq!(end, 2 + cell.len());
                prop_assert_eq!(Some(number), parse_number(cell.as_bytes()));
            }
        }

        #[test]
        fn rounding_is_that_of_the_standard_library(
            text in "[+-]?([0-9]{1,25}[.]?[0-9]{0,25}|[.][0-9]{1,20})([eE][+-]?[0-9]{1,3})?"
        ) {
            let expected: f64 = text.parse().unwrap();
            prop_assert_eq!(value(&text).map(f64::to_bits), Some(expected.to_bits()));
            let comma = text.replace('.', ",");
            prop_assert_eq!(value(&comma).map(f64::to_bits), Some(expected.to_bits()));
        }
    }
}
