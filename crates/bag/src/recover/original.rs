//! What a damaged bag says of itself, as far as it can be read.

use std::{collections::BTreeMap, path::Path};

use serde::Deserialize;

use super::RecoverError;
use crate::{
    BagError,
    metadata::{Document, RECORD, TopicWithCount, VERSION},
    regular, yaml,
};

/// What is kept of the damaged bag's description.
#[derive(Default, Deserialize)]
pub(super) struct Original {
    #[serde(default = "newest")]
    pub version: u32,
    #[serde(default)]
    storage_identifier: String,
    #[serde(default)]
    pub compression_format: String,
    #[serde(default)]
    pub compression_mode: String,
    #[serde(default)]
    pub relative_file_paths: Vec<String>,
    #[serde(default)]
    pub files: Vec<FileWithCount>,
    #[serde(default)]
    pub message_count: Option<u64>,
    #[serde(default)]
    pub custom_data: Option<BTreeMap<String, String>>,
    #[serde(default)]
    pub ros_distro: String,
    #[serde(default)]
    pub topics_with_message_count: Vec<TopicWithCount>,
}

fn newest() -> u32 {
    VERSION
}

/// A file of which the number of messages is known.
#[derive(Deserialize)]
pub(super) struct FileWithCount {
    pub path: String,
    pub message_count: u64,
}

impl Original {
    /// Reads `metadata.yaml`; an inner error says why that cannot be used.
    ///
    /// # Errors
    /// The bag is of a kind that is not recovered.
    pub fn read(file: &Path) -> Result<Result<Self, String>, RecoverError> {
        let text = match regular::bytes(file, yaml::MAX_TEXT) {
            Ok(bytes) => String::from_utf8_lossy(&bytes).into_owned(),
            Err(error) => return Ok(Err(error.to_string())),
        };
        let original = match yaml::read::<Document<Self>>(&text) {
            Ok(document) => document.rosbag2_bagfile_information,
            Err(error) => return Ok(Err(error.to_string())),
        };
        let file = file.to_owned();
        if original.storage_identifier == "sqlite3" {
            return Err(RecoverError::Kind(BagError::Storage {
                file,
                found: original.storage_identifier,
            }));
        }
        let mode = original.compression_mode.to_lowercase();
        if mode == "file" || (mode == "message" && original.compression_format != "zstd") {
            return Err(RecoverError::Kind(BagError::Compressed {
                file,
                mode: original.compression_mode,
                format: original.compression_format,
            }));
        }
        Ok(Ok(original))
    }

    /// The same from the record in a bag's file.
    pub fn of_record(metadata: &BTreeMap<String, String>) -> Option<Self> {
        let original: Self = yaml::read(metadata.get(RECORD.1)?).ok()?;
        let mode = original.compression_mode.to_lowercase();
        (mode != "message" || original.compression_format == "zstd").then_some(original)
    }
}
