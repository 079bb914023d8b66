// SPDX-License-Identifier: MIT
//! Numbers of a description with the weights of their derivatives.
//!
//! A plain number is a constant. `{"value": v, "seeds": [[lane, weight], ...]}` depends on the unknowns of
//! these lanes; the weights are its derivatives by them, so that one unknown may act on several numbers.

use super::Dual;
use serde::de::{Deserialize, Deserializer, Error};

#[derive(serde::Deserialize)]
#[serde(untagged)]
enum Seeded {
    Constant(f64),
    Variable { value: f64, seeds: Vec<(usize, f64)> },
}

impl<const P: usize> Dual<P> {
    /// Value with the weights of its derivatives by lanes. Return the lane that is beyond `P`, if any.
    pub fn from_seeds(value: f64, seeds: &[(usize, f64)]) -> Result<Self, usize> {
        let mut eps = [0.0; P];
        for &(lane, weight) in seeds {
            *eps.get_mut(lane).ok_or(lane)? += weight;
        }
        Ok(Self::new(value, eps))
    }
}

impl<'de, const P: usize> Deserialize<'de> for Dual<P> {
    fn deserialize<D: Deserializer<'de>>(source: D) -> Result<Self, D::Error> {
        let (value, seeds) = match Seeded::deserialize(source)? {
            Seeded::Constant(value) => (value, Vec::new()),
            Seeded::Variable { value, seeds } => (value, seeds),
        };
        let refuse = |lane| D::Error::custom(format!("lane {lane} of a derivative is beyond {P}"));
        Self::from_seeds(value, &seeds).map_err(refuse)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_of_one_lane_add_up() {
        let text = r#"[2, {"value": 3.0, "seeds": [[1, 0.5], [1, 0.25], [0, 4.0]]}]"#;
        let found: Vec<Dual<2>> = serde_json::from_str(text).unwrap();
        assert_eq!(found, [Dual::new(2.0, [0.0, 0.0]), Dual::new(3.0, [4.0, 0.75])]);
        assert!(serde_json::from_str::<Dual<1>>(r#"{"value": 1.0, "seeds": [[1, 1.0]]}"#).is_err());
    }
}
