//! Arrays with more elements than there may be columns.

use super::little_endian;
use crate::definition::Message;
use crate::layout::{Layout, MAX_COLUMNS};

const POINTS: &str = "\
B[] bs
==========
MSG: pkg/B
P[] ps
==========
MSG: pkg/P
float32 x
float32 y
float32 z
";

/// Returns a message of [`POINTS`] with these numbers of points in its elements.
fn points(lengths: &[usize]) -> Vec<u8> {
    let length = |length: usize| u32::try_from(length).unwrap().to_le_bytes();
    let elements = lengths
        .iter()
        .flat_map(|points| [&length(*points)[..], &vec![0; 12 * points]].concat());
    let body: Vec<u8> = length(lengths.len()).into_iter().chain(elements).collect();
    little_endian(&body)
}

fn columns<'m>(
    definition: &str,
    elements: usize,
    messages: impl IntoIterator<Item = &'m Vec<u8>>,
) -> Vec<String> {
    let message = Message::parse("pkg/msg/A", definition).unwrap();
    let mut layout = Layout::new(message, elements).unwrap();
    let messages: Vec<_> = messages.into_iter().collect();
    for payload in &messages {
        layout.observe(payload).unwrap();
    }
    layout.finish().unwrap();
    let columns = layout.columns().into_iter().map(|column| column.name);
    let columns: Vec<_> = columns.collect();
    for payload in messages {
        assert_eq!(layout.cells(payload).unwrap().len(), columns.len());
    }
    columns
}

/// Returns the columns after checking that they are the same in either order of two messages.
fn either_order(definition: &str, elements: usize, messages: [Vec<u8>; 2]) -> Vec<String> {
    let found = columns(definition, elements, &messages);
    let reversed = columns(definition, elements, messages.iter().rev());
    assert_eq!(found, reversed);
    found
}

#[test]
fn as_many_elements_are_spread_as_there_may_be_columns() {
    let found = columns(POINTS, 64, [&points(&[60; 50])]);
    assert_eq!(found.len(), 9_000);
    assert_eq!(found[9_000 - 1], "bs.49.ps.59.z");

    for (count, expected) in [(MAX_COLUMNS, MAX_COLUMNS), (MAX_COLUMNS + 1, 1)] {
        let length = u32::try_from(count).unwrap().to_le_bytes();
        let message = little_endian(&[&length[..], &vec![0; count]].concat());
        assert_eq!(columns("bool[] xs", usize::MAX, [&message]).len(), expected);
    }
}

#[test]
fn arrays_that_find_no_room_are_one_column_from_the_innermost_on() {
    let found = columns(POINTS, 64, [&points(&[60; 60])]);
    assert_eq!(found.len(), 60);
    assert_eq!(found[59], "bs.59.ps");
}

#[test]
fn arrays_of_several_lengths_take_no_room() {
    let [long, longer] = [60, 61].map(|count| points(&vec![60; count]));
    assert_eq!(either_order(POINTS, 64, [long, longer]), ["bs"]);

    let mut lengths = vec![60; 60];
    let same = points(&lengths);
    lengths[..10].fill(59);
    let found = either_order(POINTS, 64, [same, points(&lengths)]);
    assert_eq!(found.len(), 10 + 50 * 60 * 3);
    assert_eq!((&*found[9], &*found[10]), ("bs.9.ps", "bs.10.ps.0.x"));

    let two = |xs: usize| {
        let [first, second] = [xs, 6_000].map(|count| {
            let length = u32::try_from(count).unwrap().to_le_bytes();
            [&length[..], &vec![0; count]].concat()
        });
        little_endian(&[first, second].concat())
    };
    let definition = "bool[] xs\nbool[] ys";
    assert_eq!(columns(definition, 6_000, [&two(6_000)]), ["xs", "ys"]);
    let found = either_order(definition, 6_000, [two(6_000), two(5_996)]);
    assert_eq!(found.len(), 1 + 6_000);
    assert_eq!((&*found[0], &*found[6_000]), ("xs", "ys.5999"));
}

/// The large message alone exceeds the limit on shapes.
#[test]
fn huge_messages_make_no_difference_by_their_place() {
    let definition = "\
C[2] cs
==========
MSG: pkg/C
B[] bs
D[2] ds
==========
MSG: pkg/B
bool[] xs
==========
MSG: pkg/D
bool[4] ys
";
    let message = |bs: usize, xs: usize| {
        let length = |length: usize| u32::try_from(length).unwrap().to_le_bytes();
        // Multiples of four, so that lengths are aligned.
        let element = [&length(xs)[..], &vec![0; xs]].concat();
        let c = [&length(bs)[..], &element.repeat(bs), &[0; 8]].concat();
        little_endian(&c.repeat(2))
    };
    let small = message(1, 4);
    let found = columns(definition, 300, [&small]);
    assert_eq!(found.len(), 2 * (4 + 8));
    let found = either_order(definition, 300, [small, message(300, 300)]);
    let expected = ["bs", "ds.0.ys", "ds.1.ys"];
    let expected = (0..2).flat_map(|c| expected.map(|name| format!("cs.{c}.{name}")));
    assert_eq!(found, expected.collect::<Vec<_>>());
}
