//! The labeller of a target, the properties of panels that it needs, and its result for a grid.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::motion::panel_vertices;
use crate::labels::tag_words::TargetWords;
use crate::labels::tags::{TagPlace, TagReader};
use deltille_core::detection::DecodedTag;
use deltille_core::family::{Decoder, Family, NaturalWords};
use deltille_core::lattice::{GridKind, Tile, Vertex};
use deltille_core::targets::{TagsIn, Target};

/// Maximum number of comparisons of a tile with a word per image. They take a few hundredths of a
/// second.
const BUDGET: usize = 4_000_000;

/// Remaining computing time for tags in an image, in comparisons of a tile with a word. It is counted instead of
/// measured, so that results are the same on every computer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Budget(pub(super) usize);

impl Default for Budget {
    fn default() -> Self {
        Self(BUDGET)
    }
}

/// A grid, or a part of one, on a panel of the target.
#[derive(Clone, Debug)]
pub(crate) struct Labelled {
    /// Index of the panel in the target.
    pub panel: usize,
    /// Whether the image shows it mirrored.
    pub mirrored: bool,
    /// Panel vertex of every grid vertex that is a corner of the panel.
    pub vertices: BTreeMap<Vertex, Vertex>,
    /// Tags whose reading supports the placement, with rows and columns of the panel, sorted by them.
    pub tags: Vec<DecodedTag>,
}

/// The result of labelling a grid by its tags.
#[derive(Clone, Debug, Default)]
pub(crate) struct TagEvidence {
    /// The panels that were identified.
    pub found: Vec<Labelled>,
    /// Number of tiles that may carry a tag.
    pub tiles: usize,
    /// Median side of a cell of a tag, px.
    pub bit_px: f64,
    /// Standard deviation of the blur, px.
    pub blur_px: f64,
    /// Ids of the family that were read and do not belong to the target.
    pub foreign_ids: BTreeSet<u32>,
    /// Number of tiles whose cells are read with certainty and are not a code of the family.
    pub no_codes: usize,
    /// Number of tiles whose cells do not determine a code of the family, if no panel was identified.
    pub unread: usize,
    /// Whether a placement has sufficient evidence, but another one has almost the same evidence.
    pub is_ambiguous: bool,
    /// Numbers of tiles that agree and disagree with a placement whose evidence would suffice
    /// without the disagreeing tiles.
    pub contradicted: Option<[usize; 2]>,
    /// Whether the budget was exhausted before the grid was read.
    pub is_cut_short: bool,
}

/// Labels grids with the panels of a tagged target. A *word* is a code as read in one orientation of its tile. Each
/// code has three words on a deltille grid and four on a checkerboard.
#[derive(Clone, Debug)]
pub(crate) struct TagLabeller {
    /// One reader for each position of tags in their tiles.
    pub(super) readers: Vec<TagReader>,
    /// Name of the family.
    pub(super) family: String,
    /// Whether every tile has a position code.
    pub(super) is_dense: bool,
    /// Decoder of the whole family; `None` for position codes, because each of their words is a code.
    pub(super) decoder: Option<Decoder>,
    /// Probabilities of words in natural images, for families of triangular tags whose single tags
    /// identify a position.
    pub(super) natural: Option<NaturalWords>,
    /// Maximum number of misread cells at which a word is certainly a code of the family.
    pub(super) sure_errors: u32,
    /// Number of words of the family.
    pub(super) family_words: usize,
    /// Maximum number of misread cells of an accepted tag, if limited.
    pub(super) max_errors: Option<u32>,
    /// Words of the target.
    pub(super) words: TargetWords,
    /// Tiling of the tags.
    pub(super) kind: GridKind,
    /// Properties of each panel of the target, in order.
    pub(super) panels: Vec<LabelPanel>,
    /// Whether several panels may lie in one grid, like the faces of a solid.
    pub(super) panels_abut: bool,
    /// Panels and tiles of each code of the target.
    pub(super) places: Vec<Vec<(usize, Tile)>>,
    /// Number of positions and rotations of a tile on the target.
    pub(super) ways: usize,
}

/// A panel of the target, in its lattice coordinates.
#[derive(Clone, Debug)]
pub(super) struct LabelPanel {
    /// Index of the reader for the position of tags in their tiles.
    pub(super) reader: usize,
    /// Whether black and white are exchanged.
    pub(super) inverted: bool,
    /// Corners of the panel.
    pub(super) corners: BTreeSet<Vertex>,
    /// The tag in each tagged tile.
    pub(super) tags: BTreeMap<Tile, LabelTag>,
    /// All tiles of the colour that carries tags, tagged or not.
    pub(super) tiles: BTreeSet<Tile>,
}

