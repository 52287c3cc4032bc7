//! Tables in memory.

use super::bags;
use crate::{Cells, ConvertError, read};

#[test]
fn columns_keep_their_types_and_lists_their_lengths() {
    let directory = tempfile::tempdir().unwrap();
    let definition = "uint8 a\nint16 b\nstring c\nfloat32[] d\nuint8[] e\nint8[2] f";
    let one: &[u8] = &[
        7, 0, 0xfe, 0xff, 2, 0, 0, 0, b'x', 0, 0, 0, 1, 0, 0, 0, 0, 0, 0x80, 0x3f, 2, 0, 0, 0, 5,
        6, 1, 0xff,
    ];
    let other: &[u8] = &[
        8, 0, 3, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0xfd,
    ];
    let bag = bags::bag(directory.path(), definition, &[one, other]);
    let (tables, left_out) = read(&bag, vec!["/topic".into()], 3).unwrap();
    assert_eq!(left_out, []);
    let [table] = tables.as_slice() else {
        panic!("{tables:?}");
    };
    assert_eq!((&*table.topic, &*table.type_name), ("/topic", "pkg/msg/A"));
    let expected = [
        ("log_time", Cells::Int64(vec![1_000, 1_001])),
        ("publish_time", Cells::Int64(vec![900, 901])),
        ("sequence", Cells::Uint32(vec![0, 1])),
        ("a", Cells::Uint8(vec![7, 8])),
        ("b", Cells::Int16(vec![-2, 3])),
        ("c", Cells::Text(vec!["x".into(), String::new()])),
        (
            "d",
            Cells::List(vec![Cells::Float32(vec![1.0]), Cells::Float32(vec![])]),
        ),
        ("e", Cells::Bytes(vec![vec![5, 6], vec![]])),
        ("f.0", Cells::Int8(vec![1, 2])),
        ("f.1", Cells::Int8(vec![-1, -3])),
    ];
    let expected = expected.map(|(name, cells)| (name.to_owned(), cells));
    assert_eq!(table.columns, expected);
}

#[test]
fn what_cannot_be_decoded_is_left_out_and_what_is_not_there_refused() {
    let directory = tempfile::tempdir().unwrap();
    let bag = bags::bag(directory.path(), "int32 a", &[&[1]]);
    let (tables, left_out) = read(&bag, Vec::new(), 3).unwrap();
    assert!(tables.is_empty() && left_out[0].reason.contains("needs 4 bytes"));
    let error = read(&bag, vec!["/other".into()], 3).unwrap_err();
    assert!(
        matches!(error, ConvertError::UnknownTopic { .. }),
        "{error}"
    );
}
