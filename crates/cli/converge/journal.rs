//! The measurements on the disk, a line of JSON each: written as they come in, so that an interruption loses none.

use std::fs::{self, File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use anyhow::anyhow;
use raytree_converge::{Journal, Record, line};

use crate::cancel;
use crate::failure::Usage;

/// In the output folder.
pub const NAME: &str = "measurements.jsonl";

/// What was measured, and the file to which more is added.
pub struct JournalFile {
    path: PathBuf,
    file: File,
    pub journal: Journal,
}

impl JournalFile {
    /// Opens what an earlier run has left, or begins anew: where there is nothing, or where `fresh` says so. Measurements of another
    /// subject are refused rather than mixed or lost.
    pub fn open(folder: &Path, key: &str, fresh: bool) -> anyhow::Result<Self> {
        let path = folder.join(NAME);
        let there = if fresh { None } else { read(&path)? };
        let text = there.as_deref().unwrap_or_default();
        let journal = kept(&path, text, key)?;
        let mut whole = whole_lines(text).to_owned();
        if whole.is_empty() {
            whole = line(&Record::Subject {
                key: key.to_owned(),
            })?;
        }
        if there.as_deref() != Some(&whole) {
            raytree::write_whole(&path, |file| file.write_all(whole.as_bytes()))
                .map_err(|error| failed(&path, &error))?;
        }
        let file = OpenOptions::new().append(true).open(&path);
        let file = file.map_err(|error| failed(&path, &error))?;
        Ok(Self {
            path,
            file,
            journal,
        })
    }

    /// Adds a measurement, at once on the disk as far as this process goes.
    pub fn add(&mut self, record: Record) -> anyhow::Result<()> {
        let text = line(&record)?;
        let (file, path) = (&mut self.file, &self.path);
        cancel::while_writing(|| {
            let written = file.write_all(text.as_bytes());
            written.map_err(|error| failed(path, &error))
        })?;
        self.journal.add(record);
        Ok(())
    }
}

fn read(path: &Path) -> anyhow::Result<Option<String>> {
    match fs::read(path) {
        // What is no text is no measurement either; it is refused below.
        Ok(bytes) => Ok(Some(String::from_utf8_lossy(&bytes).into_owned())),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(None),
        Err(error) => Err(anyhow!(
            "{}: can't be read: {error}; choose another --output, or --fresh",
            path.display()
        )),
    }
}

fn kept(path: &Path, text: &str, key: &str) -> Result<Journal, Usage> {
    let remedy = "choose another --output, or start over with --fresh";
    let journal = Journal::parse(text).map_err(|number| {
        Usage(format!(
            "{}: line {number} is no measurement; {remedy}",
            path.display()
        ))
    })?;
    if journal.key.as_deref().is_some_and(|kept| kept != key) {
        return Err(Usage(format!(
            "{}: measured of another scene, view, light, reference, device or version of this program; {remedy}",
            path.display()
        )));
    }
    Ok(journal)
}

/// Without half a line at the end, which would spoil the next.
fn whole_lines(text: &str) -> &str {
    text.rfind('\n').map_or("", |end| &text[..=end])
}

fn failed(path: &Path, error: &io::Error) -> anyhow::Error {
    anyhow!("{}: can't be written: {error}", path.display())
}
