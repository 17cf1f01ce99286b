//! The settings that messages name, and their display names.

use std::fmt;
use std::sync::{PoisonError, RwLock};

/// Defines the enum of settings and their paths.
macro_rules! settings {
    ($($name:ident = $path:literal,)*) => {
        /// A setting that a message refers to. [`speak`] sets how it is displayed. Adding a variant is a breaking
        /// change: a front end that does not name it must not compile.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        pub enum Setting {
            $(
                #[doc = concat!("`", $path, "`")]
                $name,
            )*
        }

        impl Setting {
            /// All settings.
            pub const ALL: &[Self] = &[$(Self::$name,)*];

            /// Returns the path of a field, choice or function of the library, for example `BoardSpec::rows`.
            pub fn path(self) -> &'static str {
                match self {
                    $(Self::$name => $path,)*
                }
            }
        }
    };
}

// Each is named after the words of its path, without `Spec`.
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
    CalibrationCompensatedForTiming = "Calibration::compensated_for_timing",
    CalibrationMeasureTarget = "Calibration::measure_target",
    CalibrationRefinePanels = "Calibration::refine_panels",
    CalibrationWrite = "calibration::write",
    CharucoDictionary = "CharucoSpec::dictionary",
    CharucoLegacy = "CharucoSpec::legacy",
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
    FrameOptionsTopic = "FrameOptions::topic",
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
    PaperPages = "PaperSpec::pages",
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

/// Function that names settings in messages.
static WORDS: RwLock<fn(Setting) -> String> = RwLock::new(in_backquotes);

fn in_backquotes(setting: Setting) -> String {
    format!("`{}`", setting.path())
}

/// Sets how settings are named in all later messages. The default is the library path between backquotes.
///
/// The choice is global to the process, like a panic hook, because a process has one front end. The
/// library creates messages on any thread and stores them as text in results and files. They do not
/// record the front end that they are for.
pub fn speak(words: fn(Setting) -> String) {
    *WORDS.write().unwrap_or_else(PoisonError::into_inner) = words;
}

impl fmt::Display for Setting {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let words = *WORDS.read().unwrap_or_else(PoisonError::into_inner);
        f.write_str(&words(*self))
    }
}
