use super::*;

fn read(body: &str) -> Result<Logo, LogoError> {
    from_svg(&format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" xmlns:xlink="http://www.w3.org/1999/xlink" viewBox="0 0 100 100">{body}</svg>"#
    ))
}

/// The black area of a logo scaled to a height of 100.
fn black(body: &str) -> f64 {
    let logo = read(body).unwrap_or_else(|error| panic!("{body}: {error}"));
    let place =
        deltille_layout::LogoPlacement { at_mm: DVec2::ZERO, angle_rad: 0.0, height_mm: 100.0 };
    let outlines = logo.outlines_mm(&place);
    let area: f64 = outlines.iter().map(|outline| signed_area(outline)).sum();
    area.abs()
}

fn signed_area(outline: &[DVec2]) -> f64 {
    let next = outline.iter().cycle().skip(1);
    outline.iter().zip(next).map(|(a, b)| a.perp_dot(*b) / 2.0).sum()
}

#[test]
fn paint_is_black_and_white_is_paper() {
    let frame = r#"<path d="M0 0H100V100H0Z"/>"#;
    let cases = [
        (frame.to_owned(), 10_000.0),
        // A shape painted twice is black; it is not a hole.
        (format!(r##"{frame}<circle cx="50" cy="50" r="20" fill="#c00"/>"##), 10_000.0),
        (format!(r##"{frame}<circle cx="50" cy="50" r="20" fill="#fff"/>"##), 10_000.0 - 400.0 * std::f64::consts::PI),
        (format!(r##"<rect width="50" height="100" fill="#fff"/>{frame}"##), 10_000.0),
        (r#"<path fill-rule="evenodd" d="M0 0H100V100H0ZM10 10H90V90H10Z"/>"#.to_owned(), 3_600.0),
        (r#"<path d="M0 0H100V100H0ZM10 10H90V90H10Z"/>"#.to_owned(), 10_000.0),
        // A stroke covers an area for each dash.
        (
            r##"<path fill="none" stroke="#000" stroke-width="50" stroke-dasharray="25 50" d="M0 25H100M0 75H100"/>"##
                .to_owned(),
            5_000.0,
        ),
        (r##"<path fill="none" stroke="#000" stroke-width="10" d="M5 5H95V95H5Z"/>"##.to_owned(), 3_600.0),
        // A clip limits the area.
        (format!(r##"<clipPath id="a"><path d="M0 0H50V50H0ZM50 50H100V100H50Z"/></clipPath><g clip-path="url(#a)">{frame}</g>"##), 5_000.0),
        (r##"<defs><g id="a"><path d="M0 0H50V50H0Z"/></g></defs><use xlink:href="#a"/><use href="#a" x="50" y="50"/>"##.to_owned(), 5_000.0),
        (format!(r##"<style>.k{{fill:#fff}}</style>{frame}<rect class="k" y="50" width="50" height="50"/>"##), 7_500.0),
    ];
    for (body, expected) in cases {
        let found = black(&body);
        assert!((found - expected).abs() < 1.0, "{body}: {found}, not {expected}");
    }
}

#[test]
fn unprintable_elements_are_named() {
    let frame = r#"<path id="leaf" d="M0 0H100V100H0Z" "#;
    let gradient = r##"<linearGradient id="g"><stop stop-color="#f00"/><stop offset="1" stop-color="#00f"/></linearGradient>"##;
    let cases = [
        (
            r#"<text id="t" y="9">deltille</text>"#.to_owned(),
            "`text` with the id `t` cannot be printed: convert it to paths",
        ),
        (
            r#"<image href="a.png" width="9" height="9"/>"#.to_owned(),
            "`image` cannot be printed: trace it",
        ),
        (
            format!(r##"{gradient}{frame}fill="url(#g)"/>"##),
            "the element with the id `leaf` is painted with a gradient",
        ),
        (format!(r#"{frame}fill-opacity="0.5"/>"#), "is transparent"),
        (
            r#"<rect width="9" height="9" opacity="0.5"/>"#.to_owned(),
            "an element is transparent: make it opaque",
        ),
        (format!(r#"<g opacity="0.5">{frame}/></g>"#), "is transparent"),
        (
            format!(
                r##"<filter id="f"><feGaussianBlur stdDeviation="2"/></filter><g id="h" filter="url(#f)">{frame}/></g>"##
            ),
            "the element with the id `h` has a filter",
        ),
        (String::new(), "the logo has no black area"),
        (format!(r#"{frame}fill="white"/>"#), "the logo has no black area"),
        ("<path".to_owned(), "not a readable SVG"),
        (r#"<rect width="100" height="1"/>"#.to_owned(), "the aspect ratio is 100 to 1"),
    ];
    for (body, expected) in cases {
        let said = read(&body).unwrap_err().to_string();
        assert!(said.contains(expected) && !said.contains('\n'), "{body}: {said}");
    }
}

#[test]
fn files_made_to_exhaust_their_reader_are_refused() {
    let began = std::time::Instant::now();
    let uses: String = (0..30)
        .map(|i| format!(r##"<g id="a{}"><use href="#a{i}"/><use href="#a{i}"/></g>"##, i + 1))
        .collect();
    let nested = format!(r#"<path id="a0" d="M0 0H9V9Z"/>{uses}"#);
    let comb: String = (0..900)
        .map(|i| {
            format!("M{i} 0H{}V900H{i}ZM0 {i}H900V{}H0Z", f64::from(i) + 0.5, f64::from(i) + 0.5)
        })
        .collect();
    let depth = 5_000;
    let cases = [
        (nested, "elements"),
        (r##"<g id="a"><use href="#a"/></g>"##.to_owned(), ""),
        (format!(r#"<path d="{comb}"/>"#), "crossings"),
        (r#"<path stroke="red" stroke-dasharray="0.0001" d="M0 0H99V99"/>"#.to_owned(), "dashes"),
        (format!(r#"<path d="{}"/>"#, "M0 0C9 0 9 9 0 9".repeat(9_000)), "corners"),
        ("<g>".repeat(depth) + &"</g>".repeat(depth), ""),
        ("x".repeat(MAX_LOGO_BYTES + 1), "bytes"),
        (r#"<path d="M0 0H1e38V1e38Z"/><path d="M0 0L1e-38 0 0 1e-38Z"/>"#.to_owned(), "?"),
    ];
    for (body, expected) in cases {
        let start: String = body.chars().take(60).collect();
        match read(&body) {
            Err(error) => {
                assert!(expected == "?" || error.to_string().contains(expected), "{start}: {error}")
            }
            Ok(_) => assert_eq!(expected, "?", "{start}"),
        }
    }
    assert!(began.elapsed() < TIME, "{:?}", began.elapsed());
}

#[test]
fn altered_files_do_not_crash_the_reader() {
    let good = r##"<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 90 80"><clipPath id="c"><circle cx="40" cy="40" r="39"/></clipPath><g clip-path="url(#c)" transform="rotate(9)"><path d="M10 10C20 0 40 0 50 10L90 80Z" stroke="#123" stroke-width="3" stroke-linejoin="round"/></g><path fill="#fff" d="M20 20h9v9z"/></svg>"##;
    assert!(from_svg(good).is_ok());
    let bytes = b"0919-.eM<>#\"/ zQA";
    let mut state = 1_u64;
    for _ in 0..300 {
        let mut text = good.as_bytes().to_vec();
        for _ in 0..3 {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            let at = (state >> 33) as usize;
            let place = at % text.len();
            text[place] = bytes[(at / text.len()) % bytes.len()];
        }
        let text = String::from_utf8(text).expect("ASCII");
        match from_svg(&text) {
            Err(LogoError::Broken(broken)) => panic!("{broken}: {text}"),
            Err(_) => {}
            Ok(logo) => {
                let again = Logo::try_from(logo.to_string());
                assert_eq!(again, Ok(logo), "{text}");
            }
        }
    }
}
