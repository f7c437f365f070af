//! What two results of the same work do not have in common, seconds aside.

use std::collections::BTreeMap;

use toml::Value;

/// Fields that are times of the clock.
const TIMES: [&str; 4] = ["seconds", "seconds_fit", "seconds_predict", "step"];
/// Numbers of one piece of work that are listed.
const MOST_LISTED: usize = 12;

/// Every number and name that is not the same to the bit: where it is, the old one and the new one.
pub(super) fn differences(old: &Value, new: &Value) -> Vec<String> {
    let (old, new) = (leaves(old), leaves(new));
    let places: Vec<&String> = old.keys().chain(new.keys()).collect();
    let mut lines = Vec::new();
    for place in places {
        let (was, is) = (old.get(place), new.get(place));
        let said = |text: Option<&String>| text.map_or("absent", String::as_str).to_string();
        let line = format!("{place} was {}, is {}", said(was), said(is));
        if was != is && !lines.contains(&line) {
            lines.push(line);
        }
    }
    let n_more = lines.len().saturating_sub(MOST_LISTED);
    lines.truncate(MOST_LISTED);
    if n_more > 0 {
        lines.push(format!("and {n_more} more"));
    }
    lines
}

/// Seconds of all that a record says to have taken.
pub(super) fn seconds(record: &Value) -> f64 {
    let mut total = 0.0;
    visit(record, "", &mut |place, value| {
        if let (true, Value::Float(seconds)) = (is_time(place), value) {
            total += seconds;
        }
    });
    total
}

/// Texts of all values by their places, times left out; the texts differ as soon as a bit does.
fn leaves(record: &Value) -> BTreeMap<String, String> {
    let mut leaves = BTreeMap::new();
    visit(record, "", &mut |place, value| {
        if !is_time(place) {
            let text = match value {
                Value::Float(number) => format!("{number:?}"),
                other => other.to_string(),
            };
            leaves.insert(place.to_string(), text);
        }
    });
    leaves
}

fn is_time(place: &str) -> bool {
    TIMES.contains(&place.rsplit('.').next().unwrap_or(place))
}

fn visit(value: &Value, place: &str, leaf: &mut impl FnMut(&str, &Value)) {
    let below = |name: &str| match place {
        "" => name.to_string(),
        _ => format!("{place}.{name}"),
    };
    match value {
        Value::Table(fields) => {
            for (name, value) in fields {
                visit(value, &below(name), leaf);
            }
        }
        Value::Array(items) => {
            for (idx, value) in items.iter().enumerate() {
                visit(value, &below(&idx.to_string()), leaf);
            }
        }
        _ => leaf(place, value),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(text: &str) -> Value {
        Value::Table(text.parse().unwrap())
    }

    #[test]
    fn the_last_bit_and_the_sign_of_zero_differ_and_seconds_do_not() {
        let old =
            record("a = 0.3\nb = [0.0, 1.0]\nseconds = 1.0\nf = { seconds_fit = 2.0, n = 3 }");
        let new = record(
            "a = 0.30000000000000004\nb = [-0.0, 1.0]\nseconds = 5.0\nf = { seconds_fit = 9.0, n = 3 }",
        );
        let expected = ["a was 0.3, is 0.30000000000000004", "b.0 was 0.0, is -0.0"];
        assert_eq!(differences(&old, &new), expected);
        assert_eq!(differences(&old, &old), [""; 0]);
        assert!((seconds(&old) - 3.0).abs() <= f64::EPSILON);
    }

    #[test]
    fn what_only_one_of_them_has_differs() {
        let expected = ["b was absent, is 2", "c was 1, is absent"];
        let mut found = differences(&record("c = 1"), &record("b = 2"));
        found.sort();
        assert_eq!(found, expected);
    }
}
