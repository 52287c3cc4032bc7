//! Decoding by definitions gives the same values as typed decoding.

use std::collections::BTreeMap;
use std::path::Path;

use lgvi_bag::BagReader;
use lgvi_msgs::{RosMessage, cdr};
use serde_json::Value;

use super::json;
use super::random::Writer;
use crate::definition::{Message, Number, Type};

/// Returns the result of typed decoding. For a little-endian payload, encoding it again must give the same bytes
/// (without padding).
fn typed<M: RosMessage>(payload: &[u8]) -> Value {
    let message: M = cdr::decode(payload).expect(M::TYPE_NAME);
    if payload[1] == 1 {
        let again = cdr::encode(&message).unwrap();
        assert_eq!(again, payload[..again.len()], "{}", M::TYPE_NAME);
    }
    serde_json::to_value(message).unwrap()
}

type Decode = fn(&[u8]) -> Value;

macro_rules! decoders {
    ($($message:ty),* $(,)?) => {
        [$((<$message as RosMessage>::TYPE_NAME, typed::<$message> as Decode)),*]
    };
}

/// Returns the typed decoders by the name of the message type.
fn decoders() -> BTreeMap<&'static str, Decode> {
    BTreeMap::from(lgvi_msgs::for_every_message!(decoders))
}

fn same(kind: &Type, typed: &Value, ours: &Value, at: &str) {
    match (kind, typed, ours) {
        // serde_json represents NaN and infinities as null.
        (Type::Number(Number::Float32 | Number::Float64), Value::Null, Value::String(text)) => {
            assert!(["NaN", "inf", "-inf"].contains(&&**text), "{at}: {text}");
        }
        (Type::Number(Number::Float32), typed, ours) => {
            let [typed, ours] = [typed, ours].map(|value| value.as_f64().expect(at) as f32);
            assert_eq!(typed.to_bits(), ours.to_bits(), "{at}: {typed} and {ours}");
        }
        (Type::Number(Number::Float64), typed, ours) => {
            let [typed, ours] = [typed, ours].map(|value| value.as_f64().expect(at));
            assert_eq!(typed.to_bits(), ours.to_bits(), "{at}: {typed} and {ours}");
        }
        (Type::Message(message), Value::Object(typed), Value::Object(ours)) => {
            assert_eq!(ours.len(), message.fields.len(), "{at}");
            for field in &message.fields {
                let at = format!("{at}.{}", field.name);
                same(&field.kind, &typed[&field.name], &ours[&field.name], &at);
            }
        }
        (Type::Array { .. }, Value::Array(typed), Value::String(digits)) => {
            let octets = typed
                .iter()
                .map(|octet| format!("{:02x}", octet.as_u64().unwrap()));
            assert_eq!(&octets.collect::<String>(), digits, "{at}");
        }
        (Type::Array { element, .. }, Value::Array(typed), Value::Array(ours)) => {
            assert_eq!(typed.len(), ours.len(), "{at}");
            for (index, (typed, ours)) in typed.iter().zip(ours).enumerate() {
                same(element, typed, ours, &format!("{at}.{index}"));
            }
        }
        _ => assert_eq!(typed, ours, "{at}"),
    }
}

#[test]
fn random_messages_of_every_type_agree() {
    let decoders = decoders();
    assert_eq!(decoders.len(), lgvi_msgs::message_types().len());
    for known in lgvi_msgs::message_types() {
        let message = Message::parse(known.name, known.definition).unwrap();
        for seed in 0..40 {
            let payload = Writer::message(&message, seed, seed % 2 == 1);
            let ours =
                json(&message, &payload).unwrap_or_else(|error| panic!("{}: {error}", known.name));
            let typed = decoders[known.name](&payload);
            same(&Type::Message(message.clone()), &typed, &ours, known.name);
        }
    }
}

#[test]
fn every_message_of_the_reference_bags_agrees() {
    let bags = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../bags");
    let decoders = decoders();
    let mut compared = 0;
    for entry in std::fs::read_dir(bags).unwrap() {
        let path = entry.unwrap().path();
        if !path.join("metadata.yaml").exists() {
            continue;
        }
        let bag = BagReader::open(&path).unwrap();
        let parse = |topic: &lgvi_bag::Topic| {
            let message = Message::parse(&topic.type_name, &topic.definition).unwrap();
            (topic.name.clone(), message)
        };
        let messages: BTreeMap<_, _> = bag.topics().iter().map(parse).collect();
        for record in bag.messages() {
            let record = record.unwrap();
            let message = &messages[&record.topic.name];
            let ours = json(message, &record.data).unwrap();
            let typed = decoders[&*record.topic.type_name](&record.data);
            same(
                &Type::Message(message.clone()),
                &typed,
                &ours,
                &record.topic.name,
            );
            compared += 1;
        }
    }
    assert!(compared > 2000, "{compared}");
}
