// SPDX-License-Identifier: MIT
//! The schema of the elements against what the core reads, writes, checks and finds by path.

use drivetwin_core::model::schema::{ElementSchema, FieldSchema};
use drivetwin_core::model::{Driveline, Element, ModelError, element_schema};
use drivetwin_core::number::{Dual, Number};
use serde_json::{Map, Value, json};

/// A number within the limits of every field.
const WITHIN: f64 = 1.25;

/// Sound content of a field; of groups with alternatives that of index `choice`.
fn content(field: &FieldSchema, choice: usize) -> Value {
    let positive = field.limit.as_ref().is_some_and(|limit| limit.above.is_some());
    match field.kind {
        "text" => json!(field.choices[0]),
        "flag" => json!(true),
        "number" => json!(WITHIN),
        "numbers" if positive => json!([1.0, 2.0, 3.0]),
        "numbers" => json!([0.0, 1.0, 2.0]),
        "rows" => json!([[0.5, 0.5, 0.5], [0.5, 0.5, 0.5], [0.5, 0.5, 0.5]]),
        "group" => {
            let own = choice.min(field.alternatives.len() - 1);
            Value::Object(filled(&field.alternatives[own], choice))
        }
        _ => json!(format!("its {}", field.name)),
    }
}

fn filled(fields: &[FieldSchema], choice: usize) -> Map<String, Value> {
    fields.iter().map(|field| (field.name.to_owned(), content(field, choice))).collect()
}

/// Every type with all its fields, by the first and by the last alternative of its groups.
fn samples() -> Vec<(ElementSchema, Value)> {
    let sample = |schema: ElementSchema, choice| {
        let mut fields = filled(&schema.fields, choice);
        fields.insert("type".to_owned(), json!(schema.kind));
        fields.insert("name".to_owned(), json!("x.1"));
        (schema, Value::Object(fields))
    };
    element_schema().into_iter().flat_map(|s| [sample(s.clone(), 0), sample(s, 1)]).collect()
}

fn read(sample: &Value) -> Result<Element<f64>, serde_json::Error> {
    serde_json::from_value(sample.clone())
}

/// Pointers (RFC 6901) to all fields of a sample, those of groups included.
fn fields_of<'s>(
    fields: &'s [FieldSchema],
    sample: &Value,
    at: &str,
) -> Vec<(String, &'s FieldSchema)> {
    let mut all = Vec::new();
    for field in fields {
        let (pointer, given) = (format!("{at}/{}", field.name), &sample[field.name]);
        let given_has =
            |fields: &&Vec<FieldSchema>| fields.iter().all(|f| given[f.name] != json!(null));
        if let Some(alternative) = field.alternatives.iter().find(given_has) {
            all.extend(fields_of(alternative, given, &pointer));
        }
        all.push((pointer, field));
    }
    all
}

/// Paths of all numbers within a value.
fn numbers_of(value: &Value, at: &str) -> Vec<String> {
    match value {
        Value::Number(_) => vec![at.to_owned()],
        Value::Array(items) => {
            let within = |(i, item)| numbers_of(item, &format!("{at}/{i}"));
            items.iter().enumerate().flat_map(within).collect()
        }
        _ => Vec::new(),
    }
}

#[test]
fn the_schema_has_all_fields_that_are_read_and_written() {
    for (schema, sample) in samples() {
        let element = read(&sample).unwrap();
        assert_eq!(serde_json::to_value(&element).unwrap(), sample, "{}", schema.kind);
        assert_eq!(element.check(), Ok(()), "{}", schema.kind);
    }
}

#[test]
fn the_required_fields_are_those_without_which_an_element_is_refused() {
    for (schema, sample) in samples() {
        for (pointer, field) in fields_of(&schema.fields, &sample, "") {
            let mut rest = sample.clone();
            let (parent, key) = pointer.rsplit_once('/').unwrap();
            rest.pointer_mut(parent).unwrap().as_object_mut().unwrap().remove(key);
            assert_eq!(read(&rest).is_err(), field.required, "{} {pointer}", schema.kind);
        }
    }
}

#[test]
fn the_types_and_choices_are_those_of_the_core() {
    let listed = |error: serde_json::Error| {
        let text = error.to_string();
        text.split('`').skip(3).step_by(2).map(ToOwned::to_owned).collect::<Vec<_>>()
    };
    let kinds: Vec<String> = element_schema().into_iter().map(|schema| schema.kind).collect();
    assert_eq!(listed(read(&json!({"type": "none"})).unwrap_err()), kinds);
    for (schema, sample) in samples() {
        for (pointer, field) in fields_of(&schema.fields, &sample, "") {
            if field.kind == "text" {
                let mut other = sample.clone();
                *other.pointer_mut(&pointer).unwrap() = json!("none");
                assert_eq!(listed(read(&other).unwrap_err()), field.choices, "{pointer}");
            }
        }
    }
}

#[test]
fn conversion_to_the_same_and_to_another_number_type_keeps_every_field() {
    for (schema, sample) in samples() {
        let element = read(&sample).unwrap();
        assert_eq!(element.map(&|&number| number), element, "{}", schema.kind);
        let there = element.map(&|&number| Dual::<2>::of(number));
        assert_eq!(there.map(&Dual::re), element, "{}", schema.kind);
        let driveline = Driveline { elements: vec![element] };
        assert_eq!(driveline.promote(), Driveline { elements: vec![there] });
    }
}

