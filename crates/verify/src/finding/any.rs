//! All kinds of deviations of an artifact, and deviations of its pages.

use glam::DVec2;
use serde::Serialize;

use crate::finding::board::BoardFinding;
use crate::finding::construct::ConstructFinding;
use crate::finding::cut::CutFinding;
use crate::finding::fold::FoldFinding;
use crate::finding::list::ListFinding;
use crate::finding::mark::MarkFinding;
use crate::finding::mesh::MeshFinding;
use crate::finding::tile::TileFinding;
use deltille_core::words::counted;

/// One deviation of an artifact from its target. In JSON, `kind` is that of the specific finding.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(untagged)]
#[non_exhaustive]
pub enum Finding {
    /// A construct of the file.
    #[error(transparent)]
    Construct(#[from] ConstructFinding),
    /// The pages of the file.
    #[error(transparent)]
    Page(#[from] PageFinding),
    /// Marks outside the tiles.
    #[error(transparent)]
    Mark(#[from] MarkFinding),
    /// A board.
    #[error(transparent)]
    Board(#[from] BoardFinding),
    /// A tile.
    #[error(transparent)]
    Tile(#[from] TileFinding),
    /// The fold of a net.
    #[error(transparent)]
    Fold(#[from] FoldFinding),
    /// A mesh or a body.
    #[error(transparent)]
    Mesh(#[from] MeshFinding),
    /// A list for other detectors.
    #[error(transparent)]
    List(#[from] ListFinding),
    /// A drawing for a cutter.
    #[error(transparent)]
    Cut(#[from] CutFinding),
}

/// A deviation in the pages of a file. Lengths in mm.
#[derive(Clone, Debug, PartialEq, Serialize, thiserror::Error)]
#[serde(tag = "kind", rename_all = "snake_case")]
#[non_exhaustive]
pub enum PageFinding {
    /// The file has too many or too few pages.
    #[error("{} instead of {stated}", counted(*found, "page"))]
    Pages {
        /// Pages of the file.
        found: usize,
        /// Sheets of the target.
        stated: usize,
    },
    /// A page in its own file is missing, or was not given with the others.
    #[error("{page} is missing or was not given with the others")]
    PageMissing {
        /// File name of the page.
        page: String,
    },
    /// The page has the wrong size.
    #[error(
        "page of {:.3} x {:.3} mm instead of {:.3} x {:.3} mm",
        found_mm.x, found_mm.y, stated_mm.x, stated_mm.y
    )]
    PageSize {
        /// Width and height in the file.
        found_mm: DVec2,
        /// Width and height in the target.
        stated_mm: DVec2,
    },
    /// A deviation on one of several pages that carry a sheet.
    #[error("page {page}: {finding}")]
    OnPage {
        /// Label of the page.
        page: String,
        /// The deviation.
        finding: Box<Finding>,
    },
    /// Two pages differ where they overlap.
    #[error(
        "pages {} and {} differ where they overlap, at ({:.2}, {:.2}) mm",
        pages[0], pages[1], at_mm.x, at_mm.y
    )]
    PagesDiffer {
        /// Labels of the pages.
        pages: [String; 2],
        /// Position on the sheet.
        at_mm: DVec2,
    },
}

impl Finding {
    /// The same finding, on one of several pages.
    pub(crate) fn on_page(self, page: String) -> Self {
        PageFinding::OnPage { page, finding: Box::new(self) }.into()
    }

    /// Whether only a tag, a tile or a corner is wrong and the rest of the sheet is as stated.
    pub(crate) fn is_local(&self) -> bool {
        match self {
            Self::Tile(finding) => !matches!(finding, TileFinding::TagMissing { .. }),
            Self::Board(finding) => finding.is_local(),
            _ => false,
        }
    }
}
