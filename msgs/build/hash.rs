//! REP-2011 type hashes: SHA-256 of a type's description, and of all descriptions within it, as JSON.
//!
//! `roslibrust_codegen` 0.26 has them for messages, but wrong for `byte` fields and for messages within those of an action.

use std::{
    collections::{BTreeMap, BTreeSet},
    fmt::Write,
};

use roslibrust_codegen::{ArrayType, FieldInfo};
use sha2::{Digest, Sha256};

use crate::{
    Messages,
    interfaces::{Action, Interfaces, Service},
    names::type_name,
};

const NESTED: u8 = 1;

/// What is added to an element's type identifier.
const ARRAY: u8 = 48;
const BOUNDED_SEQUENCE: u8 = 96;
const UNBOUNDED_SEQUENCE: u8 = 144;

/// `type_description_interfaces/msg/Field`, bounded strings apart.
struct Field {
    name: String,
    type_id: u8,
    capacity: usize,
    nested: String,
}

impl Field {
    fn nested(name: &str, type_name: String) -> Self {
        Self {
            name: name.to_owned(),
            type_id: NESTED,
            capacity: 0,
            nested: type_name,
        }
    }

    /// A sequence of at most one.
    fn optional(name: &str, type_name: String) -> Self {
        Self {
            type_id: NESTED + BOUNDED_SEQUENCE,
            capacity: 1,
            ..Self::nested(name, type_name)
        }
    }
}

/// The descriptions of all types by their names: messages, services with their events, and actions.
pub struct Descriptions {
    types: BTreeMap<String, Vec<Field>>,
    endpoints: BTreeSet<String>,
}

impl Descriptions {
    /// Describes everything that has been found.
    pub fn of(messages: &Messages, interfaces: &Interfaces) -> Result<Self, String> {
        let mut descriptions = Self {
            types: BTreeMap::new(),
            endpoints: BTreeSet::new(),
        };
        for message in messages.values() {
            let fields = message.get_fields().iter();
            let fields = fields.map(|field| described(field, messages));
            descriptions
                .types
                .insert(type_name(message)?, fields.collect::<Result<_, _>>()?);
        }
        for Service { package, name } in &interfaces.services {
            descriptions.insert_service(format!("{package}/srv/{name}"));
        }
        for Action { package, name } in &interfaces.actions {
            descriptions.insert_action(format!("{package}/action/{name}"));
        }
        Ok(descriptions)
    }

    /// The hash of a type, `RIHS01_…`.
    pub fn hash(&self, type_name: &str) -> Result<String, String> {
        let mut referenced = BTreeMap::new();
        self.collect(type_name, &mut referenced)?;
        let referenced: Vec<String> = referenced.into_values().collect();
        let json = format!(
            r#"{{"type_description": {}, "referenced_type_descriptions": [{}]}}"#,
            self.json(type_name)?,
            referenced.join(", ")
        );
        let mut hash = "RIHS01_".to_owned();
        for byte in Sha256::digest(json) {
            write!(hash, "{byte:02x}").map_err(|error| error.to_string())?;
        }
        Ok(hash)
    }

    /// The names of all services and actions.
    pub fn endpoints(&self) -> impl Iterator<Item = &str> {
        self.endpoints.iter().map(String::as_str)
    }

    fn insert_service(&mut self, name: String) {
        let [request, response, event] =
            ["Request", "Response", "Event"].map(|part| format!("{name}_{part}"));
        let information = "service_msgs/msg/ServiceEventInfo".to_owned();
        let fields = vec![
            Field::nested("info", information),
            Field::optional("request", request.clone()),
            Field::optional("response", response.clone()),
        ];
        self.types.insert(event.clone(), fields);
        let fields = vec![
            Field::nested("request_message", request),
            Field::nested("response_message", response),
            Field::nested("event_message", event),
        ];
        self.types.insert(name.clone(), fields);
        self.endpoints.insert(name);
    }

    fn insert_action(&mut self, name: String) {
        let parts = [
            ("goal", "Goal"),
            ("result", "Result"),
            ("feedback", "Feedback"),
            ("send_goal_service", "SendGoal"),
            ("get_result_service", "GetResult"),
            ("feedback_message", "FeedbackMessage"),
        ];
        let fields = parts.map(|(field, part)| Field::nested(field, format!("{name}_{part}")));
        for service in ["SendGoal", "GetResult"] {
            self.insert_service(format!("{name}_{service}"));
        }
        self.types.insert(name.clone(), fields.into());
        self.endpoints.insert(name);
    }

    fn fields(&self, type_name: &str) -> Result<&[Field], String> {
        self.types
            .get(type_name)
            .map(Vec::as_slice)
            .ok_or_else(|| format!("{type_name} is not vendored"))
    }

    /// The descriptions of all types within a type, by name.
    fn collect(
        &self,
        type_name: &str,
        referenced: &mut BTreeMap<String, String>,
    ) -> Result<(), String> {
        for Field { nested, .. } in self.fields(type_name)? {
            if !nested.is_empty() && !referenced.contains_key(nested) {
                referenced.insert(nested.clone(), self.json(nested)?);
                self.collect(nested, referenced)?;
            }
        }
        Ok(())
    }

    fn json(&self, type_name: &str) -> Result<String, String> {
        let fields: Vec<String> = self
            .fields(type_name)?
            .iter()
            .map(|Field { name, type_id, capacity, nested }| {
                format!(
                    r#"{{"name": "{name}", "type": {{"type_id": {type_id}, "capacity": {capacity}, "string_capacity": 0, "nested_type_name": "{nested}"}}}}"#
                )
            })
            .collect();
        Ok(format!(
            r#"{{"type_name": "{type_name}", "fields": [{}]}}"#,
            fields.join(", ")
        ))
    }
}

fn described(field: &FieldInfo, messages: &Messages) -> Result<Field, String> {
    let name = field.field_name.clone();
    if field.field_type.string_capacity.is_some() {
        return Err(format!("{name}: bounded strings have no hash here"));
    }
    let (element, nested) = if field.field_type.package_name.is_some() {
        let nested = field.get_full_type_name();
        let message = messages
            .get(&nested)
            .ok_or_else(|| format!("{nested} is not vendored"))?;
        (NESTED, type_name(message)?)
    } else {
        (scalar(&field.field_type.field_type)?, String::new())
    };
    let (offset, capacity) = match field.field_type.array_info {
        ArrayType::NotArray => (0, 0),
        ArrayType::FixedLength(length) => (ARRAY, length),
        ArrayType::Bounded(length) => (BOUNDED_SEQUENCE, length),
        ArrayType::Unbounded => (UNBOUNDED_SEQUENCE, 0),
    };
    Ok(Field {
        name,
        type_id: element + offset,
        capacity,
        nested,
    })
}

/// `type_description_interfaces/msg/FieldType`.
fn scalar(ros: &str) -> Result<u8, String> {
    Ok(match ros {
        "int8" => 2,
        "uint8" | "char" => 3,
        "int16" => 4,
        "uint16" => 5,
        "int32" => 6,
        "uint32" => 7,
        "int64" => 8,
        "uint64" => 9,
        "float32" => 10,
        "float64" => 11,
        "bool" => 15,
        "byte" => 16,
        "string" => 17,
        other => return Err(format!("no type identifier for the ROS type {other:?}")),
    })
}
