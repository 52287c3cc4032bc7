use std::ops::Range;
use std::sync::Arc;

use parquet::basic::{Compression, LogicalType, Repetition, Type as Physical, ZstdLevel};
use parquet::data_type::{ByteArray, ByteArrayType, DoubleType, Int64Type};
use parquet::errors::Result as Parquet;
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::{SerializedFileWriter, SerializedRowGroupWriter};
use parquet::schema::types::Type;
use sha2::{Digest, Sha256};

use crate::{Identity, Row};

/// Largest and smallest number of samples in a part.
const LARGEST: u64 = 1024;
const SMALLEST: u64 = 32;

/// Maximum number of steps of all bodies in a part, except for the smallest parts: a measure of time that does not depend on
/// the clock. One core takes seconds for them in lanes, and minutes where steps are dear.
const STEPS: u64 = 1 << 26;

/// Returns the number of samples in a part if a flight has this number of steps of all bodies. Parts begin and end at
/// its multiples.
pub(crate) fn size(steps: u64) -> u64 {
    let fitting = (STEPS / steps.max(1)).clamp(SMALLEST, LARGEST);
    1 << fitting.ilog2()
}

/// Columns that precede the numbers.
pub(crate) const FIRST: [&str; 4] = ["index", "steps", "failure", "message"];

/// Splits the range into parts at the multiples of `size`.
pub(crate) fn parts(range: Range<u64>, size: u64) -> impl Iterator<Item = Range<u64>> {
    let mut start = range.start;
    std::iter::from_fn(move || {
        let end = (start / size + 1).saturating_mul(size).min(range.end);
        let part = (start < end).then_some(start..end);
        start = end;
        part
    })
}

/// Returns the file name of a part.
pub(crate) fn file_name(range: &Range<u64>) -> String {
    format!("samples_{:010}_{:010}.parquet", range.start, range.end)
}

/// Returns the samples of the part with this file name, or `None` for other files.
pub(crate) fn range_of(name: &str) -> Option<Range<u64>> {
    let numbers = name.strip_prefix("samples_")?.strip_suffix(".parquet")?;
    let (start, end) = numbers.split_once('_')?;
    let range = start.parse().ok()?..end.parse().ok()?;
    (range.start < range.end && file_name(&range) == name).then_some(range)
}

/// Returns the contents of the file of a part.
pub(crate) fn encode(identity: &Identity, columns: &[String], rows: &[Row]) -> Parquet<Vec<u8>> {
    let properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_key_value_metadata(Some(metadata(identity, columns, rows)))
        .build();
    let schema = schema(columns)?;
    let mut writer = SerializedFileWriter::new(Vec::new(), schema, Arc::new(properties))?;
    let mut group = writer.next_row_group()?;
    let text = |text: &str| ByteArray::from(text);
    let indices: Vec<_> = rows.iter().map(|row| row.index.cast_signed()).collect();
    write_column::<Int64Type>(&mut group, &indices)?;
    let steps: Vec<_> = rows.iter().map(|row| row.steps.cast_signed()).collect();
    write_column::<Int64Type>(&mut group, &steps)?;
    let failures = || rows.iter().map(|row| row.failure.as_ref());
    let kinds = failures().map(|failure| text(failure.map_or("", |failure| failure.kind.name())));
    write_column::<ByteArrayType>(&mut group, &kinds.collect::<Vec<_>>())?;
    let messages = failures().map(|failure| text(failure.map_or("", |f| f.message.as_str())));
    write_column::<ByteArrayType>(&mut group, &messages.collect::<Vec<_>>())?;
    for column in 0..columns.len() {
        let numbers: Vec<_> = rows.iter().map(|row| row.numbers[column]).collect();
        write_column::<DoubleType>(&mut group, &numbers)?;
    }
    group.close()?;
    writer.into_inner()
}

fn write_column<T: parquet::data_type::DataType>(
    group: &mut SerializedRowGroupWriter<'_, Vec<u8>>,
    values: &[T::T],
) -> Parquet<()> {
    if let Some(mut column) = group.next_column()? {
        column.typed::<T>().write_batch(values, None, None)?;
        column.close()?;
    }
    Ok(())
}

