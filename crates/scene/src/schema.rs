//! The schema of scene files.

/// JSON Schema (draft 2020-12) of scene files: their keys, with types, defaults and descriptions. Editors with a TOML
/// language server complete and check scenes by it. It does not know limits that depend on several keys.
pub const SCHEMA: &str = include_str!("scene.schema.json");

#[cfg(test)]
mod tests {
    use std::path::Path;

    use serde_json::Value;

    use super::SCHEMA;
    use crate::file::SceneFile;

    /// Removes the alternative null of optional keys: TOML has none.
    fn without_null(value: &mut Value) {
        let null = |value: &Value| value == "null" || value["type"] == "null";
        match value {
            Value::Object(object) => {
                for key in ["type", "anyOf"] {
                    let Some(Value::Array(types)) = object.get_mut(key) else {
                        continue;
                    };
                    types.retain(|value| !null(value));
                    let [only] = types.as_slice() else { continue };
                    let only = only.clone();
                    object.remove(key);
                    match only {
                        Value::Object(only) => object.extend(only),
                        only => drop(object.insert(key.into(), only)),
                    }
                }
                object.retain(|key, value| !(key == "default" && value.is_null()));
                object.values_mut().for_each(without_null);
            }
            Value::Array(values) => values.iter_mut().for_each(without_null),
            _ => {}
        }
    }

    /// Checks that all keys of tables are described.
    fn assert_described(value: &Value, path: &str) {
        if let Some(properties) = value["properties"].as_object() {
            for (key, property) in properties {
                // The variant of an enumeration is described one level above.
                let known = ["description", "const", "properties"];
                let described = known.iter().any(|name| !property[name].is_null());
                assert!(described, "{path}.{key} is not described");
            }
        }
        match value {
            Value::Object(object) => {
                let inner = object.iter();
                inner.for_each(|(key, value)| assert_described(value, &format!("{path}.{key}")));
            }
            Value::Array(values) => values
                .iter()
                .for_each(|value| assert_described(value, path)),
            _ => {}
        }
    }

    /// The schema is that of the types that are read. With `UPDATE_SCHEMA` set, its file is made anew.
    #[test]
    fn the_schema_is_that_of_the_types() {
        let mut schema = schemars::schema_for!(SceneFile).to_value();
        without_null(&mut schema);
        assert_described(&schema, "");
        if std::env::var_os("UPDATE_SCHEMA").is_some() {
            let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/scene.schema.json");
            let text = serde_json::to_string_pretty(&schema).unwrap();
            std::fs::write(path, text + "\n").unwrap();
            return;
        }
        let kept: Value = serde_json::from_str(SCHEMA).unwrap();
        assert_eq!(kept, schema, "`just schema` makes it anew");
    }
}