impl LabelPanel {
    /// Returns the way to read its tags in a direct image.
    pub(super) fn way(&self) -> Way {
        Way { reader: self.reader, inverted: self.inverted, mirrored: false }
    }
}

/// A tag of a panel.
#[derive(Clone, Copy, Debug)]
pub(super) struct LabelTag {
    pub(super) id: u32,
    /// Index of its code among those of the target.
    pub(super) code: usize,
}

/// A way to read the tags of a grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Way {
    /// Index of the reader.
    pub(super) reader: usize,
    /// Whether black and white are exchanged.
    pub(super) inverted: bool,
    /// Whether the mirror image is read.
    pub(super) mirrored: bool,
}

impl TagLabeller {
    /// Creates a labeller for the tags of `target`, whose codes belong to `family`. Returns `None` if the target has no
    /// tags. Tags with more than `max_errors` misread cells do not count, if that is given.
    pub(crate) fn new(target: &Target, family: &Family, max_errors: Option<u32>) -> Option<Self> {
        Self::with_decoder(target, family, max_errors, || Decoder::new(family))
    }

    /// Returns the tiles with a tag of the panel at this index.
    pub(crate) fn tagged_tiles(&self, panel: usize) -> impl Iterator<Item = Tile> {
        self.panels[panel].tags.keys().copied()
    }

    /// Creates the labeller; see [`Self::new`]. `decoder` is called for the whole family if the target has tags.
    pub(super) fn with_decoder(
        target: &Target,
        family: &Family,
        max_errors: Option<u32>,
        decoder: impl FnOnce() -> Decoder,
    ) -> Option<Self> {
        let ids: BTreeSet<u32> =
            target.panels.iter().flat_map(|panel| &panel.tags).map(|tag| tag.id).collect();
        let coded: BTreeMap<u32, u64> =
            ids.into_iter().filter_map(|id| Some((id, family.code(id)?))).collect();
        // Many positions of a board of position codes show the same code.
        let mut shown = BTreeSet::new();
        let ids: Vec<u32> =
            coded.iter().filter(|&(_, code)| shown.insert(code)).map(|(&id, _)| id).collect();
        let of_code: HashMap<u64, usize> =
            ids.iter().enumerate().map(|(index, id)| (coded[id], index)).collect();
        let mut tag_places: Vec<TagPlace> = Vec::new();
        let mut places = vec![Vec::new(); ids.len()];
        let mut panels = Vec::new();
        for (index, panel) in target.panels.iter().enumerate() {
            let place = TagPlace::of(panel);
            let reader = tag_places.iter().position(|&p| p == place).unwrap_or_else(|| {
                tag_places.push(place);
                tag_places.len() - 1
            });
            let of_id = |id: u32| Some(LabelTag { id, code: of_code[coded.get(&id)?] });
            let tags: BTreeMap<Tile, LabelTag> = panel
                .tags
                .iter()
                .filter_map(|tag| Some((panel.tag_tile(tag), of_id(tag.id)?)))
                .collect();
            for (&tile, tag) in &tags {
                places[tag.code].push((index, tile));
            }
            let corners = panel_vertices(panel);
            let in_dark = panel.tags_in == TagsIn::Black;
            let tiles = panel.tiles().into_iter().filter(|t| t.is_dark() == in_dark).collect();
            panels.push(LabelPanel { reader, inverted: panel.inverted, corners, tags, tiles });
        }
        let panels_abut = target.panels.windows(2).any(|pair| pair[0].pose != pair[1].pose);
        let readers = tag_places.iter().map(|&place| TagReader::new(family, place)).collect();
        (!ids.is_empty()).then(|| Self {
            readers,
            kind: family.kind(),
            family: family.name().to_owned(),
            is_dense: family.is_position_family(),
            decoder: (!family.is_position_family()).then(decoder),
            natural: (family.kind() == GridKind::Deltille && !family.is_position_family())
                .then(|| NaturalWords::new(family.dimension())),
            sure_errors: family.correctable() / 2,
            family_words: family.len() * usize::from(family.kind().rotations()),
            max_errors,
            words: TargetWords::new(family, ids),
            panels,
            panels_abut,
            ways: usize::from(family.kind().rotations())
                * places.iter().map(Vec::len).sum::<usize>(),
            places,
        })
    }
}
