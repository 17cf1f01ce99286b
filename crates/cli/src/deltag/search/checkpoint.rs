//! Checkpoint files, from which an interrupted search resumes.

use std::cell::RefCell;
use std::path::Path;

use anyhow::{Context, ensure};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::output::{self, Overwrite};
use deltille::limits;

/// The optional checkpoint file of a search.
pub struct CheckpointFile<'a> {
    path: Option<&'a Path>,
    /// Every setting that affects the result of the search.
    search: String,
    failed: RefCell<Option<anyhow::Error>>,
}

/// A checkpoint, with the search that it belongs to.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Saved<C> {
    search: String,
    checkpoint: C,
}

impl<'a> CheckpointFile<'a> {
    /// Creates a checkpoint at `path` for a search that `search` describes completely.
    pub fn new(path: Option<&'a Path>, search: String) -> Self {
        Self { path, search, failed: RefCell::new(None) }
    }

    /// Loads the state of the search, or the initial state if there is no file. Writes that initial state, so that an
    /// unwritable file fails now and not after hours.
    pub fn load<C: Default + Serialize + DeserializeOwned>(&self) -> anyhow::Result<C> {
        let Some(path) = self.path else { return Ok(C::default()) };
        let file = path.display();
        if !path.exists() {
            self.write(path, &C::default()).context("--resume")?;
            return Ok(C::default());
        }
        let text = limits::read_short_text(path, limits::MAX_FAMILY_BYTES).context("--resume")?;
        let saved: Saved<C> = serde_json::from_str(&text).ok().with_context(|| {
            format!("--resume: {file} is not a checkpoint of this method; remove it to start again")
        })?;
        ensure!(
            saved.search == self.search,
            "--resume: {file} belongs to another search; remove it, or name another file"
        );
        Ok(saved.checkpoint)
    }

    /// Saves a checkpoint. Errors are kept and reported at the end, in [`Self::advice`].
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

    /// Describes how to resume after an interruption.
    pub fn advice(&self) -> String {
        match (self.path, self.failed.borrow().as_ref()) {
            (Some(path), None) => {
                format!(
                    "run the same command again to resume from the checkpoint {}",
                    path.display()
                )
            }
            (Some(_), Some(error)) => format!("the checkpoint could not be written: {error}"),
            (None, _) => "use --resume FILE to keep a checkpoint".to_owned(),
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
