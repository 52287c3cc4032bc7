//! The schema of the entries that are either a word or a table.

use std::borrow::Cow;

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde_json::Value;

use super::{IntegratorFile, SkipFile, Table};

impl JsonSchema for IntegratorFile {
    fn schema_name() -> Cow<'static, str> {
        "IntegratorFile".into()
    }

    /// A table, or the name of one that requires nothing else.
    fn json_schema(generator: &mut SchemaGenerator) -> Schema {
        let table = Table::json_schema(generator);
        let variants = table.get("oneOf").and_then(Value::as_array);
        let alone = |variant: &&Value| variant["required"] == serde_json::json!(["name"]);
        let names = variants.into_iter().flatten().filter(alone).map(|variant| {
            let (name, description) = (&variant["properties"]["name"], &variant["description"]);
            json_schema!({ "const": name["const"], "description": description })
        });
        let names: Vec<_> = names.collect();
        json_schema!({ "anyOf": [{ "oneOf": names }, table] })
    }
}

impl JsonSchema for SkipFile {
    fn schema_name() -> Cow<'static, str> {
        "SkipFile".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        json_schema!({
            "anyOf": [
                { "enum": ["nothing", "exact"] },
                {
                    "type": "object",
                    "properties": {
                        "tolerance": {
                            "description": "Change of the end of the run, 1e-14 to 0.1: relative to the size of the scene, or rad.",
                            "type": "number",
                        },
                    },
                    "required": ["tolerance"],
                    "additionalProperties": false,
                },
            ],
        })
    }
}
