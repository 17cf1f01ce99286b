mod commands;
mod documents;
mod shipped;
