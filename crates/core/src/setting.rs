//! The settings that messages name, and what they are called.

use std::fmt;
use std::sync::{PoisonError, RwLock};

/// Makes the enum of names and their paths.
macro_rules! settings {
    ($($name:ident = $path:literal,)*) => {
        /// What a message tells its reader to look at or to change. It is displayed in the words of whoever reads, see
        /// [`speak`]. Another one is a breaking change: a front end without a word for it must not compile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Setting {
            $(
                #[doc = concat!("`", $path, "`")]
                $name,
            )*
        }

        impl Setting {
            /// All of them.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// A field, a choice or a function of the library, such as `BoardSpec::rows`.
            pub fn path(self) -> &'static str {
                match self {
                    $(Self::$name => $path,)*
                }
            }
        }
    };
}

// Each is called by the words of its path, without `Spec`.
settings! {
    AprilGridGap = "AprilGridSpec::gap",
    AprilGridTagMm = "AprilGridSpec::tag_mm",
    AprilGridTags = "AprilGridSpec::tags",
    BoardBoardId = "BoardSpec::board_id",
    BoardBoards = "BoardSpec::boards",
    BoardCols = "BoardSpec::cols",
    BoardEdgeMm = "BoardSpec::edge_mm",
    BoardRows = "BoardSpec::rows",
    BoardTags = "BoardSpec::tags",
    BoardTwoSidedMm = "BoardSpec::two_sided_mm",
    CalibrateModel = "calibrate::Model",
    CalibrationBoardShape = "Calibration::board_shape",
    CalibrationMeasureTarget = "Calibration::measure_target",
    CalibrationRefinePanels = "Calibration::refine_panels",
    CalibrationWrite = "calibration::write",
    CharucoDictionary = "CharucoSpec::dictionary",
    CharucoMarkerMm = "CharucoSpec::marker_mm",
    CharucoSquareMm = "CharucoSpec::square_mm",
    CharucoSquares = "CharucoSpec::squares",
    CirclesCircles = "CirclesSpec::circles",
    CirclesDiameterMm = "CirclesSpec::diameter_mm",
    CirclesSpacingMm = "CirclesSpec::spacing_mm",
    CompareBoardsAssumeTarget = "compare_boards::assume_target",
    DetectionAssumeTargets = "Detection::assume_targets",
    DetectionWrite = "detection::write",
    DialectFork = "Dialect::Fork",
    FamilyShippedNames = "family::shipped_names",
    FamilyToJson = "Family::to_json",
    FinishContour = "Finish::contour",
    FinishWhite = "Finish::white",
    ImportBits = "ImportSpec::bits",
    ImportDistance = "ImportSpec::distance",
    ImportKind = "ImportSpec::kind",
    LimitsMaxBytes = "Limits::max_bytes",
    LimitsMaxDepth = "Limits::max_depth",
    LimitsMaxNodes = "Limits::max_nodes",
    LimitsMaxPixels = "Limits::max_pixels",
    LimitsMaxPixelsPerByte = "Limits::max_pixels_per_byte",
    LimitsMaxSeconds = "Limits::max_seconds",
    MeshingTextures = "Meshing::textures",
    PaperGuidePage = "PaperSpec::guide_page",
    PaperLogo = "PaperSpec::logo",
    PaperLogoHeightMm = "PaperSpec::logo_height_mm",
    PaperMarginMm = "PaperSpec::margin_mm",
    PaperNote = "PaperSpec::note",
    PaperPacked = "PaperSpec::packed",
    PaperPoster = "PaperSpec::poster",
    PaperSize = "PaperSpec::size",
    PaperTagIds = "PaperSpec::tag_ids",
    PhotographReadWithNotes = "photograph::read_with_notes",
    PrintScale = "Print::scale",
    RegionImage = "Region::Image",
    RigWrite = "rig::write",
    SightingBend = "Sighting::bend",
    SightingStretch = "Sighting::stretch",
    SkeletonPanelThicknessMm = "SkeletonSpec::panel_thickness_mm",
    SkeletonRibMm = "SkeletonSpec::rib_mm",
    SkeletonWallMm = "SkeletonSpec::wall_mm",
    SolidShapeCuboid = "SolidShape::Cuboid",
    SolidShapeMesh = "SolidShape::Mesh",
    SolidSheetsPerFace = "SolidSheets::PerFace",
    SolidSheetsSeamedNet = "SolidSheets::SeamedNet",
    SolidBoardId = "SolidSpec::board_id",
    SolidEdgeMm = "SolidSpec::edge_mm",
    SolidMarginMm = "SolidSpec::margin_mm",
    SolidSkeleton = "SolidSpec::skeleton",
    SolidSquareTags = "SolidSpec::square_tags",
    SolidSquareTagsFamily = "SolidSpec::square_tags::family",
    SolidSquareTagsFirstId = "SolidSpec::square_tags::first_id",
    SolidTiles = "SolidSpec::tiles",
    TagSheetBorderBits = "TagSheetSpec::border_bits",
    TagSheetEdgeMm = "TagSheetSpec::edge_mm",
    TagSheetFamily = "TagSheetSpec::family",
    TagSheetIds = "TagSheetSpec::ids",
    TagsInBlack = "TagsIn::Black",
    TagBorderBits = "TagSpec::border_bits",
    TagFamily = "TagSpec::family",
    TagFirstId = "TagSpec::first_id",
    TagHoleMm = "TagSpec::hole_mm",
    TagSpacing = "TagSpec::spacing",
    TagTagsIn = "TagSpec::tags_in",
    TargetName = "Target::name",
    TargetToJson = "Target::to_json",
    TargetSetFamily = "Target::set_family",
    UntaggedGridEdgeMm = "UntaggedGrid::edge_mm",
    UntaggedGridKind = "UntaggedGrid::kind",
    UntaggedGridSize = "UntaggedGrid::size",
}

/// What settings are called.
static WORDS: RwLock<fn(Setting) -> String> = RwLock::new(in_backquotes);

fn in_backquotes(setting: Setting) -> String {
    format!("`{}`", setting.path())
}

/// Says what settings are called in all messages made from now on. At first it is their path in the library, between
/// backquotes.
///
/// Like a panic hook it holds for the whole process, as one front end speaks to its user there: messages are made deep
/// in the library, on any thread, and kept as text in results and files, where nobody can tell whose words they need.
pub fn speak(words: fn(Setting) -> String) {
    *WORDS.write().unwrap_or_else(PoisonError::into_inner) = words;
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let words = *WORDS.read().unwrap_or_else(PoisonError::into_inner);
        f.write_str(&words(*self))
    }
}
