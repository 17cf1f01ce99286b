//! The problem of a bundle adjustment: all unknowns and observations, residuals, and parts of it.

use glam::{DMat3, DVec2, DVec3};

use super::corner_map::{CornerMap, MappedCorner};
use super::robot::Robot;
use super::shape::Shape;
use super::unknowns::{Block, CameraUnknowns, PanelUnknowns, TargetUnknowns};
use crate::cancel::Stop;
use crate::input::observation::MIN_CORNERS;
use crate::input::panel::PanelRef;
use deltille_core::camera::Pose;

/// Unknowns and observations. The pose of every frame is unknown.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Problem {
    /// Cameras.
    pub cameras: Vec<CameraUnknowns>,
    /// The poses `rig_from_scene`, one for each frame.
    pub frames: Vec<Pose>,
    /// Targets.
    pub targets: Vec<TargetUnknowns>,
    /// Panels of all targets.
    pub panels: Vec<PanelUnknowns>,
    /// Observations.
    pub blocks: Vec<Block>,
    /// The deviation of the sheet from its plan, if it is estimated; for one panel only.
    pub shape: Option<Shape>,
    /// The offset of each corner from its plan, if they are unknown.
    pub map: Option<CornerMap>,
    /// The links of frames to a robot, if there are any.
    pub robot: Option<Robot>,
    /// Flag that stops the calibration.
    pub stop: Stop,
}

impl Problem {
    /// The pose of a panel's target in the scene.
    #[inline]
    pub(crate) fn scene_from_target(&self, panel: PanelRef) -> Pose {
        self.targets[self.panels[panel.index()].target].scene_from_target
    }

    /// The pose of a panel in the scene.
    pub(crate) fn scene_from_panel(&self, panel: PanelRef) -> Pose {
        self.scene_from_target(panel).after(&self.panels[panel.index()].target_from_panel)
    }

    /// The poses of all panels in the scene.
    pub(crate) fn panel_places(&self) -> impl Iterator<Item = Pose> {
        self.panels.iter().map(|panel| {
            self.targets[panel.target].scene_from_target.after(&panel.target_from_panel)
        })
    }

    /// The positions of the corners of a block in the frame of its panel, mm.
    pub(crate) fn panel_points<'a>(&'a self, block: &'a Block) -> impl Iterator<Item = DVec3> + 'a {
        let mut indices = self.map.as_ref().map(|map| (map, map.indices(block)));
        block.observations.iter().map(move |seen| {
            let bent = self.shape.map_or(DVec3::ZERO, |shape| shape.offset(seen.panel_mm));
            let index = indices.as_mut().and_then(|(map, of)| Some((map, of.next()??)));
            let moved = index.map_or(DVec3::ZERO, |(map, index)| map.offsets_mm[index]);
            seen.panel_mm + bent + moved
        })
    }

    /// The positions of all corners of the map in the scene, mm.
    pub(crate) fn scene_points(&self) -> Vec<DVec3> {
        let of_corner = |(corner, offset): (&MappedCorner, &DVec3)| {
            let bent = self.shape.map_or(DVec3::ZERO, |shape| shape.offset(corner.panel_mm));
            self.scene_from_panel(corner.panel).apply(corner.panel_mm + bent + *offset)
        };
        self.map
            .iter()
            .flat_map(|map| map.corners.iter().zip(&map.offsets_mm))
            .map(of_corner)
            .collect()
    }

