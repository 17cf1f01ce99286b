mod broken_sheets;
mod commands;
mod damaged;
