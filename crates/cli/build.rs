//! Sets a `cfg` for each optional resource of the tests: photographs and other programs. A test whose resource is
//! missing is reported as ignored, with the reason.

use std::env::{consts::EXE_SUFFIX, split_paths, var_os};
use std::path::{Path, PathBuf};

fn main() {
    println!("cargo::rustc-check-cfg=cfg(has_data, has_opencv, has_gcc, has_poppler, has_python)");
    println!("cargo::rerun-if-env-changed=DELTILLE_DATA");
    println!("cargo::rerun-if-env-changed=DELTILLE_PYTHON");
    println!("cargo::rerun-if-changed=build.rs");
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let root = var_os("DELTILLE_DATA").map_or_else(beside, PathBuf::from);
    let path = var_os("PATH").unwrap_or_default();
    let is_program =
        |name: &str| split_paths(&path).any(|at| at.join(format!("{name}{EXE_SUFFIX}")).is_file());
    for (name, is_there) in [
        ("data", root.join("robot-hand").is_dir()),
        ("opencv", var_os("DELTILLE_PYTHON").is_some()),
        ("gcc", is_program("gcc") && is_program("g++")),
        ("poppler", is_program("pdftoppm")),
        ("python", is_program("python3")),
    ] {
        if is_there {
            println!("cargo::rustc-cfg=has_{name}");
        }
    }
}
