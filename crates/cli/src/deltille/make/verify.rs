//! `deltille verify`.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::{Context, bail};
use serde::Serialize;

use crate::deltille::files::limits::AllLimits;
use crate::deltille::files::target_file;
use crate::deltille::files::written::same_file;
use crate::output::{self, Overwrite, ResultFormat, log, report, say};
use crate::run::{self, FAILED};
use crate::{interrupt, progress};
use deltille::export::kind::Kind;
use deltille::export::{laser_file_name, sheet_file_name, stl, threemf};
use deltille::layout::Printing;
use deltille::limits::Limits;
use deltille::target_file::find;
use deltille::targets::Target;
use deltille::verify::{Progress, Verdict, Verifier};
use deltille_core::words::{counted, shown};

/// Arguments of `deltille verify`.
#[derive(clap::Args)]
pub struct Args {
    /// Target description, as written by `deltille board`, or the folder that contains it
    target: PathBuf,
    /// Files to verify [default: all files of the target in the same folder]
    artifacts: Vec<PathBuf>,
    /// Family of the tags, by name or file; needed only if the family named in the target is unknown
    #[arg(long)]
    family: Option<String>,
    /// Write all measurements and findings as JSON
    #[arg(long, value_name = "FILE")]
    report: Option<PathBuf>,
    #[command(flatten)]
    result_format: ResultFormat,
    #[command(flatten)]
    limits: AllLimits,
    #[command(flatten)]
    overwrite: Overwrite,
}

/// Verifies files against their target description.
pub fn run(args: Args) -> anyhow::Result<ExitCode> {
    let limits = args.limits.limits();
    let description = find(&args.target)?;
    let mut printing = target_file::read(&description, &limits)?;
    target_file::set_family(&mut printing.target, args.family.as_deref())?;
    let printing = printing.under_printed_name();
    let folder = description.parent().unwrap_or(Path::new("."));
    let alone = args.artifacts.len() == 1;
    let artifacts = match args.artifacts.as_slice() {
        [] => {
            let mut beside = artifacts_beside(folder, &printing);
            // A description cannot verify itself.
            beside.retain(|path| !same_file(path, &description));
            beside
        }
        given => given.to_vec(),
    };
    if artifacts.is_empty() && description.extension().is_some_and(|end| end == "dsc") {
        bail!(
            "{}: a .dsc does not describe pages or meshes: use the .json of the target, or list other files to verify",
            description.display()
        );
    }
    if artifacts.is_empty() {
        let name = &printing.target.name;
        bail!(
            "no {name}.pdf, .svg, .png, .glb, .obj, .sdf, .urdf, .xml, .usda, .3mf, .stl, .dsc or .dxf found beside {}; list the files to verify",
            args.target.display()
        );
    }
    if let Some(path) = &args.report {
        args.overwrite.check(path, &Kind::of_schema(SCHEMA)).context("--report")?;
        output::check_writable("--report", path)?;
    }
    interrupt::set_status("not all files were verified");
    let proof = prove(&printing, &artifacts, alone, args.result_format, limits)?;
    if let Some(path) = &args.report {
        let json = serde_json::to_string_pretty(&proof).context("--report")? + "\n";
        output::write(path, json.as_bytes(), args.overwrite).context("--report")?;
    }
    match args.result_format.is_json() {
        true => output::print_json(&proof)?,
        false => proof.print_summary()?,
    }
    Ok(proof.code())
}

/// Verifies files, and prints a line for each unless the output is JSON. All pages of a target are among them, unless
/// one is verified `alone`.
pub fn prove(
    printing: &Printing,
    artifacts: &[PathBuf],
    alone: bool,
    result_format: ResultFormat,
    limits: Limits,
) -> anyhow::Result<Proof> {
    let bar = progress::bar(1, "");
    let show = |Progress { done, total }: Progress| {
        bar.set_length(total as u64);
        bar.set_position(done as u64);
    };
    let verifier = Verifier::new(printing)?.within(limits).cancelled_by(interrupt::flag());
    let verifier = verifier.with_progress(&show);
    let mut proof = Proof::of(&printing.target);
    let mut done = BTreeSet::new();
    for path in artifacts {
        // The pages of a net are verified together.
        if done.contains(path) {
            continue;
        }
        done.extend(verifier.set_of(path));
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        bar.set_message(shown(&name).into_owned());
        bar.reset();
        let verdict = verifier.verify_path(path);
        bar.finish_and_clear();
        match verdict {
            Ok(verdict) => proof.add(verdict, result_format)?,
            Err(error) if interrupt::is_raised() => return Err(error.into()),
            // The remaining files are still verified.
            Err(error) => {
                let error = anyhow::Error::from(error);
                let message = run::message(&error);
                // Several meshes may report the same missing texture.
                if !proof.errors.contains(&message) {
                    run::report(&error);
                    proof.errors.push(message);
                }
                proof.passed = false;
            }
        }
    }
    for verdict in verifier.incomplete_sets(artifacts, alone) {
        proof.add(verdict, result_format)?;
    }
    Ok(proof)
}

