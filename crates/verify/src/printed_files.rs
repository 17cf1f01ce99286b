//! The files that contain the pages of a target, by their names.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use crate::error::VerifyError;
use crate::finding::any::PageFinding;
use crate::net::printed_net;
use crate::reading::format::Format;
use crate::reading::names::{file_name, of_all};
use crate::verdict::Verdict;
use crate::verifier::Verifier;
use deltille_files::export::sheet_file_name;

impl Verifier<'_> {
    /// Returns the files that are verified together with `path`: all pages of a net, or of a board over several
    /// pages, if each page has its own file. Any other file is verified alone.
    pub fn set_of(&self, path: &Path) -> Vec<PathBuf> {
        let in_parts = self.printing.sheets.iter().any(|sheet| !sheet.pages.is_empty());
        match in_parts || printed_net::is_net(&self.printing) {
            true => self.pages_with(path),
            false => vec![path.to_owned()],
        }
    }

    /// Returns the files of all pages if `path` contains one of them, or `path` alone if it contains all.
    pub fn pages_with(&self, path: &Path) -> Vec<PathBuf> {
        let single = matches!(Format::of(path), Some(Format::Svg | Format::Png));
        let count = self.printing.page_count();
        if !single || count == 1 || self.sheet_of(path).is_err() {
            return vec![path.to_owned()];
        }
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let name = stem.rsplit_once('-').map_or(&*stem, |(name, _)| name);
        let extension = path.extension().unwrap_or_default().to_string_lossy();
        let file = |index| path.with_file_name(sheet_file_name(name, index, count, &extension));
        (0..count).map(file).collect()
    }

    /// Creates the verdict on a set of pages with missing files.
    pub(crate) fn without(pages: &[PathBuf], format: Format, missing: &[&PathBuf]) -> Verdict {
        let findings =
            missing.iter().map(|page| PageFinding::PageMissing { page: file_name(page) }.into());
        let verdict = Verdict::new(&pages[0], format, findings.collect());
        Verdict { artifact: of_all(pages), ..verdict }
    }

    /// Returns the page shown by a single-page file, from the name of the file.
    pub(crate) fn sheet_of(&self, path: &Path) -> Result<usize, VerifyError> {
        let count = self.printing.page_count();
        let stem = path.file_stem().unwrap_or_default().to_string_lossy();
        let number = stem.rsplit_once('-').and_then(|(_, number)| number.parse::<usize>().ok());
        match number {
            _ if count == 1 => Ok(0),
            Some(number) if (1..=count).contains(&number) => Ok(number - 1),
            _ => {
                let extension = path.extension().unwrap_or_default().to_string_lossy();
                let example = sheet_file_name(&self.target().name, 0, count, &extension);
                Err(VerifyError::WhichSheet { path: path.to_owned(), sheets: count, example })
            }
        }
    }

    /// Returns verdicts on the sets of pages for which `named` lists only some files. If `alone` is
    /// set, a single page may be named without the others when it can be verified alone;
    /// [`set_of`](Self::set_of) always completes the pages of a net.
    pub fn incomplete_sets(&self, named: &[PathBuf], alone: bool) -> Vec<Verdict> {
        // Several paths may name the same folder.
        let absolute = |path: &PathBuf| std::path::absolute(path).unwrap_or_else(|_| path.clone());
        let named: Vec<PathBuf> = named.iter().map(absolute).collect();
        let sets: BTreeSet<Vec<PathBuf>> = named.iter().map(|path| self.pages_with(path)).collect();
        let mut verdicts = Vec::new();
        for pages in sets {
            let verified_together = self.set_of(&pages[0]).len() > 1;
            let missing: Vec<&PathBuf> =
                pages.iter().filter(|page| !named.contains(page)).collect();
            let single = alone && missing.len() + 1 == pages.len();
            if let Some(format) = Format::of(&pages[0])
                && !(verified_together || single || missing.is_empty())
            {
                verdicts.push(Self::without(&pages, format, &missing));
            }
        }
        verdicts
    }
}
