//! `deltag sheet`: tags at true scale, read back from the written files.

use crate::common::folder::names;
use crate::common::page::Page;
use deltille::export::svg;
use deltille::family::Family;
use deltille::layout::{PaperSpec, Printing};
use deltille::targets::{TagSheetSpec, TargetSpec};
use deltille::verify::{Finding, MarkFinding, TileFinding, Verifier};

#[test]
fn sheets_are_written_in_every_format_and_verified() {
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let mut page = Page::default();
    for (args, files) in [
        (
            "--pdf --svg --png --dpi 200 --ids 0-2,9,30-33 --name few",
            &["few.pdf", "few.png", "few.svg"][..],
        ),
        ("--svg --name all", &["all-1.svg", "all-2.svg", "all-3.svg"]),
        ("--edge 15mm", &["d16h5-sheet.pdf"]),
    ] {
        let out = at.join(files[0]);
        page.run(
            at,
            &format!("deltag sheet d16h5 {args} -o {}", files[0].split('.').next().unwrap()),
        );
        assert_eq!(names(&out.with_extension("")), files);
    }
    let text = std::fs::read_to_string(at.join("all-1/all-1.svg")).unwrap();
    assert!(text.contains("fingerprint"), "the fingerprint is in the metadata");
    page.title("Rejected");
    for args in [
        "d36h9",
        "d16h5 --edge 1mm",
        "d16h5 --edge wide",
        "d16h5 --edge 400mm",
        "d16h5 --paper A9",
        "d16h5 --png --paper 3000x3000mm --dpi 2400 -o nowhere",
        "d16h5 --margin -1mm",
        "d16h5 --orientation up",
        "d16h5 --tag-border 0",
        "d16h5 --ids 5-3",
        "d16h5 --ids 99",
        "d16h5 -o x.json",
    ] {
        page.refused(at, &format!("deltag sheet {args}"));
    }
    page.is("deltag-sheet");
}

/// Returns the verdict on a sheet of four tags after an edit of its tag codes or of its SVG.
fn verdict(ids: &[u32], edit: impl Fn(&str) -> String) -> deltille::verify::Verdict {
    let family = Family::shipped("delTag25h7").unwrap();
    let build = |ids: &[u32]| {
        let (family_name, ids) = ("delTag25h7".to_owned(), ids.to_vec());
        let spec = TagSheetSpec { family: family_name, ids, edge_mm: 40.0, border_bits: 1.5 };
        let paper = PaperSpec { size: Some("A5".parse().unwrap()), ..PaperSpec::default() };
        Printing::build("tags", &TargetSpec::Tags(spec), Some(&family), Some(&paper)).unwrap()
    };
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("tags.svg");
    let drawn = build(ids).draw().unwrap();
    std::fs::write(&path, edit(&svg::to_string(&drawn, 0))).unwrap();
    let target = build(&[5, 6, 7, 8]);
    Verifier::new(&target).unwrap().verify_path(&path).unwrap()
}

#[test]
fn a_wrong_sheet_is_rejected_with_the_reason() {
    let same = str::to_owned;
    assert!(verdict(&[5, 6, 7, 8], same).passed);

    let exchanged = verdict(&[5, 7, 6, 8], same);
    assert!(!exchanged.passed && exchanged.sheets[0].tags_exact == 2, "{exchanged}");
    let reads = exchanged.sheets[0].findings.iter().any(|finding| {
        matches!(finding, Finding::Tile(TileFinding::TagReads { id: 6, reads: 7, .. }))
    });
    assert!(reads, "{exchanged}");

    let without = |svg: &str, id: &str| {
        let at = svg.find(&format!("id=\"{id}\"")).unwrap();
        let begin = svg[..at].rfind("<path").unwrap();
        let end = at + svg[at..].find("/>").unwrap() + 2;
        [&svg[..begin], &svg[end..]].concat()
    };
    let cut = |svg: &str| without(svg, "tile-8-r0-c0");
    let missing = verdict(&[5, 6, 7, 8], cut);
    assert_eq!(missing.sheets[0].findings, [TileFinding::TagMissing { id: 8 }.into()], "{missing}");

    let text = |svg: &str| without(svg, "label-4");
    let nameless = verdict(&[5, 6, 7, 8], text);
    assert!(
        matches!(nameless.sheets[0].findings[..], [Finding::Mark(MarkFinding::TextDiffers { .. })]),
        "{nameless}"
    );
}
