//! Checks a TOML value against a JSON Schema: the subset that schemars derives for parameters.
//!
//! Ranges, choices and units come from the schema alone, so a stage states them once.

use super::document::{Content, Node};
use super::problem::{Problem, nearest};
use serde_json::{Map, Value};
use std::collections::BTreeMap;
use std::path::Path;

/// Checks `node` against `schema`, adding every fault to `found`.
pub fn check(file: &Path, node: &Node, schema: &Value, found: &mut Vec<Problem>) {
    Checker { file, root: schema, found }.value("", node, schema);
}

/// The schema of one property of an object schema, with references followed.
#[must_use]
pub fn property<'a>(schema: &'a Value, name: &str) -> Option<Map<String, Value>> {
    let found: &'a Value = schema.get("properties")?.get(name)?;
    Some(resolve(schema, found))
}

/// A schema with its `$ref` followed and an optional value's `null` taken away. Keywords beside the
/// reference (description, unit, default) win over those behind it.
#[must_use]
pub fn resolve(root: &Value, schema: &Value) -> Map<String, Value> {
    let mut own = schema.as_object().cloned().unwrap_or_default();
    let target = own.remove("$ref").and_then(|reference| {
        let pointer = reference.as_str()?.strip_prefix('#')?.to_owned();
        root.pointer(&pointer).cloned()
    });
    let some = own.remove("anyOf").and_then(|choices| {
        let null = |choice: &&Value| choice.get("type").and_then(Value::as_str) != Some("null");
        choices.as_array()?.iter().find(null).cloned()
    });
    for inner in [target, some].into_iter().flatten() {
        for (key, value) in resolve(root, &inner) {
            own.entry(key).or_insert(value);
        }
    }
    own
}

/// The values an enumeration allows, if the schema is one.
#[must_use]
pub fn choices(schema: &Map<String, Value>) -> Option<Vec<String>> {
    let text = |value: &Value| value.as_str().map(str::to_owned);
    if let Some(values) = schema.get("enum").and_then(Value::as_array) {
        return Some(values.iter().filter_map(text).collect());
    }
    let variants = schema.get("oneOf")?.as_array()?;
    let of = |variant: &Value| match variant.get("const") {
        Some(value) => text(value).into_iter().collect(),
        None => variant.as_object().and_then(choices).unwrap_or_default(),
    };
    Some(variants.iter().flat_map(of).collect())
}

/// What the schema allows, in words: `a number from 0.1 to 50 m`.
#[must_use]
pub fn allowed(schema: &Map<String, Value>) -> String {
    if let Some(choices) = choices(schema) {
        return format!("one of {}", choices.join(", "));
    }
    let noun = match kind(schema) {
        "integer" => "a whole number",
        "number" => "a number",
        "string" => "text in quotes",
        "boolean" => "true or false",
        "array" => "a list",
        "object" => "a table",
        _ => "another value",
    };
    let mut words = noun.to_owned();
    if matches!(kind(schema), "integer" | "number") {
        words.push_str(&range(schema));
        if let Some(unit) = schema.get("x-unit").and_then(Value::as_str) {
            words.push_str(&format!(" {unit}"));
        }
    }
    words
}

/// The range of a number in words, with a leading space; empty without limits.
#[must_use]
pub fn range(schema: &Map<String, Value>) -> String {
    let at = |key: &str| schema.get(key).map(ToString::to_string);
    let low = at("minimum").or_else(|| at("exclusiveMinimum").map(|low| format!("above {low}")));
    let high = at("maximum").or_else(|| at("exclusiveMaximum").map(|high| format!("below {high}")));
    match (low, high) {
        (Some(low), Some(high)) => format!(" from {low} to {high}"),
        (Some(low), None) if low.starts_with("above") => format!(" {low}"),
        (Some(low), None) => format!(" of at least {low}"),
        (None, Some(high)) => format!(" of at most {high}"),
        (None, None) => String::new(),
    }
}

