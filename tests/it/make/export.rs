//! Output of the writers: reviewed as text, and rendered by independent programs.

use std::path::Path;
use std::process::Command;

use deltille::artwork::{Artwork, Paint, Part, Shape};
use deltille::export::{pdf, png, svg};
use deltille::family::Family;
use deltille::lattice::GridKind;
use deltille::layout::{PaperSpec, Printing};
use deltille::photograph;
use deltille::raster::{AnyGray, Gray};
use deltille::targets::{BoardSpec, TagSpec, TargetSpec};
use deltille::verify::Document;
use kurbo::BezPath;
use lopdf::Object;
use tempfile::TempDir;

fn tiny(inverted: bool) -> Artwork {
    let tags = Some(TagSpec { first_id: 4, ..TagSpec::default() });
    let spec = BoardSpec { tags, inverted, ..BoardSpec::new(GridKind::Deltille, 2, 3, 20.0) };
    let family = Family::shipped("delTag25h7").unwrap();
    let paper = PaperSpec::default();
    let target = Printing::build("tiny", &TargetSpec::Board(spec), Some(&family), Some(&paper));
    target.unwrap().draw().unwrap()
}

/// Removes the outlines of the letters, which nobody reviews.
fn without_text(mut artwork: Artwork) -> Artwork {
    let shapes = &mut artwork.sheets[0].shapes;
    shapes.retain(|shape| !matches!(shape.part, Part::Label { .. }));
    artwork
}

#[test]
fn svg_text() {
    insta::assert_snapshot!("svg", svg::to_string(&without_text(tiny(false)), 0));
    insta::assert_snapshot!("svg_inverted", svg::to_string(&without_text(tiny(true)), 0));
}

#[test]
fn pdf_structure_and_content() {
    let bytes = pdf::to_bytes(&without_text(tiny(false)));
    let document = lopdf::Document::load_mem(&bytes).unwrap();
    let page = *document.get_pages().get(&1).unwrap();
    let content = String::from_utf8(document.get_page_content(page)).unwrap();
    let info = document.trailer.get(b"Info").and_then(Object::as_reference).unwrap();
    insta::assert_snapshot!(
        "pdf",
        format!(
            "catalog {:?}\ninfo {:?}\npage {:?}\n{content}",
            document.catalog().unwrap(),
            document.get_dictionary(info).unwrap(),
            document.get_dictionary(page).unwrap().get(b"MediaBox").unwrap(),
        )
    );
}

#[test]
fn the_same_artwork_gives_the_same_bytes() {
    assert_eq!(pdf::to_bytes(&tiny(false)), pdf::to_bytes(&tiny(false)));
    let png = || png::to_bytes(&tiny(false).sheets[0], "tiny", 150.0).unwrap();
    assert_eq!(png(), png());
}

/// Returns the mean difference of two images of the same page, grey levels, and the fraction of pixels that differ by
/// more than half the range.
fn difference(a: &Gray<u8>, b: &Gray<u8>) -> (f64, f64) {
    let (width, height) = (a.width().min(b.width()), a.height().min(b.height()));
    let (mut sum, mut far) = (0u64, 0u64);
    for y in 0..height {
        for (&a, &b) in a.row(y)[..width].iter().zip(&b.row(y)[..width]) {
            sum += u64::from(a.abs_diff(b));
            far += u64::from(a.abs_diff(b) > 127);
        }
    }
    let pixels = (width * height) as f64;
    (sum as f64 / pixels, far as f64 / pixels)
}

#[track_caller]
fn assert_same(what: &str, a: &Gray<u8>, b: &Gray<u8>) {
    let (mean, far) = difference(a, b);
    assert!(mean < 0.3 && far < 1e-4, "{what}: mean {mean}, far {far}");
}

#[test]
fn all_formats_show_the_same() {
    compare_formats(false);
}

#[test]
#[cfg_attr(not(has_poppler), ignore = "no pdftoppm (poppler) on the path")]
fn poppler_shows_the_same() {
    compare_formats(true);
}

