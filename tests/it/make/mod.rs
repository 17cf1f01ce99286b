mod board;
mod checkerboard_targets;
mod dsc;
mod export;
mod meshes;
mod net;
mod solid;
mod tag_sheets;