fn kind(schema: &Map<String, Value>) -> &str {
    let named = match schema.get("type") {
        Some(Value::String(name)) => Some(name.as_str()),
        Some(Value::Array(names)) => names.iter().filter_map(Value::as_str).find(|n| *n != "null"),
        _ => None,
    };
    named.unwrap_or_default()
}

struct Checker<'a> {
    file: &'a Path,
    root: &'a Value,
    found: &'a mut Vec<Problem>,
}

impl Checker<'_> {
    fn value(&mut self, name: &str, node: &Node, schema: &Value) {
        let schema = resolve(self.root, schema);
        match &node.content {
            Content::Table(entries) if kind(&schema) == "object" => {
                self.table(name, node, entries, &schema);
            }
            Content::List(items) if kind(&schema) == "array" => {
                self.list(name, node, items, &schema);
            }
            Content::Scalar(value) if fits(value, &schema) => {}
            _ => self.refuse(name, node, &schema),
        }
    }

    fn refuse(&mut self, name: &str, node: &Node, schema: &Map<String, Value>) {
        let what = format!("`{name}` is {}; it must be {}", node.written, allowed(schema));
        let near = match (&node.content, choices(schema)) {
            (Content::Scalar(Value::String(given)), Some(known)) => {
                nearest(given, known.iter().map(String::as_str))
                    .map(|name| format!("did you mean `{name}`?"))
            }
            _ => None,
        };
        self.found.push(Problem::new(self.file, Some(node.at), what).hint(near));
    }

    fn table(
        &mut self,
        name: &str,
        node: &Node,
        entries: &BTreeMap<String, Node>,
        schema: &Map<String, Value>,
    ) {
        let none = Map::new();
        let known = schema.get("properties").and_then(Value::as_object).unwrap_or(&none);
        for (key, child) in entries {
            match known
                .get(key)
                .or_else(|| schema.get("additionalProperties").filter(|s| s.is_object()))
            {
                Some(inner) => self.value(key, child, inner),
                None => self.unknown(name, key, child, known),
            }
        }
        for key in schema.get("required").and_then(Value::as_array).into_iter().flatten() {
            if let Some(key) = key.as_str().filter(|key| !entries.contains_key(*key)) {
                self.found.push(missing(self.file, name, node, key, known.get(key), self.root));
            }
        }
    }

    fn unknown(&mut self, table: &str, key: &str, child: &Node, known: &Map<String, Value>) {
        let place = if table.is_empty() { String::new() } else { format!(" in [{table}]") };
        let what = format!("unknown key `{key}`{place}");
        let hint = match nearest(key, known.keys().map(String::as_str)) {
            Some(name) => format!("did you mean `{name}`?"),
            None if known.is_empty() => "there is nothing to set here".to_owned(),
            None => {
                let names: Vec<&str> = known.keys().map(String::as_str).collect();
                format!("known keys: {}", names.join(", "))
            }
        };
        self.found.push(Problem::new(self.file, Some(child.key_at), what).hint(Some(hint)));
    }

    fn list(&mut self, name: &str, node: &Node, items: &[Node], schema: &Map<String, Value>) {
        let limit = |key: &str| schema.get(key).and_then(Value::as_u64).map(|n| n as usize);
        let (least, most) =
            (limit("minItems").unwrap_or(0), limit("maxItems").unwrap_or(usize::MAX));
        if items.len() < least || items.len() > most {
            let wanted = match (least, most) {
                (least, most) if least == most => format!("{least}"),
                (least, usize::MAX) => format!("at least {least}"),
                (least, most) => format!("{least} to {most}"),
            };
            let what = format!("`{name}` has {} entries; it must have {wanted}", items.len());
            self.found.push(Problem::new(self.file, Some(node.at), what));
        }
        if let Some(inner) = schema.get("items") {
            items.iter().for_each(|item| self.value(name, item, inner));
        }
    }
}

