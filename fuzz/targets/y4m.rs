#![no_main]

deltille_fuzz::target!("y4m");
