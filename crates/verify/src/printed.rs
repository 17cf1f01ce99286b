//! Printed pages: which page of which file shows which sheet, what each page shows, and the net folded from them.

use std::path::{Path, PathBuf};
use std::sync::atomic::Ordering;

use crate::document::drawing;
use crate::document::opened::Document;
use crate::error::VerifyError;
use crate::finding::any::{Finding, PageFinding};
use crate::net::{folded, printed_net};
use crate::panel::affine_map::AffineMap;
use crate::reading::error::DocumentError;
use crate::reading::format::Format;
use crate::reading::names::{file_name, of_all};
use crate::reading::reader::Reader;
use crate::sheet::boards::Seen;
use crate::sheet::source::{Source, wish_px_per_mm};
use crate::sheet::{assemble, marks, whole};
use crate::syntax::{findings, inspect};
use crate::verdict::{SheetVerdict, Verdict};
use crate::verifier::Verifier;
use deltille_layout::SheetPage;

/// Compares printed pages.
pub(crate) fn verify(
    verifier: &Verifier,
    reader: &Reader,
    path: &Path,
    format: Format,
) -> Result<Verdict, VerifyError> {
    if verifier.printing.sheets.is_empty() {
        let (path, target) = (path.to_owned(), verifier.target().name.to_string());
        return Err(VerifyError::NoSheets { path, target });
    }
    let mut findings = Vec::new();
    let files = verifier.set_of(path);
    let missing: Vec<&PathBuf> = files.iter().filter(|file| !reader.has(file)).collect();
    if reader.has(path) && !missing.is_empty() {
        return Ok(Verifier::without(&files, format, &missing));
    }
    let refused = refused(verifier, reader, &files, format)?;
    if findings::refuse(&refused) {
        return Ok(Verdict::new(path, format, refused));
    }
    findings.extend(refused);
    let documents: Vec<Document> =
        files.iter().map(|file| Document::read_by(reader, file)).collect::<Result<_, _>>()?;
    let stated = verifier.printing.page_count();
    // The page of a file that shows each page of the target.
    let sources: Vec<Option<Source>> = match format {
        Format::Pdf => {
            let found = documents[0].pages();
            if found != stated {
                findings.push(PageFinding::Pages { found, stated }.into());
            }
            let source = |page| (page < found).then_some(Source { document: &documents[0], page });
            (0..stated).map(source).collect()
        }
        _ if documents.len() > 1 => {
            documents.iter().map(|document| Some(Source { document, page: 0 })).collect()
        }
        _ => {
            let shown = verifier.sheet_of(path)?;
            let source = Source { document: &documents[0], page: 0 };
            (0..stated).map(|page| (page == shown).then_some(source)).collect()
        }
    };
    let (mut verdicts, mut seen) = (Vec::new(), Vec::new());
    let mut first = 0;
    for (index, layout) in verifier.printing.sheets.iter().enumerate() {
        if verifier.cancel.is_some_and(|flag| flag.load(Ordering::Relaxed)) {
            return Err(VerifyError::Cancelled);
        }
        let pages = &sources[first..first + layout.page_count()];
        let before = first;
        first += layout.page_count();
        let Some(pages) = pages.iter().copied().collect::<Option<Vec<Source>>>() else {
            continue;
        };
        let (verdict, found) = match layout.pages.is_empty() {
            true => page(verifier, pages[0], index)?,
            false => pages_together(verifier, &pages, index, before)?,
        };
        verifier.report_progress(first, stated);
        verdicts.push(verdict);
        seen.push(found);
    }
    if printed_net::is_net(&verifier.printing) && verdicts.len() == verifier.printing.sheets.len() {
        folded::check(&verifier.printing, &seen, &mut verdicts);
    }
    let mut verdict = Verdict { artifact: of_all(&files), ..Verdict::new(path, format, findings) };
    verdict.passed &= verdicts.iter().all(|sheet| sheet.findings.is_empty());
    Ok(Verdict { sheets: verdicts, ..verdict })
}

/// Returns the constructs that are not allowed in files that belong together.
fn refused(
    verifier: &Verifier,
    reader: &Reader,
    files: &[PathBuf],
    format: Format,
) -> Result<Vec<Finding>, DocumentError> {
    let mut refused = Vec::new();
    for file in files {
        let (found, _) = inspect::check(reader, file, format, &verifier.printing)?;
        refused.extend(found.into_iter().map(|finding| match files.len() {
            1 => finding,
            _ => finding.on_page(file_name(file)),
        }));
    }
    Ok(refused)
}

/// Compares a sheet that is printed on one page.
fn page(
    verifier: &Verifier,
    source: Source,
    index: usize,
) -> Result<(SheetVerdict, Seen), DocumentError> {
    let layout = &verifier.printing.sheets[index];
    let (page, findings) = source.render(
        layout,
        wish_px_per_mm(verifier, layout),
        verifier.printing.finish.mirrored,
    )?;
    let mut verdict = SheetVerdict::new(index, &page, findings);
    let seen = whole::compare(verifier, &page, layout, &mut verdict);
    Ok((verdict, seen))
}

/// Compares a sheet that is printed on several pages, after `before` pages of other sheets. Compares the area around
/// the window of each page first, then the sheet assembled from all windows.
fn pages_together(
    verifier: &Verifier,
    sources: &[Source],
    index: usize,
    before: usize,
) -> Result<(SheetVerdict, Seen), DocumentError> {
    let layout = &verifier.printing.sheets[index];
    let wish = wish_px_per_mm(verifier, layout);
    let most = (drawing::MAX_PIXELS / (layout.width_mm * layout.height_mm)).sqrt();
    let mut pages = Vec::with_capacity(sources.len());
    let mut findings = Vec::new();
    let mut check_bars_mm = Vec::new();
    for (source, SheetPage { label, window_mm, marks, .. }) in sources.iter().zip(&layout.pages) {
        let (page, wrong) = source.render(marks, wish, verifier.printing.finish.mirrored)?;
        let mut verdict = SheetVerdict::new(index, &page, wrong);
        whole::check_bars(&page, marks, &AffineMap::IDENTITY, &mut verdict);
        let logo = verifier.printing.logo.as_ref();
        marks::check(&page, marks, logo, &[], Some(*window_mm), &mut verdict);
        let of_page = verdict.findings.into_iter();
        findings.extend(of_page.map(|finding| finding.on_page(label.clone())));
        check_bars_mm.extend(verdict.check_bars_mm);
        // Keep no finer resolution than the assembled sheet has.
        pages.push(if wish > most {
            source.render(marks, most, verifier.printing.finish.mirrored)?.0
        } else {
            page
        });
        // The whole sheet is compared after its pages.
        verifier.report_progress(before + pages.len() - 1, verifier.printing.page_count());
    }
    let (sheet, different) = assemble::assemble(&pages, layout, wish.min(most));
    let mut verdict = SheetVerdict::new(index, &sheet, different);
    verdict.pages = pages.len();
    let seen = whole::compare(verifier, &sheet, layout, &mut verdict);
    verdict.findings.extend(findings);
    verdict.check_bars_mm = check_bars_mm;
    Ok((verdict, seen))
}
