//! Columns of topics.

use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

use lgvi_bag::{BagOptions, BagReader, BagWriter};
use parquet::file::reader::{FileReader, SerializedFileReader};

use super::bags::{bag, csv, files, options, topic};
use super::little_endian;
use crate::convert::convert_within;
use crate::{Conversion, ConvertError, Format, convert};

const SEQUENCE: &str = "int16[] xs";

#[test]
fn arrays_of_one_length_are_spread() {
    let text = csv(
        SEQUENCE,
        &[b"\x02\0\0\0\x01\0\x02\0", b"\x02\0\0\0\xff\xff\x04\0"],
    );
    let expected = "log_time,publish_time,sequence,xs.0,xs.1\n1000,900,0,1,2\n1001,901,1,-1,4\n";
    assert_eq!(text, expected);
}

#[test]
fn arrays_of_several_lengths_are_one_column() {
    let text = csv(SEQUENCE, &[b"\x02\0\0\0\x01\0\x02\0", b"\0\0\0\0"]);
    assert!(
        text.ends_with(",xs\n1000,900,0,\"[1,2]\"\n1001,901,1,[]\n"),
        "{text}"
    );
}

#[test]
fn arrays_that_are_empty_or_long_are_one_column() {
    assert!(csv(SEQUENCE, &[b"\0\0\0\0"]).ends_with(",xs\n1000,900,0,[]\n"));
    assert!(csv("bool[4] xs", &[&[1, 0, 0, 1]]).ends_with("\"[true,false,false,true]\"\n"));
    assert!(
        csv("bool[3] xs", &[&[1, 0, 0]])
            .ends_with(",xs.0,xs.1,xs.2\n1000,900,0,true,false,false\n")
    );
}

#[test]
fn a_topic_without_messages_has_a_heading() {
    let text = csv("int16[] xs\nint8[2] ys", &[]);
    assert_eq!(text, "log_time,publish_time,sequence,xs,ys.0,ys.1\n");
}

#[test]
fn bytes_are_hexadecimal() {
    let text = csv("byte[] a\nchar[2] b", &[b"\x01\0\0\0\x0f\xff\x00"]);
    assert!(text.ends_with(",a,b\n1000,900,0,0f,ff00\n"), "{text}");
}

#[test]
fn lists_of_messages_are_json() {
    let definition = "B[] bs\n==========\nMSG: pkg/B\nstring s\nbyte[] b\nfloat32 x";
    let element = b"\x03\0\0\0\"\n\0\0\x01\0\0\0\xab\0\0\0\0\0\xc0\x7f";
    let text = csv(
        definition,
        &[b"\0\0\0\0", &[b"\x01\0\0\0", &element[..]].concat()],
    );
    let json = r#""[{""s"":""\""\n"",""b"":""ab"",""x"":""NaN""}]""#;
    assert!(
        text.ends_with(&format!(",bs\n1000,900,0,[]\n1001,901,1,{json}\n")),
        "{text}"
    );
    // With equal lengths, they are spread, and so are their elements.
    let text = csv(definition, &[&[b"\x01\0\0\0", &element[..]].concat()]);
    assert!(
        text.ends_with(",bs.0.s,bs.0.b,bs.0.x\n1000,900,0,\"\"\"\n\",ab,NaN\n"),
        "{text}"
    );
}

#[test]
fn fields_keep_their_names_before_the_bags_own() {
    let text = csv("uint8 sequence\nuint8 log_time", &[&[7, 8]]);
    assert_eq!(
        text,
        "_log_time,publish_time,_sequence,sequence,log_time\n1000,900,0,7,8\n"
    );
}

#[test]
fn numbers_survive() {
    for value in [
        0.1,
        -0.0,
        1e300,
        5e-324,
        f64::MAX,
        f64::NAN,
        f64::INFINITY,
        f64::NEG_INFINITY,
    ] {
        let text = csv("float64 x", &[&value.to_le_bytes()]);
        let cell = text.trim_end().rsplit(',').next().unwrap();
        let read: f64 = cell.parse().unwrap();
        assert_eq!(read.to_bits(), value.to_bits(), "{cell}");
    }
    assert!(csv("float32 x", &[&0.1_f32.to_le_bytes()]).ends_with(",0.1\n"));
    assert!(csv("uint64 x", &[&[0xff; 8]]).ends_with(",18446744073709551615\n"));
}

