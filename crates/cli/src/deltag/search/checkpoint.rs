//! A file from which an interrupted search goes on.

use std::cell::RefCell;
use std::path::Path;

use anyhow::{Context, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::output::{self, Overwrite};
use deltille::limits;

/// The checkpoint file of one search, if it has one.
pub struct CheckpointFile<'a> {
    path: Option<&'a Path>,
    /// All that decides what the search finds.
    search: String,
    failed: RefCell<Option<anyhow::Error>>,
}

/// A checkpoint, and of which search it is.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved<C> {
    search: String,
    checkpoint: C,
}

impl<'a> CheckpointFile<'a> {
    /// The file at `path` for a search that the text describes in full.
    pub fn new(path: Option<&'a Path>, search: String) -> Self {
        Self { path, search, failed: RefCell::new(None) }
    }

    /// Where the search stood; at its beginning where there is no file. That the file can be
    /// written is found out now, not after hours.
    pub fn load<C: Default + Serialize + DeserializeOwned>(&self) -> anyhow::Result<C> {
        let Some(path) = self.path else { return Ok(C::default()) };
        let file = path.display();
        if !path.exists() {
            self.write(path, &C::default()).context("--resume")?;
            return Ok(C::default());
        }
        let text = limits::read_short_text(path, limits::MAX_FAMILY_BYTES).context("--resume")?;
        let saved: Saved<C> = serde_json::from_str(&text).ok().with_context(|| {
            format!("--resume: {file} is no checkpoint of this method; remove it to start anew")
        })?;
        ensure!(
            saved.search == self.search,
            "--resume: {file} belongs to another search; remove it, or name another file"
        );
        Ok(saved.checkpoint)
    }

    /// Keeps a checkpoint. What goes wrong is told at the end, by [`Self::finish`].
    pub fn save<C: Serialize>(&self, checkpoint: &C) {
        if let Some(path) = self.path
            && let Err(error) = self.write(path, checkpoint)
        {
            self.failed.borrow_mut().get_or_insert(error);
        }
    }

    fn write<C: Serialize>(&self, path: &Path, checkpoint: &C) -> anyhow::Result<()> {
        let saved = Saved { search: self.search.clone(), checkpoint };
        output::write(path, &serde_json::to_vec(&saved)?, Overwrite::default())
    }

    /// How to go on after an interruption.
    pub fn advice(&self) -> String {
        match (self.path, self.failed.borrow().as_ref()) {
            (Some(path), None) => {
                format!("the same command goes on from the checkpoint {}", path.display())
            }
            (Some(_), Some(error)) => format!("no checkpoint was kept: {error}"),
            (None, _) => "--resume FILE would keep a checkpoint".to_owned(),
        }
    }

    /// Removes the file once the family is written.
    pub fn finish(self) -> anyhow::Result<()> {
        let Some(path) = self.path else { return Ok(()) };
        if path.exists() {
            std::fs::remove_file(path)
                .with_context(|| format!("--resume: cannot remove {}", path.display()))?;
        }
        Ok(())
    }
}
