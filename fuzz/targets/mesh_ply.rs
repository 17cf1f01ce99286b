#![no_main]

deltille_fuzz::target!("mesh_ply");