/// Creates a bag of three topics: a valid one, one with a malformed message, and one with a definition in another
/// language.
fn partly_good(directory: &Path) -> BagReader {
    let path = directory.join("bag");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    let names = ["/good", "/bad", "/other_language"];
    let definitions = ["bool x", "bool x", "module pkg {"];
    for (index, (name, definition)) in names.into_iter().zip(definitions).enumerate() {
        let id = writer.add_topic(&topic(name, definition)).unwrap();
        let payload = little_endian(&[u8::try_from(2 * index).unwrap()]);
        writer.write(id, 5, 5, 0, &payload).unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    BagReader::open(&path).unwrap()
}

#[test]
fn what_cannot_be_read_is_left_out_and_told() {
    let directory = tempfile::tempdir().unwrap();
    let bag = partly_good(directory.path());
    for format in [Format::Csv, Format::Parquet] {
        let output = directory.path().join(format.name());
        let Conversion {
            files: made,
            left_out,
        } = convert(&bag, &output, &options(format)).unwrap();
        assert_eq!(made.len(), 1);
        assert_eq!((&*made[0].topic, made[0].rows), ("/good", 1));
        assert_eq!(files(&output), [format!("good.{}", format.name())]);
        let reasons: Vec<_> = left_out
            .iter()
            .map(|left| (&*left.topic, &*left.reason))
            .collect();
        let bad = "message at 5 ns: x: truth value 2, expected 0 or 1";
        let other = "definition, line 1: expected the end of the line, found \"{\"";
        assert_eq!(reasons, [("/bad", bad), ("/other_language", other)]);
    }
}

#[test]
fn names_that_are_too_long_and_definitions_that_are_missing_are_left_out() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("bag");
    let longest = format!("/{}", "x".repeat(236));
    let long = format!("{longest}x");
    let mut writer = BagWriter::create(&path, BagOptions::default()).unwrap();
    let mut opaque = topic("/opaque", "");
    opaque.definition_encoding = String::new();
    let nothing = topic("/nothing", "");
    let topics = [
        (topic(&longest, "bool x"), 0),
        (topic(&long, "bool x"), 0),
        (opaque, 0),
        (nothing, 0),
        (topic("/undefined", ""), 8),
    ];
    for (topic, further) in topics {
        let id = writer.add_topic(&topic).unwrap();
        let payload = little_endian(&vec![0; 1 + further]);
        writer.write(id, 5, 5, 0, &payload).unwrap();
    }
    writer.finish(BTreeMap::new()).unwrap();
    let bag = BagReader::open(&path).unwrap();
    for format in [Format::Csv, Format::Parquet] {
        let output = directory.path().join(format.name());
        let made = convert(&bag, &output, &options(format)).unwrap();
        let topics: Vec<_> = made.files.iter().map(|file| &*file.topic).collect();
        assert_eq!(topics, ["/nothing", &longest]);
        let left_out = made.left_out.iter();
        let left_out: Vec<_> = left_out.map(|left| (&*left.topic, &*left.reason)).collect();
        let too_long = "its name is too long for a file's: 237 bytes, expected at most 236";
        let missing = "it has no definition";
        assert_eq!(
            left_out,
            [
                ("/opaque", missing),
                ("/undefined", missing),
                (&*long, too_long)
            ]
        );
    }
}

#[test]
fn topics_are_chosen_by_name() {
    let directory = tempfile::tempdir().unwrap();
    let bag = partly_good(directory.path());
    let mut options = options(Format::Csv);
    options.topics = vec!["/good".to_owned()];
    let made = convert(&bag, &directory.path().join("good"), &options).unwrap();
    assert_eq!((made.files.len(), made.left_out.len()), (1, 0));
    options.topics.push("/missing".to_owned());
    let output = directory.path().join("missing");
    let error = convert(&bag, &output, &options).unwrap_err();
    assert!(matches!(&error, ConvertError::UnknownTopic { topic, .. } if topic == "/missing"));
    assert!(!output.exists());
}

