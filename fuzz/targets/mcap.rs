#![no_main]

deltille_fuzz::target!("mcap");
