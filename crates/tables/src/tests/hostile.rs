//! Malformed payloads.

use super::random::Writer;
use super::{json, little_endian};
use crate::cdr::{DecodeError, Fault};
use crate::definition::Message;
use crate::layout::{Layout, LayoutError};

fn decode(definition: &str, body: &[u8]) -> Result<serde_json::Value, DecodeError> {
    let message = Message::parse("pkg/msg/A", definition).unwrap();
    json(&message, &little_endian(body))
}

#[track_caller]
fn refused(definition: &str, body: &[u8], expected: &str) {
    let error = decode(definition, body).unwrap_err().to_string();
    assert_eq!(error, expected);
}

const NESTED: &str = "B[] bs\n==========\nMSG: pkg/B\nstring name\nint16[2] xs";

#[test]
fn faults_are_named_by_field() {
    refused(
        "uint32 x",
        &[0; 3],
        "x: needs 4 bytes at byte 4, 3 are left",
    );
    refused("bool x", &[2], "x: truth value 2, expected 0 or 1");
    refused(
        "bool[] x",
        &[2, 0, 0, 0, 1, 7],
        "x: truth value 7, expected 0 or 1",
    );
    refused(
        "uint8[<=2] x",
        &[3, 0, 0, 0, 1, 1, 1],
        "x: length 3, expected at most 2",
    );
    refused(
        "string x",
        b"\x02\0\0\0ab",
        "x: text of 2 bytes does not end with a zero",
    );
    refused(
        "string<=1 x",
        b"\x03\0\0\0ab\0",
        "x: length 2, expected at most 1",
    );
    refused(
        "string x",
        b"\x03\0\0\0a\xff\0",
        "x: text is not valid Unicode after 1 bytes or units",
    );
    refused(
        "uint8 x",
        &[0; 5],
        "ends after 5 of 9 bytes, expected at most 3 bytes of padding",
    );
    let body = b"\x01\0\0\0\x02\0\0\0a\0\x01\0\x02";
    refused(
        NESTED,
        body,
        "bs.0.xs: needs 4 bytes at byte 14, 3 are left",
    );
}

#[test]
fn absurd_lengths_are_refused_before_anything_is_made() {
    for length in [u32::MAX, 1 << 30, 1000] {
        let body = length.to_le_bytes();
        for definition in [
            "uint8[] x",
            "float64[] x",
            "string x",
            "wstring x",
            "string[] x",
        ] {
            let Err(DecodeError { path, fault }) = decode(definition, &body) else {
                panic!("{definition}");
            };
            assert_eq!(path, "x");
            assert!(
                matches!(fault, Fault::Short { .. }),
                "{definition}: {fault}"
            );
        }
        let error = decode(NESTED, &body).unwrap_err();
        assert!(
            matches!(error.fault, Fault::Short { left: 0, .. }),
            "{error}"
        );
    }
    let huge = format!(
        "uint8[{0}] x\nB[{0}] y\n==========\nMSG: pkg/B\nstring[{0}] z",
        usize::MAX
    );
    assert!(matches!(
        decode(&huge, &[]).unwrap_err().fault,
        Fault::Short { .. }
    ));
}

#[test]
fn other_encapsulations_are_refused() {
    let message = Message::parse("pkg/msg/A", "uint8 x").unwrap();
    for (payload, expected) in [
        (
            &[][..],
            "0 bytes are too few for the encapsulation header of 4",
        ),
        (
            &[0, 1, 0],
            "3 bytes are too few for the encapsulation header of 4",
        ),
        (
            &[0, 7, 0, 0, 1],
            "encapsulation 0x0007, expected plain CDR: 0x0000 or 0x0001",
        ),
    ] {
        assert_eq!(json(&message, payload).unwrap_err().to_string(), expected);
    }
}

#[test]
fn an_empty_message_has_an_octet_or_nothing() {
    assert_eq!(decode("", &[]).unwrap(), serde_json::json!({}));
    assert_eq!(decode("uint8 X=1", &[0]).unwrap(), serde_json::json!({}));
    let nested = "B b\nuint8 x\n==========\nMSG: pkg/B";
    assert_eq!(
        decode(nested, &[0, 5]).unwrap(),
        serde_json::json!({"b": {}, "x": 5})
    );
}

#[test]
fn wide_text_is_utf_16_in_four_bytes_a_unit() {
    let unit = |unit: u32| unit.to_le_bytes();
    let body = [unit(4), unit(0xe9), unit(0xd83d), unit(0xde00), unit(0x61)].concat();
    assert_eq!(
        decode("wstring x", &body).unwrap(),
        serde_json::json!({"x": "é😀a"})
    );
    let half = [unit(2), unit(0x61), unit(0xd83d)].concat();
    refused(
        "wstring x",
        &half,
        "x: text is not valid Unicode after 1 bytes or units",
    );
    let beyond = [unit(1), unit(0x1_0000)].concat();
    refused(
        "wstring x",
        &beyond,
        "x: text is not valid Unicode after 0 bytes or units",
    );
    refused("wstring<=3 x", &body, "x: length 4, expected at most 3");
}

#[test]
fn truncated_and_altered_payloads_never_panic() {
    let mut random = fastrand::Rng::with_seed(7);
    for known in lgvi_msgs::message_types() {
        let message = Message::parse(known.name, known.definition).unwrap();
        let payload = Writer::message(&message, 3, false);
        for length in 0..payload.len() {
            let cut = json(&message, &payload[..length]);
            // An empty message may lack its octet.
            assert!(
                cut.is_err() || message.fields.is_empty(),
                "{}: {length}",
                known.name
            );
        }
        for _ in 0..50 {
            let mut altered = payload.clone();
            for _ in 0..3 {
                let at = random.usize(..altered.len());
                altered[at] = random.u8(..);
            }
            let mut layout = Layout::new(message.clone(), 64).unwrap();
            let seen = layout.observe(&altered).is_ok();
            assert_eq!(seen, json(&message, &altered).is_ok(), "{}", known.name);
            assert_eq!(seen, layout.cells(&altered).is_ok(), "{}", known.name);
        }
    }
}

/// Returns a short definition with a huge number of values: 40 messages, each containing the next.
fn growing(inner: &str) -> String {
    let text: String = (0..40)
        .map(|index| {
            let next = format!("M{}", index + 1);
            let heading = format!("==========\nMSG: pkg/M{index}\n");
            heading + &inner.replace("{next}", &next) + "\n"
        })
        .collect();
    format!("M0 m\n{text}==========\nMSG: pkg/M40\nuint8 x\n")
}

#[test]
fn definitions_that_grow_without_bound_are_refused() {
    let definition = growing("{next} a\n{next} b\n{next} c");
    let message = Message::parse("pkg/msg/A", &definition).unwrap();
    assert_eq!(Layout::new(message, 64).err(), Some(LayoutError::TooWide));
}

#[test]
fn arrays_that_grow_without_bound_are_one_column() {
    let message = Message::parse("pkg/msg/A", &growing("{next}[64] x")).unwrap();
    let mut layout = Layout::new(message, 64).unwrap();
    layout.finish().unwrap();
    assert_eq!(layout.columns().len(), 64 * 64);
    assert_eq!(layout.columns()[65].name, "m.x.1.x.1.x");
}
