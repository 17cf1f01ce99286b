#![no_main]

deltille_fuzz::target!("rosbag1");
