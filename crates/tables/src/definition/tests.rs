use super::*;

fn kinds(message: &Message) -> Vec<(&str, &Type)> {
    let fields = message.fields.iter();
    fields.map(|field| (&*field.name, &field.kind)).collect()
}

fn array(element: Type, length: Length) -> Type {
    Type::Array {
        element: Box::new(element),
        length,
    }
}

fn text(wide: bool, bound: Option<usize>) -> Type {
    Type::Text(Text { wide, bound })
}

const ODD: &str = "\
# A comment, and an empty line

bool    flag true   # default and comment
byte b 255
char c 'x'
uint8 LIMIT=3
string<=5 NAME = \"a # b\"
float32[] ratios [1.0, -2.5e3]
int16[3] fixed
uint64[<=4] bounded
string name \"it is = # odd\"
string<=12 short#comment
wstring wide
wstring<=2[<=7] wides
Inner inner
other/msg/Thing[2] things
builtin_interfaces/Time stamp
================================================================================
MSG: pkg/Inner
float64 x
Empty nothing
================================================================================
MSG: pkg/Empty
uint8 ONLY_A_CONSTANT=1
================================================================================
MSG: other/Thing
int8 x 0
duration/Of of
================================================================================
MSG: duration/Of
int64 ns
";

#[test]
fn all_of_the_language_is_understood() {
    let message = Message::parse("pkg/msg/Odd", ODD).unwrap();
    let found = kinds(&message);
    let number = |number| Type::Number(number);
    let expected = [
        ("flag", number(Number::Bool)),
        ("b", number(Number::Uint8)),
        ("c", number(Number::Uint8)),
        ("ratios", array(number(Number::Float32), Length::Unbounded)),
        ("fixed", array(number(Number::Int16), Length::Fixed(3))),
        ("bounded", array(number(Number::Uint64), Length::Bounded(4))),
        ("name", text(false, None)),
        ("short", text(false, Some(12))),
        ("wide", text(true, None)),
        ("wides", array(text(true, Some(2)), Length::Bounded(7))),
    ];
    for ((name, kind), (found_name, found_kind)) in expected.iter().zip(&found) {
        assert_eq!((name, kind), (found_name, *found_kind));
    }
    let [
        ..,
        ("inner", Type::Message(inner)),
        things,
        ("stamp", Type::Message(stamp)),
    ] = &found[..]
    else {
        panic!("{found:?}")
    };
    assert_eq!(found.len(), 13);
    let [
        ("x", Type::Number(Number::Float64)),
        ("nothing", Type::Message(empty)),
    ] = kinds(inner)[..]
    else {
        panic!("{inner:?}")
    };
    assert!(empty.fields.is_empty() && empty.least == 1);
    assert!(matches!(
        things,
        (
            "things",
            Type::Array {
                length: Length::Fixed(2),
                ..
            }
        )
    ));
    assert_eq!(things.1.least(), 18);
    let stamp = kinds(stamp);
    assert_eq!(stamp[0], ("sec", &number(Number::Int32)));
    assert_eq!(stamp[1], ("nanosec", &number(Number::Uint32)));
}

#[test]
fn a_first_message_may_be_named_like_the_others() {
    let definition = format!("{}\nMSG: pkg/A\nint8 x\n", "=".repeat(80));
    let message = Message::parse("pkg/msg/A", &definition).unwrap();
    assert_eq!(kinds(&message), [("x", &Type::Number(Number::Int8))]);
}

#[test]
fn every_known_definition_is_understood() {
    for known in lgvi_msgs::message_types() {
        Message::parse(known.name, known.definition).expect(known.name);
    }
}

#[track_caller]
fn refused(definition: &str, fragment: &str) {
    let error = Message::parse("pkg/msg/A", definition).unwrap_err();
    assert!(error.to_string().contains(fragment), "{error}");
}

#[test]
fn what_is_no_definition_is_refused_by_its_line() {
    refused("int8 x\nint8 x", "line 2: a second field x");
    refused("int8", "line 1: expected a type and a name");
    refused("int8[0] x", "expected a type, found \"int8[0]\"");
    refused("int8[-1] x", "expected a type");
    refused("int8[99999999999999999999] x", "expected a type");
    refused("int8[3 x", "expected a type");
    refused("int8<=3 x", "expected a type");
    refused("string<=x x", "expected a type");
    refused("a//b x", "expected a type");
    refused("int8 x.y", "expected a field's name");
    refused("int8 9x", "expected a field's name");
    refused("---", "expected a type and a name");
    refused("module pkg {", "expected the end of the line, found \"{\"");
    refused("==========\nIDL: pkg/msg/A", "line 2: expected MSG:");
    refused("B b", "no text of pkg/B, which pkg/A needs");
}

#[test]
fn a_message_cannot_contain_itself() {
    refused("A a", "pkg/A → pkg/A");
    refused("pkg/msg/A[] a", "pkg/A → pkg/A");
    let definition = "B b\n==========\nMSG: pkg/B\nC[<=2] c\n==========\nMSG: pkg/C\nB b";
    refused(definition, "pkg/B → pkg/C → pkg/B");
}

/// Returns a definition of `pkg/A` with fields of the types `M<index>`, each of which contains the previous one.
fn nested(fields: &[usize], count: usize) -> String {
    let fields = fields.iter().map(|index| format!("M{index} m{index}\n"));
    let messages = (0..count).map(|index| {
        let inner = index.checked_sub(1);
        let inner = inner.map_or("int8 x".to_owned(), |inner| format!("M{inner} m"));
        format!("==========\nMSG: pkg/M{index}\n{inner}\n")
    });
    fields.chain(messages).collect()
}

#[test]
fn depth_is_bounded_whichever_message_is_met_first() {
    for count in [MAX_DEPTH - 1, MAX_DEPTH, 1000] {
        let ascending: Vec<_> = (0..count).collect();
        for fields in [ascending, vec![count - 1]] {
            let parsed = Message::parse("pkg/msg/A", &nested(&fields, count));
            if count < MAX_DEPTH {
                parsed.unwrap();
            } else {
                assert!(matches!(parsed, Err(DefinitionError::TooDeep { .. })));
            }
        }
    }
}
