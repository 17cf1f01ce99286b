#![no_main]

deltille_fuzz::target!("verify_laser");
