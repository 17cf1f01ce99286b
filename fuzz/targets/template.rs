#![no_main]

deltille_fuzz::target!("template");