#[test]
fn nothing_is_overwritten() {
    let directory = tempfile::tempdir().unwrap();
    let bag = partly_good(directory.path());
    let file: PathBuf = directory.path().join("file");
    fs::write(&file, "precious").unwrap();
    for output in [directory.path(), &*file] {
        let error = convert(&bag, output, &options(Format::Csv)).unwrap_err();
        assert!(matches!(error, ConvertError::Exists { .. }), "{error}");
    }
    assert_eq!(fs::read_to_string(&file).unwrap(), "precious");
    let empty = directory.path().join("empty");
    fs::create_dir(&empty).unwrap();
    convert(&bag, &empty, &options(Format::Csv)).unwrap();
}

#[test]
fn attempts_that_are_ended_leave_no_tables() {
    let directory = tempfile::tempdir().unwrap();
    let bag = partly_good(directory.path());
    let output = directory.path().join("tables");
    let made = convert(&bag, &output, &options(Format::Csv)).unwrap();
    assert!(made.files.iter().all(|file| file.file.starts_with(&output)));
    assert_eq!(fs::read_dir(&output).unwrap().count(), made.files.len());
    fs::remove_dir_all(&output).unwrap();

    let file = bag.files().next().unwrap().path;
    let mut bytes = fs::read(file).unwrap();
    let chunk = bytes.windows(4).position(|four| four == b"zstd").unwrap();
    bytes[chunk + 20] ^= 1;
    fs::write(file, bytes).unwrap();
    let error = convert(&bag, &output, &options(Format::Csv)).unwrap_err();
    assert!(matches!(error, ConvertError::Bag(_)), "{error}");
    let names = fs::read_dir(directory.path()).unwrap().flatten();
    let mut names = names.map(|entry| entry.file_name().into_string().unwrap());
    assert!(names.all(|name| !name.starts_with("tables")));
}

/// Reads a file with the crate that has written it. `check_tables.py` uses another reader.
fn parquet(file: &Path) -> (usize, Vec<String>) {
    let reader = SerializedFileReader::new(fs::File::open(file).unwrap()).unwrap();
    let rows = reader.get_row_iter(None).unwrap();
    let rows = rows.map(|row| row.unwrap().to_string()).collect();
    (reader.metadata().num_row_groups(), rows)
}

#[test]
fn rows_are_the_same_however_many_are_in_memory() {
    let directory = tempfile::tempdir().unwrap();
    let bodies: Vec<Vec<u8>> = (0..200_u32)
        .map(|index| {
            let count = index % 4;
            let numbers = (0..count).flat_map(|number| (index + number).to_le_bytes());
            let text = [&6_u32.to_le_bytes()[..], b"abcde\0"].concat();
            let numbers: Vec<u8> = count.to_le_bytes().into_iter().chain(numbers).collect();
            [numbers, text].concat()
        })
        .collect();
    let bodies: Vec<&[u8]> = bodies.iter().map(|body| &**body).collect();
    let bag = bag(directory.path(), "uint32[] xs\nstring s", &bodies);
    let [whole, parts] = [usize::MAX, 1_000].map(|buffered| {
        let output = directory.path().join(buffered.to_string());
        let made = convert_within(&bag, &output, &options(Format::Parquet), buffered).unwrap();
        assert_eq!(made.files[0].rows, 200);
        parquet(&output.join("topic.parquet"))
    });
    assert_eq!((whole.0, whole.1.len()), (1, 200));
    assert!((10..30).contains(&parts.0), "{} row groups", parts.0);
    assert_eq!(whole.1, parts.1);
    assert!(
        whole.1[3].contains("xs: [3, 4, 5], s: \"abcde\""),
        "{}",
        whole.1[3]
    );
}
