mod board;
mod checkerboard_targets;
mod dsc;
mod export;
mod net;
mod solid;
mod tag_sheets;
