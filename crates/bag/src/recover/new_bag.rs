//! A bag that is made of damaged files, one after the other.

use std::{
    collections::BTreeMap,
    fs,
    path::{Path, PathBuf},
};

use super::{
    RecoverError, RecoveredFile, Recovery,
    copy::Copy,
    counts::Counts,
    definitions::Topic,
    description::Description,
    identities::Identities,
    original::Original,
    output::Output,
    source::Source,
    tally::{Tally, Told},
    twins::Twins,
};

/// The recovered bag, while it is made.
pub(super) struct NewBag {
    directory: PathBuf,
    description: Description,
    recovery: Recovery,
    /// Messages marked as repeated, by topic.
    repeated: BTreeMap<String, u64>,
    identities: Identities,
    tally: Tally,
}

impl NewBag {
    /// `told` are messages of files as other files tell them.
    pub fn new(
        directory: &Path,
        original: Option<Result<Original, String>>,
        told: BTreeMap<PathBuf, u64>,
    ) -> Self {
        let (original, unusable) = match original {
            Some(Ok(original)) => (Some(original), None),
            Some(Err(why)) => (None, Some(why)),
            None => (None, Some("there is none with a single file".to_owned())),
        };
        Self {
            tally: Tally::new(original.as_ref(), told),
            directory: directory.to_owned(),
            description: Description::new(original),
            recovery: Recovery {
                bag: directory.to_owned(),
                metadata_rebuilt: unusable,
                ..Recovery::default()
            },
            repeated: BTreeMap::new(),
            identities: Identities::default(),
        }
    }

    /// Adds what is readable of a file of the damaged bag in `directory`.
    pub fn add(
        &mut self,
        directory: &Path,
        name: &Path,
        only: bool,
        twins: Option<&Twins>,
    ) -> Result<(), RecoverError> {
        let path = directory.join(name);
        if !path.exists() {
            let mut file = RecoveredFile {
                path,
                ..RecoveredFile::default()
            };
            self.count(name, &mut file, &Told::default());
            self.recovery.files.push(file);
            return Ok(());
        }
        let source = Source::open(&path)?;
        let (found, _) = source.peek::<{ mcap::MAGIC.len() }>(0)?;
        let identities = std::mem::take(&mut self.identities);
        let new = self.directory.join(name);
        if let Some(folder) = new.parent() {
            fs::create_dir_all(folder).map_err(RecoverError::write(folder))?;
        }
        let output = Output::new(new, identities);
        let mut copy = Copy::new(source, output, twins);
        let is_mcap = copy.run()?;
        if !is_mcap && only && copy.losses.file.bytes > Some(0) {
            return Err(RecoverError::NotMcap {
                file: path,
                found: found.to_vec(),
            });
        }
        if self.recovery.metadata_rebuilt.is_some() {
            self.description
                .keep(copy.original.take(), copy.custom.take());
        }
        let told = Told {
            messages: copy.statistics,
            repeated: copy.repeated.take(),
            marked: copy.output.repeated.values().sum(),
            repeats: copy.is_ours,
        };
        self.count(name, &mut copy.losses.file, &told);
        copy.losses.file.kept = copy.losses.file.complete || copy.losses.file.messages > 0;
        if copy.losses.file.kept {
            self.recovery.unverified += copy.unverified;
            for (topic, count) in &copy.output.repeated {
                *self.repeated.entry(topic.clone()).or_default() += count;
            }
            let topics = copy.definitions.topics();
            self.finish_file(name, copy.output, topics, &copy.counts)?;
        } else {
            self.identities = copy.output.abandon()?;
        }
        self.recovery.files.push(copy.losses.file);
        Ok(())
    }

    fn count(&mut self, name: &Path, file: &mut RecoveredFile, told: &Told) {
        let (description, repeated) = (&self.description, &self.repeated);
        self.tally
            .add(name, file, told, || description.latched(repeated));
    }

    fn finish_file<'a>(
        &mut self,
        name: &Path,
        mut output: Output,
        topics: impl Iterator<Item = &'a Topic>,
        counts: &Counts,
    ) -> Result<(), RecoverError> {
        self.description.add(name, topics, counts);
        self.description.missing = self.tally.missing();
        output.metadata(self.description.record()?)?;
        self.identities = output.finish()?;
        Ok(())
    }

    /// Describes the bag, of which all files are copied.
    pub fn finish(mut self, bag: &Path) -> Result<Recovery, RecoverError> {
        self.recovery.missing = self.tally.missing();
        if !self.recovery.files.iter().any(|file| file.messages > 0) {
            self.check_empty(bag)?;
        }
        if self.description.files.is_empty() {
            // A bag has at least one file.
            let first = self.recovery.files.first();
            let path = first.map_or(Path::new(""), |file| &file.path);
            // A single file is the bag itself.
            let name = path.strip_prefix(bag).ok();
            let name = name.filter(|name| !name.as_os_str().is_empty());
            let name = name
                .map(Path::to_owned)
                .or(path.file_name().map(Into::into));
            let name = name.unwrap_or_default();
            let output = Output::new(self.directory.join(&name), Identities::default());
            self.finish_file(&name, output, [].into_iter(), &Counts::default())?;
        }
        self.description.missing = self.recovery.missing;
        self.description.write(&self.directory)?;
        Ok(self.recovery())
    }

    /// Whether a bag without messages had none.
    fn check_empty(&self, bag: &Path) -> Result<(), RecoverError> {
        let files = &self.recovery.files;
        let had_none = match self.tally.expected() {
            Some(expected) => expected == 0,
            None => files.iter().all(RecoveredFile::is_sound),
        };
        if had_none {
            return Ok(());
        }
        let left_out = files.iter().flat_map(|file| &file.left_out);
        Err(RecoverError::Nothing {
            bag: bag.to_owned(),
            bytes: files.iter().filter_map(|file| file.bytes).sum(),
            missing: self.recovery.missing,
            reason: left_out.map(|place| place.reason.clone()).next(),
        })
    }

    fn recovery(self) -> Recovery {
        let Self {
            description,
            mut recovery,
            repeated,
            ..
        } = self;
        description.tell(&mut recovery);
        for (topic, count) in repeated {
            recovery.repeated += count;
            if let Some(messages) = recovery.messages.get_mut(&topic) {
                *messages = messages.saturating_sub(count);
            }
        }
        recovery
    }
}
