//! The text of a message type with all that it needs.

use std::{collections::BTreeSet, error::Error, fmt::Write};

use roslibrust_codegen::{FieldInfo, MessageFile};

use crate::Messages;

/// The text rosbag2 stores: the message, then each message it needs once, depth first, in alphabetical order.
pub fn definition(message: &MessageFile, messages: &Messages) -> Result<String, Box<dyn Error>> {
    fn append(
        text: &mut String,
        seen: &mut BTreeSet<String>,
        message: &MessageFile,
        messages: &Messages,
    ) -> Result<(), Box<dyn Error>> {
        text.push_str(&message.parsed.source);
        let nested = message
            .get_fields()
            .iter()
            .filter(|field| field.field_type.package_name.is_some());
        for name in nested
            .map(FieldInfo::get_full_type_name)
            .collect::<BTreeSet<_>>()
        {
            if seen.insert(name.clone()) {
                let dependency = messages
                    .get(&name)
                    .ok_or_else(|| format!("{name} is not vendored"))?;
                write!(text, "\n{}\nMSG: {name}\n", "=".repeat(80))?;
                append(text, seen, dependency, messages)?;
            }
        }
        Ok(())
    }
    let mut text = String::new();
    append(&mut text, &mut BTreeSet::new(), message, messages)?;
    Ok(text)
}
