//! Makes a browser module, with JavaScript and type declarations, from a compiled WebAssembly file. It replaces the program
//! `wasm-bindgen`, which would have to be installed in exactly the version of the library.

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