    /// The positions of the corners of a block in the frame of its camera, mm.
    pub(crate) fn camera_points<'a>(
        &'a self,
        block: &'a Block,
    ) -> impl Iterator<Item = DVec3> + 'a {
        let camera_from_scene =
            self.cameras[block.camera].camera_from_rig.after(&self.frames[block.frame]);
        let Pose { rotation, translation } =
            camera_from_scene.after(&self.scene_from_panel(block.panel));
        let rotation = DMat3::from_quat(rotation);
        self.panel_points(block).map(move |at| rotation * at + translation)
    }

    /// Detected minus predicted positions of the corners of a block, px; `None` for a corner that the camera cannot
    /// image.
    pub(crate) fn residuals<'a>(
        &'a self,
        block: &'a Block,
    ) -> impl Iterator<Item = Option<DVec2>> + 'a {
        let camera = &self.cameras[block.camera].camera;
        let seen = block.observations.iter().zip(self.camera_points(block));
        seen.map(|(seen, point)| Some(seen.pixel - camera.image(point)?))
    }

    /// Number of all corners.
    pub(crate) fn count(&self) -> usize {
        self.blocks.iter().map(|block| block.observations.len()).sum()
    }

    /// The problem with the frames for which `keep` returns true, and their observations.
    pub(crate) fn with_frames(&self, keep: impl Fn(usize) -> bool) -> Problem {
        let mut places = vec![None; self.frames.len()];
        let mut frames = Vec::new();
        for (index, pose) in self.frames.iter().enumerate().filter(|&(index, _)| keep(index)) {
            places[index] = Some(frames.len());
            frames.push(*pose);
        }
        let blocks = self
            .blocks
            .iter()
            .filter_map(|block| Some(Block { frame: places[block.frame]?, ..block.clone() }));
        let robot = self.robot.as_ref().map(|robot| robot.with_frames(&keep));
        Problem { frames, robot, blocks: blocks.collect(), ..self.unknowns() }
    }
}

/// Some of a problem's observations, and the frames that have enough of them to be adjusted.
pub(crate) struct Part {
    pub problem: Problem,
    /// Indices of its frames in the whole problem.
    frames: Vec<usize>,
}

impl Problem {
    /// The problem with only the corners for which `kept` is true.
    pub(crate) fn with_corners(&self, kept: &[Vec<bool>]) -> Problem {
        let of_block = |(block, kept): (&Block, &Vec<bool>)| {
            if kept.iter().all(|kept| *kept) {
                return block.clone();
            }
            let kept = block.observations.iter().zip(kept).filter(|(_, kept)| **kept);
            Block { observations: kept.map(|(seen, _)| *seen).collect(), ..*block }
        };
        let blocks = self.blocks.iter().zip(kept).map(of_block).collect();
        Problem { blocks, ..self.unknowns() }
    }

    /// The blocks for which `kept` returns true, and the frames that still have as many corners as a panel needs.
    pub(crate) fn part(&self, kept: impl Fn(usize, &Block) -> bool) -> Part {
        let kept: Vec<bool> =
            self.blocks.iter().enumerate().map(|(index, block)| kept(index, block)).collect();
        let mut corners = vec![0; self.frames.len()];
        for (block, _) in self.blocks.iter().zip(&kept).filter(|(_, kept)| **kept) {
            corners[block.frame] += block.observations.len();
        }
        let all = |block: &Block, kept: bool| vec![kept; block.observations.len()];
        let kept: Vec<Vec<bool>> =
            self.blocks.iter().zip(kept).map(|(block, kept)| all(block, kept)).collect();
        let has_enough = |frame: usize| corners[frame] >= MIN_CORNERS;
        let mut problem = self.with_corners(&kept).with_frames(has_enough);
        problem.blocks.retain(|block| !block.observations.is_empty());
        Part { problem, frames: (0..self.frames.len()).filter(|&f| has_enough(f)).collect() }
    }

    /// Takes over the values of a part.
    pub(crate) fn take(&mut self, part: Part) {
        let Part { problem, frames } = part;
        for (frame, pose) in frames.into_iter().zip(problem.frames) {
            self.frames[frame] = pose;
        }
        (self.cameras, self.panels) = (problem.cameras, problem.panels);
        self.targets = problem.targets;
        (self.shape, self.map) = (problem.shape, problem.map);
    }

    /// Its observations with the values of a problem of the same unknowns.
    pub(crate) fn at(&self, found: &Problem) -> Problem {
        Problem { blocks: self.blocks.clone(), ..found.unknowns() }
    }

    /// The problem without observations.
    fn unknowns(&self) -> Problem {
        let Problem { cameras, frames, targets, panels, shape, map, robot, .. } = self;
        let (cameras, frames, panels) = (cameras.clone(), frames.clone(), panels.clone());
        let (targets, map, stop) = (targets.clone(), map.clone(), self.stop.clone());
        let (blocks, shape, robot) = (Vec::new(), *shape, robot.clone());
        Problem { cameras, frames, targets, panels, blocks, shape, map, robot, stop }
    }
}