fn missing(
    file: &Path,
    table: &str,
    node: &Node,
    key: &str,
    schema: Option<&Value>,
    root: &Value,
) -> Problem {
    let place = if table.is_empty() { String::new() } else { format!(" in [{table}]") };
    let wanted = schema.map(|schema| allowed(&resolve(root, schema)));
    let what = format!("`{key}` is missing{place}");
    Problem::new(file, Some(node.at), what)
        .hint(wanted.map(|wanted| format!("it must be {wanted}")))
}

fn fits(value: &Value, schema: &Map<String, Value>) -> bool {
    if let Some(choices) = choices(schema) {
        return value.as_str().is_some_and(|given| choices.iter().any(|choice| choice == given));
    }
    match (kind(schema), value) {
        ("integer", Value::Number(number)) => {
            number.as_f64().is_some_and(|n| n.fract() == 0.0 && within(n, schema))
                && !number.is_f64()
        }
        ("number", Value::Number(number)) => number.as_f64().is_some_and(|n| within(n, schema)),
        ("string", Value::String(_)) | ("boolean", Value::Bool(_)) => true,
        ("", Value::Null) => false,
        ("", _) => true,
        _ => false,
    }
}

fn within(number: f64, schema: &Map<String, Value>) -> bool {
    let limit = |key: &str| schema.get(key).and_then(Value::as_f64);
    limit("minimum").is_none_or(|low| number >= low)
        && limit("maximum").is_none_or(|high| number <= high)
        && limit("exclusiveMinimum").is_none_or(|low| number > low)
        && limit("exclusiveMaximum").is_none_or(|high| number < high)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::{Document, Problems};
    use schemars::JsonSchema;

    #[derive(JsonSchema)]
    #[serde(rename_all = "kebab-case")]
    #[expect(dead_code, reason = "only its schema is used")]
    enum Mode {
        /// First.
        Auto,
        /// Second.
        UseAll,
    }

    #[derive(JsonSchema)]
    #[serde(deny_unknown_fields)]
    #[expect(dead_code, reason = "only its schema is used")]
    struct Params {
        #[schemars(range(min = 0.1, max = 50.0), extend("x-unit" = "m"))]
        window_m: f64,
        count: Option<u8>,
        mode: Option<Mode>,
        pair: Option<[i64; 2]>,
    }

    fn faults(text: &str) -> String {
        let document = Document::parse(Path::new("p.toml"), text).unwrap();
        let mut found = Vec::new();
        let schema = schemars::schema_for!(Params).to_value();
        check(&document.path, &document.root, &schema, &mut found);
        Problems::check(found).map_or_else(|problems| problems.to_string(), |()| String::new())
    }

    #[test]
    fn good_values_pass() {
        assert_eq!(faults("window_m = 5\ncount = 255\nmode = \"use-all\"\npair = [1, -2]"), "");
    }

    #[test]
    fn all_faults_at_once_with_place_range_unit_and_nearest_name() {
        let all = faults("window_m = 60.5\ncont = 3\nmode = \"use_all\"\npair = [1]\ncount = 1.5");
        let expected = "p.toml:1:12: `window_m` is 60.5; it must be a number from 0.1 to 50.0 m\n\
            p.toml:2:1: unknown key `cont`\n    did you mean `count`?\n\
            p.toml:3:8: `mode` is \"use_all\"; it must be one of auto, use-all\n    did you mean `use-all`?\n\
            p.toml:4:8: `pair` has 1 entries; it must have 2\n\
            p.toml:5:9: `count` is 1.5; it must be a whole number from 0 to 255";
        assert_eq!(all, expected);
    }

    #[test]
    fn missing_and_not_finite() {
        assert!(faults("count = 1").contains("`window_m` is missing\n    it must be a number"));
        assert!(faults("window_m = nan").contains("`window_m` is nan; it must be"));
        assert!(faults("window_m = true").contains("is true; it must be a number"));
    }
}
