//! Checks whether black and white of a panel are those of the print.

use crate::finding::any::Finding;
use crate::finding::board::BoardFinding;
use crate::panel::placed::PlacedPanel;

/// Maximum deviation of the ink in the centre of a tile from 0 or 1: the effect of rounding to 255
/// grey values.
const MAX_TONE_ERROR: f64 = 0.01;

/// Difference of ink below which a sheet is called blank rather than faint.
const MIN_CONTRAST: f64 = 0.03;

/// Returns a finding if the tiles are at their positions but too grey, or have swapped colours.
pub(crate) fn wrong_tones(placed: &PlacedPanel) -> Option<Finding> {
    let panel = placed.panel.id;
    let ink @ [white, black] = placed.tones()?;
    if white - black > 0.5 {
        return Some(BoardFinding::Inverted { panel }.into());
    }
    let faint = black < 1.0 - MAX_TONE_ERROR || white > MAX_TONE_ERROR;
    let contrast = BoardFinding::Contrast { panel, ink };
    (faint && black - white > MIN_CONTRAST).then_some(contrast.into())
}