#[test]
fn paths_lead_to_the_differentiable_numbers_and_to_nothing_else() {
    for (schema, sample) in samples() {
        let mut driveline = Driveline { elements: vec![read(&sample).unwrap()] };
        let mut found = 0;
        for (pointer, field) in fields_of(&schema.fields, &sample, "") {
            let mut paths = numbers_of(sample.pointer(&pointer).unwrap(), &pointer);
            found += if field.differentiable { paths.len() } else { 0 };
            for path in &paths {
                let name = format!("x.1{}", path.replace('/', "."));
                let number = driveline.number_mut(&name);
                assert_eq!(number.is_some(), field.differentiable, "{name}");
                let Some(number) = number else { continue };
                let before = std::mem::replace(number, 77.0);
                let mut expected = sample.clone();
                *expected.pointer_mut(path).unwrap() = json!(77.0);
                assert_eq!(serde_json::to_value(&driveline.elements[0]).unwrap(), expected);
                *driveline.number_mut(&name).unwrap() = before;
            }
            paths.retain(|path| *path == pointer);
            let beyond = ["/0/0", "/x", "/99", "/00", "/"].map(|end| format!("{pointer}{end}"));
            let whole = paths.is_empty().then_some(pointer.clone());
            for path in beyond.into_iter().chain(whole) {
                assert_eq!(driveline.number_mut(&format!("x.1{}", path.replace('/', "."))), None);
            }
        }
        let count = std::cell::Cell::new(0);
        let _ = driveline.map(&|&number| count.set(count.get() + usize::from(number >= 0.0)));
        assert_eq!(count.get(), found, "{}", schema.kind);
    }
}

#[test]
fn the_longest_name_of_an_element_counts() {
    let named = |name: &str, inertia| {
        read(&json!({"type": "inertia", "name": name, "node": "n", "inertia": inertia})).unwrap()
    };
    let elements = vec![named("drum", 1.0), named("drum.inertia", 2.0), named("drum of B2", 3.0)];
    let mut driveline = Driveline { elements };
    let mut at = |path: &str| driveline.number_mut(path).copied();
    assert_eq!(at("drum.inertia.inertia"), Some(2.0));
    assert_eq!(at("drum.inertia"), Some(1.0));
    assert_eq!(at("drum of B2.inertia"), Some(3.0));
    assert_eq!([at("drum"), at("drum.node"), at("drums.inertia"), at("inertia")], [None; 4]);
}

#[test]
fn numbers_are_refused_exactly_outside_their_limits() {
    for (schema, sample) in samples() {
        for (pointer, field) in fields_of(&schema.fields, &sample, "") {
            let Some(limit) = field.limit.as_ref().filter(|_| field.kind == "number") else {
                continue;
            };
            for value in [-1.0, 0.0, 1e-9, 1.0, 1.5, 1.6] {
                let mut other = sample.clone();
                *other.pointer_mut(&pointer).unwrap() = json!(value);
                let accepted = limit.least.is_none_or(|least| value >= least)
                    && limit.above.is_none_or(|above| value > above)
                    && limit.most.is_none_or(|most| value <= most)
                    && !limit.not.contains(&value);
                let refused = matches!(
                    read(&other).unwrap().check(),
                    Err(ModelError::Value { field: name, requirement, .. })
                        if name == field.name && requirement == limit.text
                );
                assert_eq!(refused, !accepted, "{} {pointer} = {value}", schema.kind);
            }
        }
    }
}

#[test]
fn every_point_of_a_table_is_refused_outside_the_limits() {
    for (schema, sample) in samples() {
        for (pointer, field) in fields_of(&schema.fields, &sample, "") {
            let least = field.limit.as_ref().and_then(|limit| limit.least.or(limit.above));
            let (Some(least), true) = (least, field.kind != "number") else { continue };
            for path in numbers_of(sample.pointer(&pointer).unwrap(), &pointer) {
                let mut other = sample.clone();
                *other.pointer_mut(&path).unwrap() = json!(least - 0.1);
                let error = read(&other).unwrap().check();
                assert!(matches!(error, Err(ModelError::Table { .. })), "{path}: {error:?}");
            }
        }
    }
}

#[test]
fn numbers_that_are_not_finite_are_refused() {
    for (schema, sample) in samples() {
        let element = read(&sample).unwrap();
        for (pointer, field) in fields_of(&schema.fields, &sample, "") {
            let paths = numbers_of(sample.pointer(&pointer).unwrap(), &pointer);
            for path in paths.iter().filter(|_| field.differentiable) {
                let path: Vec<&str> = path.split('/').skip(1).collect();
                for value in [f64::NAN, f64::INFINITY] {
                    let mut other = element.clone();
                    *other.number_mut(&path).unwrap() = value;
                    assert!(other.check().is_err(), "{} {pointer}", schema.kind);
                }
            }
        }
    }
}

#[test]
fn limits_read_as_in_messages() {
    let limit = |kind: &str, name: &str| {
        let schema = element_schema().into_iter().find(|schema| schema.kind == kind).unwrap();
        let groups = schema.fields.iter().flat_map(|field| field.alternatives.iter().flatten());
        let field = schema.fields.iter().chain(groups).find(|field| field.name == name).unwrap();
        field.limit.as_ref().unwrap().text.clone()
    };
    assert_eq!(limit("inertia", "inertia"), ">= 0 kg m^2");
    assert_eq!(limit("gear", "ratio"), "not 0");
    assert_eq!(limit("gear", "eta"), "in (0, 1.5]");
    assert_eq!(limit("planetary", "z"), "neither 0 nor -1");
    assert_eq!(limit("clutch", "gain"), ">= 0 m^3");
    assert_eq!(limit("clutch", "p0"), "finite");
    assert_eq!(limit("clutch", "peak"), ">= 1");
    assert_eq!(limit("clutch", "v_s"), "> 0 rad/s");
    assert_eq!(limit("tyre", "least_speed"), "> 0 rad/s");
}
