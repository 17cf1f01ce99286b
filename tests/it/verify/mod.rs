mod broken_sheets;
mod commands;
mod damaged;
mod faces;
mod in_memory;
mod mutants;