/// A tile, a field, a stroke and text look the same in every format and renderer.
fn compare_formats(with_poppler: bool) {
    let folder = TempDir::new().unwrap();
    for inverted in [false, true] {
        let mut artwork = tiny(inverted);
        let mut path = BezPath::new();
        path.move_to((20.0, 8.0));
        path.curve_to((40.0, 1.0), (60.0, 19.0), (80.0, 8.0));
        artwork.sheets[0].shapes.push(Shape {
            part: Part::Label { index: 99 },
            paint: Paint::Stroke { width_mm: 0.5 },
            path,
        });
        let file = |name: &str| folder.path().join(name);
        pdf::write(&artwork, &file("t.pdf")).unwrap();
        svg::write(&artwork, 0, &file("t.svg")).unwrap();
        png::write(&artwork.sheets[0], "t", &file("t.png"), 254.0).unwrap();

        let [pdf, svg, png] = ["t.pdf", "t.svg", "t.png"]
            .map(|name| Document::open(&file(name)).unwrap().render(0, 10.0).unwrap().image);
        assert_same("hayro's PDF and the PNG", &pdf, &png);
        assert_same("resvg's SVG and the PNG", &svg, &png);
        if with_poppler {
            assert_same("poppler's PDF and the PNG", &poppler(&file("t.pdf")), &png);
        }
    }
}

/// Renders a PDF with poppler at 10 px/mm.
fn poppler(pdf: &Path) -> Gray<u8> {
    let stem = pdf.with_file_name("poppler");
    let run = Command::new("pdftoppm")
        .args(["-r", "254", "-gray", "-png", "-singlefile"])
        .args([pdf, &stem])
        .status();
    assert!(run.unwrap().success(), "pdftoppm rejects the file");
    match photograph::read(stem.with_extension("png")).unwrap() {
        // Poppler does not render pure K as quite black.
        AnyGray::U8(image) => {
            let black = f64::from(*image.pixels().iter().min().unwrap());
            image.map(|v| ((f64::from(v) - black) * 255.0 / (255.0 - black)).round() as u8)
        }
        AnyGray::U16(_) => panic!("8 bits were asked for"),
    }
}

#[test]
fn sizes_are_exact() {
    let folder = TempDir::new().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut artwork = tiny(false);
    for (width, height) in [(210.0, 297.0), (841.0, 1189.0), (215.9, 279.4), (100.1, 33.3)] {
        (artwork.sheets[0].width_mm, artwork.sheets[0].height_mm) = (width, height);
        pdf::write(&artwork, &file("t.pdf")).unwrap();
        svg::write(&artwork, 0, &file("t.svg")).unwrap();
        for name in ["t.pdf", "t.svg"] {
            let (w, h) = Document::open(&file(name)).unwrap().size_mm(0).into();
            assert!((w - width).abs() < 1e-4 && (h - height).abs() < 1e-4, "{name}: {w} x {h}");
        }
    }
}

#[test]
fn files_that_are_not_artifacts_are_rejected_in_one_line() {
    let folder = TempDir::new().unwrap();
    let file = |name: &str| folder.path().join(name);
    let whole = pdf::to_bytes(&tiny(false));
    let contents: [(&str, &[u8]); 7] = [
        ("empty.pdf", b""),
        ("text.pdf", b"no PDF"),
        ("empty.svg", b""),
        ("unsized.svg", b"<svg xmlns='http://www.w3.org/2000/svg' width='100%' height='9mm'/>"),
        ("empty.png", b""),
        ("cut.png", &png::to_bytes(&tiny(false).sheets[0], "t", 30.0).unwrap()[..200]),
        ("other.txt", &whole),
    ];
    for (name, content) in contents {
        std::fs::write(file(name), content).unwrap();
        let Err(error) = Document::open(&file(name)) else { panic!("{name} was opened") };
        let message = error.to_string();
        assert!(message.contains(name) && !message.contains('\n'), "{message}");
    }
    assert!(Document::open(&file("absent.pdf")).is_err());
}
