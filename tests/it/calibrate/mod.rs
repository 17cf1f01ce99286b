mod board_shape;
mod cameras;
mod commands;
mod gross_errors;
mod models;
mod rig;
mod target_map;
mod uncertainty;
