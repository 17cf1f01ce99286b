mod broken_sheets;
mod commands;
mod damaged;
mod in_memory;
