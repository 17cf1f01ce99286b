mod commands;
mod shipped;