/// Returns the metadata of a part about its ensemble, as keys and values.
pub(crate) fn entries(identity: &Identity) -> [(&'static str, String); 7] {
    [
        ("lgvi.identity", identity.hash.clone()),
        ("lgvi.scene", identity.scene.clone()),
        ("lgvi.seed", identity.seed.to_string()),
        ("lgvi.samples", identity.samples.to_string()),
        ("lgvi.integrator", identity.scheme.clone()),
        ("lgvi.version", identity.version.clone()),
        ("lgvi.part", identity.part.to_string()),
    ]
}

/// The metadata key of the [`checksum`].
pub(crate) const CHECKSUM: &str = "lgvi.checksum";

/// Returns the SHA-256 of all contents of a part.
pub(crate) fn checksum(identity: &Identity, columns: &[String], rows: &[Row]) -> String {
    let mut hash = Sha256::new();
    let text = |hash: &mut Sha256, text: &str| {
        hash.update((text.len() as u64).to_le_bytes());
        hash.update(text);
    };
    for (_, entry) in entries(identity) {
        text(&mut hash, &entry);
    }
    for column in columns {
        text(&mut hash, column);
    }
    for row in rows {
        hash.update(row.index.to_le_bytes());
        hash.update(row.steps.to_le_bytes());
        let failure = row.failure.as_ref();
        text(&mut hash, failure.map_or("", |failure| failure.kind.name()));
        text(&mut hash, failure.map_or("", |failure| &failure.message));
        for number in &row.numbers {
            hash.update(number.to_bits().to_le_bytes());
        }
    }
    hexadecimal(&hash.finalize())
}

/// Formats bytes in lower-case hexadecimal.
pub(crate) fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

fn metadata(identity: &Identity, columns: &[String], rows: &[Row]) -> Vec<KeyValue> {
    let checksum = (CHECKSUM, checksum(identity, columns, rows));
    let entries = entries(identity).into_iter().chain([checksum]);
    entries
        .map(|(key, value)| KeyValue::new(key.to_owned(), Some(value)))
        .collect()
}

fn schema(columns: &[String]) -> Parquet<Arc<Type>> {
    let leaf = |name: &str, physical, logical| {
        let leaf = Type::primitive_type_builder(name, physical)
            .with_repetition(Repetition::REQUIRED)
            .with_logical_type(logical);
        leaf.build().map(Arc::new)
    };
    let whole = || Some(LogicalType::integer(64, false));
    let [index, steps, failure, message] = FIRST;
    let mut fields = vec![
        leaf(index, Physical::INT64, whole())?,
        leaf(steps, Physical::INT64, whole())?,
        leaf(failure, Physical::BYTE_ARRAY, Some(LogicalType::String))?,
        leaf(message, Physical::BYTE_ARRAY, Some(LogicalType::String))?,
    ];
    for column in columns {
        fields.push(leaf(column, Physical::DOUBLE, None)?);
    }
    let schema = Type::group_type_builder("samples").with_fields(fields);
    Ok(Arc::new(schema.build()?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_cut_at_multiples_whatever_the_range() {
        for size in [32, 1024] {
            let cut = |range| -> Vec<_> {
                let parts = parts(range, size);
                parts.map(|part| (part.start, part.end)).collect()
            };
            assert_eq!(cut(0..size), [(0, size)]);
            assert_eq!(cut(5..size + 7), [(5, size), (size, size + 7)]);
            assert_eq!(cut(2 * size..2 * size + 1), [(2 * size, 2 * size + 1)]);
            assert!(cut(3..3).is_empty());
        }
    }

    #[test]
    fn parts_are_smaller_where_samples_are_dear() {
        for (steps, samples) in [
            (0, 1024),
            (30_000, 1024),
            (STEPS / 1024, 1024),
            (STEPS / 1024 + 1, 512),
            (1_000_000, 64),
            (STEPS / 32 + 1, 32),
            (u64::MAX, 32),
        ] {
            assert_eq!(size(steps), samples, "{steps} steps");
        }
    }

    #[test]
    fn files_are_named_by_what_they_have() {
        let range = 1024..2048;
        assert_eq!(range_of(&file_name(&range)), Some(range));
        for name in [
            "samples_1_2.parquet",
            "samples_0000000002_0000000001.parquet",
            "a.parquet",
        ] {
            assert_eq!(range_of(name), None);
        }
    }
}