/// Returns the artifacts of a target in a folder; reports those that cannot belong to it.
fn artifacts_beside(folder: &Path, printing: &Printing) -> Vec<PathBuf> {
    let name = &printing.target.name;
    let present = |name: String| Some(folder.join(name)).filter(|path| path.is_file());
    let count = printing.page_count();
    let drawn = ["svg", "png"].into_iter().flat_map(|extension| {
        let page = move |index| sheet_file_name(name, index, count, extension);
        let single = (count == 0).then(|| format!("{name}.{extension}"));
        (0..count).map(page).chain(single)
    });
    let printed = [format!("{name}.pdf")].into_iter().chain(drawn).filter_map(present);
    let printed: Vec<PathBuf> = printed.collect();
    let meshes = ["glb", "obj", "sdf", "urdf", "xml", "usda", "3mf", "stl", "dsc"];
    let meshes = meshes.map(|extension| format!("{name}.{extension}"));
    let skeletons = [stl::skeleton_name(name), threemf::skeleton_name(name)];
    let panels = [format!("{name}-panels.dxf"), format!("{name}-net.dxf")];
    let laser = ["dxf", "svg"].map(|extension| laser_file_name(name, extension));
    let more = skeletons.into_iter().chain(panels).chain(laser);
    let meshes = meshes.into_iter().chain(more).filter_map(present);
    if printing.sheets.is_empty() {
        for path in printed {
            log!(
                "{}: not verified, because the description of {name} has no paper layout: print it again, or remove the \
                 file",
                path.display()
            );
        }
        return meshes.collect();
    }
    for path in pages_too_many(folder, printing) {
        log!(
            "{}: not verified, because {name} has {}: remove or rename the file",
            path.display(),
            counted(count, "page")
        );
    }
    printed.into_iter().chain(meshes).collect()
}

/// Returns files with names of pages that the target does not have, sorted.
fn pages_too_many(folder: &Path, printing: &Printing) -> Vec<PathBuf> {
    let pages: BTreeSet<String> = ["svg", "png"]
        .into_iter()
        .flat_map(|extension| {
            let count = printing.page_count();
            (0..count)
                .map(move |page| sheet_file_name(&printing.target.name, page, count, extension))
        })
        .collect();
    let is_too_many = |path: &PathBuf| {
        let [stem, extension] =
            [path.file_stem(), path.extension()].map(|part| part.and_then(|p| p.to_str()));
        let (Some(stem), Some("svg" | "png")) = (stem, extension) else { return false };
        let number =
            stem.strip_prefix(&*printing.target.name).and_then(|rest| rest.strip_prefix('-'));
        let of_page = number.is_some_and(|number| number.parse::<usize>().is_ok());
        let file = path.file_name().map(|name| name.to_string_lossy().into_owned());
        // Another target may have that name.
        of_page
            && file.is_some_and(|file| !pages.contains(&file))
            && !path.with_extension("json").is_file()
    };
    let listed = Some(folder).filter(|folder| !folder.as_os_str().is_empty());
    let files = std::fs::read_dir(listed.unwrap_or(Path::new("."))).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> =
        files.map(|entry| folder.join(entry.file_name())).filter(is_too_many).collect();
    found.sort();
    found
}

/// Schema and version of the file written by `--report`.
const SCHEMA: &str = "deltille/verdict/1";

/// Results of the files of a target.
#[derive(Serialize)]
pub struct Proof {
    schema: &'static str,
    target: String,
    passed: bool,
    artifacts: Vec<Verdict>,
    /// Files that could not be verified.
    #[serde(skip_serializing_if = "<[_]>::is_empty")]
    errors: Vec<String>,
}

impl Proof {
    fn of(target: &Target) -> Self {
        let target = target.name.to_string();
        Self { schema: SCHEMA, target, passed: true, artifacts: Vec::new(), errors: Vec::new() }
    }

    fn add(&mut self, verdict: Verdict, result_format: ResultFormat) -> anyhow::Result<()> {
        match (result_format.is_json(), verdict.passed) {
            (true, _) => {}
            (false, true) => report!("{verdict}"),
            (false, false) => say!("{verdict}"),
        }
        self.passed &= verdict.passed;
        self.artifacts.push(verdict);
        Ok(())
    }

    /// Prints a summary; files that could not be verified have already been reported.
    pub fn print_summary(&self) -> anyhow::Result<()> {
        let Self { target, artifacts, .. } = self;
        let files = counted(artifacts.len(), "file");
        match artifacts.iter().filter(|verdict| !verdict.passed).count() {
            _ if !self.errors.is_empty() => {}
            0 => report!("verified: {files} of target {target}"),
            1 => say!("FAILED: 1 of {files} differs from target {target}"),
            failed => say!("FAILED: {failed} of {files} differ from target {target}"),
        }
        Ok(())
    }

    /// Returns the exit code.
    pub fn code(&self) -> ExitCode {
        match (self.errors.is_empty(), self.passed) {
            (false, _) => ExitCode::from(run::BAD_INPUT),
            (true, false) => ExitCode::from(FAILED),
            (true, true) => ExitCode::SUCCESS,
        }
    }
}
