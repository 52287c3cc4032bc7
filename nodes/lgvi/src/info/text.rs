//! A bag's description for people.

use std::fmt::{self, Display, Formatter};
use std::path::Path;

use chrono::DateTime;

use super::{ChunkSizes, File, Info, LeftOut, TopicInfo};
use crate::output::{left_out, shown};

impl Display for Info {
    fn fmt(&self, f: &mut Formatter<'_>) -> fmt::Result {
        let complete = match (self.complete, self.checked) {
            (false, _) => " (not complete)",
            (true, true) => " (complete: all of it has been read)",
            (true, false) => " (complete by its summaries; --check reads all of it)",
        };
        let bag = shown(&self.bag);
        writeln!(f, "bag       {bag}{complete}")?;
        if let (Some(start), Some(end)) = (self.start, self.end) {
            writeln!(f, "start     {}", time(start))?;
            writeln!(f, "end       {}", time(end))?;
        }
        writeln!(f, "duration  {} s", self.duration)?;
        write!(f, "messages  {}", self.messages)?;
        if self.repeated > 0 {
            write!(
                f,
                ", and {} repeated at the head of further files",
                self.repeated
            )?;
        }
        writeln!(f)?;
        writeln!(f, "size      {}", bytes(self.bytes))?;
        for (compression, sizes) in &self.chunks {
            writeln!(f, "chunks    {}", chunks(compression, sizes))?;
        }
        for (key, value) in &self.custom {
            let value = value.lines().next().unwrap_or_default();
            let [key, value] = [key, value].map(shown);
            writeln!(f, "{key:<9} {value}")?;
        }
        writeln!(f)?;
        table(
            f,
            &["file", "size", "messages", "from the start", ""],
            |row| {
                let file = self.files.get(row)?;
                Some(self.file(file))
            },
        )?;
        writeln!(f)?;
        table(
            f,
            &[
                "topic",
                "type",
                "messages",
                "repeated",
                "lost",
                "rate",
                "quality of service",
            ],
            |row| self.topics.get(row).map(topic),
        )?;
        for LeftOut {
            name,
            type_name,
            reason,
        } in &self.left_out
        {
            writeln!(f, "{}", shown(&left_out(name, type_name, reason)))?;
        }
        for warning in &self.warnings {
            writeln!(f, "{}", shown(warning))?;
        }
        if !self.complete {
            writeln!(f)?;
            for fault in &self.faults {
                writeln!(f, "{}", shown(fault))?;
            }
            write!(
                f,
                "what is readable becomes a bag of its own: lgvi recover {bag}"
            )?;
        }
        Ok(())
    }
}

impl Info {
    fn file(&self, file: &File) -> Vec<String> {
        let name = Path::new(&file.path).file_name().unwrap_or_default();
        let since = |time: u64| time.saturating_sub(self.start.unwrap_or(time)) as f64 / 1e9;
        let span = match (file.start, file.end) {
            (Some(start), Some(end)) => format!("{} s to {} s", since(start), since(end)),
            _ => String::new(),
        };
        vec![
            name.display().to_string(),
            bytes(file.bytes),
            file.messages.to_string(),
            span,
            if file.fault.is_some() {
                "damaged or cut off"
            } else {
                ""
            }
            .to_owned(),
        ]
    }
}

fn topic(topic: &TopicInfo) -> Vec<String> {
    let some = |count: u64| {
        if count == 0 {
            String::new()
        } else {
            count.to_string()
        }
    };
    let history = match topic.history {
        "keep_last" => format!("last {}", topic.depth),
        history => history.replace('_', " "),
    };
    vec![
        topic.name.clone(),
        topic.type_name.clone(),
        topic.messages.to_string(),
        some(topic.repeated),
        topic.lost.clone().unwrap_or_default(),
        topic
            .rate
            .map_or_else(String::new, |rate| format!("{rate:.1} Hz")),
        format!("{}, {}, {history}", topic.reliability, topic.durability).replace('_', " "),
    ]
}

/// Columns as wide as what is in them, without those that are empty.
/// Columns are not padded beyond this many characters.
const WIDEST: usize = 200;

fn table(
    f: &mut Formatter<'_>,
    head: &[&str],
    row: impl Fn(usize) -> Option<Vec<String>>,
) -> fmt::Result {
    let head = head.iter().map(|title| (*title).to_owned()).collect();
    let rows = (0..).map_while(row);
    let rows = rows.map(|cells| cells.iter().map(|cell| shown(cell)).collect());
    let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).collect();
    let width = |column: usize| {
        let filled = rows.iter().skip(1).any(|row| !row[column].is_empty());
        let widths = rows.iter().map(|row| row[column].chars().count());
        filled.then(|| widths.max().unwrap_or(0))
    };
    let widths: Vec<_> = (0..rows[0].len()).map(width).collect();
    for row in &rows {
        let cells = row.iter().zip(&widths).filter_map(|(cell, width)| {
            let width = (*width)?.min(WIDEST);
            Some(format!("{cell:<width$}"))
        });
        let line = cells.collect::<Vec<_>>().join("  ");
        writeln!(f, "{}", line.trim_end())?;
    }
    Ok(())
}

fn chunks(compression: &str, sizes: &ChunkSizes) -> String {
    let ChunkSizes {
        count,
        packed,
        unpacked,
    } = *sizes;
    let ratio = unpacked as f64 / packed.max(1) as f64;
    format!(
        "{count} with compression {compression}, {} of {} ({ratio:.2} : 1)",
        bytes(packed),
        bytes(unpacked)
    )
}

/// Seconds since the UNIX epoch, and the date.
fn time(nanoseconds: u64) -> String {
    let (seconds, rest) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
    let date = i64::try_from(nanoseconds).map(DateTime::from_timestamp_nanos);
    let date = date.map_or_else(
        |_| String::new(),
        |date| date.format(" (%F %T UTC)").to_string(),
    );
    format!("{seconds}.{rest:09} s{date}")
}

fn bytes(count: u64) -> String {
    const UNITS: [&str; 5] = ["B", "KiB", "MiB", "GiB", "TiB"];
    let mut value = count as f64;
    let mut unit = 0;
    while value >= 1024.0 && unit + 1 < UNITS.len() {
        value /= 1024.0;
        unit += 1;
    }
    let digits = usize::from(unit > 0);
    format!("{value:.digits$} {}", UNITS[unit])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units() {
        for (count, expected) in [
            (0, "0 B"),
            (1023, "1023 B"),
            (1024, "1.0 KiB"),
            (1 << 30, "1.0 GiB"),
            (u64::MAX, "16777216.0 TiB"),
        ] {
            assert_eq!(bytes(count), expected);
        }
        assert_eq!(
            time(1_700_000_000_000_000_001),
            "1700000000.000000001 s (2023-11-14 22:13:20 UTC)"
        );
        assert_eq!(time(u64::MAX), "18446744073.709551615 s");
    }
}
