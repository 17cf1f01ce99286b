//! What `wasm-bindgen` does, without the program of that name, which would have to be installed in just the version of the
//! library: makes a module for a browser, with its JavaScript and types, of what the compiler made.

use std::process::ExitCode;

use wasm_bindgen_cli_support::Bindgen;

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [made, folder, name] = &arguments[..] else {
        eprintln!("usage: deltille-bindgen <WASM> <FOLDER> <NAME>");
        return ExitCode::FAILURE;
    };
    let mut bindgen = Bindgen::new();
    bindgen.input_path(made).out_name(name).typescript(true);
    bindgen.remove_name_section(true).remove_producers_section(true);
    let written = bindgen.web(true).and_then(|bindgen| bindgen.generate(folder));
    match written {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error:#}");
            ExitCode::FAILURE
        }
    }
}
