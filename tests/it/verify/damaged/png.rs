//! Damaged PNG.

use image::{DynamicImage, GrayImage, ImageFormat, Luma};

use super::edit::{append, find, swap};
use super::{BOARD, Case, Damage, cases};
use crate::common::png::chunk;

/// Inserts a chunk before the pixels.
pub fn with_chunk(name: &'static [u8; 4], data: &'static [u8]) -> Damage {
    Box::new(move |bytes| {
        // The length precedes the name.
        let at = find(bytes, b"IDAT") - 4;
        [&bytes[..at], &chunk(name, data), &bytes[at..]].concat()
    })
}

/// Sets a byte of the head: 8 depth, 9 colour type, 12 interlace.
fn head(at: usize, value: u8) -> Damage {
    Box::new(move |bytes| {
        let mut head = bytes[16..29].to_vec();
        head[at] = value;
        [&bytes[..8], &chunk(b"IHDR", &head), &bytes[33..]].concat()
    })
}

/// Replaces the pixels and keeps resolution and title.
pub fn pixels(draw: impl Fn(GrayImage) -> DynamicImage + 'static) -> Damage {
    Box::new(move |bytes| {
        let picture = image::load_from_memory(bytes).unwrap().into_luma8();
        let mut drawn = std::io::Cursor::new(Vec::new());
        draw(picture).write_to(&mut drawn, ImageFormat::Png).unwrap();
        let (drawn, pixels) = (drawn.into_inner(), find(bytes, b"IDAT") - 4);
        [&drawn[..33], &bytes[33..pixels], &drawn[33..]].concat()
    })
}

/// Swaps black and white in a square; its corner as a fraction of the image, its side in pixels.
pub fn square([across, down]: [f64; 2], side: u32) -> Damage {
    pixels(move |mut picture| {
        let [x, y] = [across * f64::from(picture.width()), down * f64::from(picture.height())];
        for (dx, dy) in (0..side).flat_map(|dx| (0..side).map(move |dy| (dx, dy))) {
            let Luma([grey]) = picture.get_pixel_mut(x as u32 + dx, y as u32 + dy);
            *grey = 255 - *grey;
        }
        picture.into()
    })
}

/// Fills a square with grey; its corner as a fraction of the image, its side in pixels.
pub fn level([across, down]: [f64; 2], side: u32, level: u8) -> Damage {
    pixels(move |mut picture| {
        let [x, y] = [across * f64::from(picture.width()), down * f64::from(picture.height())];
        for (dx, dy) in (0..side).flat_map(|dx| (0..side).map(move |dy| (dx, dy))) {
            picture.put_pixel(x as u32 + dx, y as u32 + dy, Luma([level]));
        }
        picture.into()
    })
}

/// Draws a rectangle on the first check bar: distance from its first end, length and height, mm.
fn on_bar(from_mm: f64, length_mm: f64, height_mm: f64, level: u8) -> Damage {
    const PX_PER_MM: f64 = 300.0 / 25.4;
    let sheet = &BOARD.target.sheets[0];
    let (x, y) = sheet.check_bars[0].from_mm.into();
    let along_x: bool = (sheet.check_bars[0].to_mm.y - y).abs() < 1e-9;
    let ends = |along: f64, across: f64| {
        if along_x { [x + along, y + across] } else { [x + across, y + along] }
    };
    let [a, b] = [ends(from_mm, -height_mm / 2.0), ends(from_mm + length_mm, height_mm / 2.0)];
    let page_mm = sheet.height_mm;
    let px = move |mm: f64| (mm * PX_PER_MM).round() as u32;
    pixels(move |mut picture| {
        for across in px(a[0].min(b[0]))..px(a[0].max(b[0])) {
            for down in px(page_mm - a[1].max(b[1]))..px(page_mm - a[1].min(b[1])) {
                picture.put_pixel(across, down, Luma([level]));
            }
        }
        picture.into()
    })
}

/// Maps all grey values.
pub fn grey(mut picture: GrayImage, change: impl Fn(u8) -> u8) -> DynamicImage {
    picture.pixels_mut().for_each(|Luma([grey])| *grey = change(*grey));
    picture.into()
}

/// Makes every fifth pixel of every third row slightly darker.
fn noise(mut picture: GrayImage) -> DynamicImage {
    for (x, y, Luma([grey])) in picture.enumerate_pixels_mut() {
        *grey ^= if x % 5 == 0 && y % 3 == 0 { 16 } else { 0 };
    }
    picture.into()
}

/// Sets the resolution, in pixels per unit along each side.
fn resolution(along: u32, up: u32, unit: u8) -> Damage {
    Box::new(move |bytes| {
        let at = find(bytes, b"pHYs") - 4;
        let data = [&along.to_be_bytes()[..], &up.to_be_bytes(), &[unit]].concat();
        [&bytes[..at], &chunk(b"pHYs", &data), &bytes[at + 21..]].concat()
    })
}

/// Changes the checksum of the compressed pixels, in the last of their chunks.
fn packed_sum() -> Damage {
    Box::new(|bytes| {
        let end = bytes.len() - 12;
        let at = bytes[..end].windows(4).rposition(|name| name == b"IDAT").unwrap();
        let mut data = bytes[at + 4..end - 4].to_vec();
        *data.last_mut().unwrap() ^= 1;
        [&bytes[..at - 4], &chunk(b"IDAT", &data), &bytes[end..]].concat()
    })
}

/// Adds data to the last chunk of compressed pixels.
fn more_packed() -> Damage {
    Box::new(|bytes| {
        let end = bytes.len() - 12;
        [&bytes[..end], &chunk(b"IDAT", b"more"), &bytes[end..]].concat()
    })
}

/// Puts the edited compressed pixels into one chunk.
fn packed(edit: impl Fn(&mut Vec<u8>) + 'static) -> Damage {
    Box::new(move |bytes| {
        let first = find(bytes, b"IDAT") - 4;
        let (mut at, mut data) = (first, Vec::new());
        while &bytes[at + 4..at + 8] == b"IDAT" {
            let length = u32::from_be_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
            data.extend_from_slice(&bytes[at + 8..at + 8 + length]);
            at += 12 + length;
        }
        edit(&mut data);
        [&bytes[..first], &chunk(b"IDAT", &data), &bytes[at..]].concat()
    })
}

/// Changes the last byte of the checksum of a chunk with `length` bytes of data.
fn sum_of(name: &'static str, length: usize) -> Damage {
    Box::new(move |bytes| {
        let mut bytes = bytes.to_vec();
        let at = find(&bytes, name.as_bytes());
        bytes[at + 4 + length + 3] ^= 1;
        bytes
    })
}

/// Changes the checksum of the last chunk.
fn last_byte() -> Damage {
    Box::new(|bytes| {
        let (last, rest) = bytes.split_last().unwrap();
        [rest, &[last ^ 1]].concat()
    })
}

/// Returns the cases for a board.
pub fn board() -> Vec<Case> {
    cases(
        "b.png",
        vec![
            ("a gamma", with_chunk(b"gAMA", &[0, 0, 0, 1])),
            ("a colour space", with_chunk(b"sRGB", &[0])),
            ("a profile", with_chunk(b"iCCP", b"a\0\0")),
            ("primary colours", with_chunk(b"cHRM", &[0; 32])),
            ("transparent black", with_chunk(b"tRNS", &[0, 0])),
            ("a background", with_chunk(b"bKGD", &[0, 0])),
            ("an animation", with_chunk(b"acTL", &[0, 0, 0, 2, 0, 0, 0, 0])),
            ("an orientation", with_chunk(b"eXIf", b"MM")),
            ("a palette", with_chunk(b"PLTE", &[0; 3])),
            ("significant bits", with_chunk(b"sBIT", &[1])),
            ("a second resolution", with_chunk(b"pHYs", &[0; 9])),
            ("interlacing", head(12, 1)),
            ("one bit", head(8, 1)),
            ("colours", pixels(|p| DynamicImage::from(p).to_rgb8().into())),
            ("transparency", pixels(|p| DynamicImage::from(p).to_luma_alpha8().into())),
            ("sixteen bits", pixels(|p| DynamicImage::from(p).to_luma16().into())),
            ("data after the end", append("PK")),
            ("a wrong checksum of the compressed pixels", packed_sum()),
            ("data after the compressed pixels", more_packed()),
            (
                "compressed pixels without their checksum",
                packed(|data| data.truncate(data.len() - 4)),
            ),
            ("truncated compressed pixels", packed(|data| data.truncate(data.len() - 9))),
            ("a wrong checksum of the resolution", sum_of("pHYs", 9)),
            ("a wrong checksum of the title", sum_of("iTXt", 11)),
            ("a wrong checksum of the end", last_byte()),
            ("a different title", swap("Title\0\0\0\0\0b", "Title\0\0\0\0\0c")),
            ("a second title", with_chunk(b"iTXt", b"Title\0\0\0\0\0b")),
            ("no title", {
                Box::new(|bytes| [&bytes[..54], &bytes[find(bytes, b"IDAT") - 4..]].concat())
            }),
            ("an additional text", with_chunk(b"tEXt", b"Comment\0desk")),
            ("a time", with_chunk(b"tIME", &[7, 234, 1, 1, 0, 0, 0])),
            ("data at the end", {
                Box::new(|bytes| [&bytes[..bytes.len() - 12], &chunk(b"IEND", b"a")].concat())
            }),
            ("a larger page", resolution(11_000, 11_000, 1)),
            ("non-square pixels", resolution(11_811, 11_000, 1)),
            ("a resolution without a unit", resolution(11_811, 11_811, 0)),
            ("a spot", square([0.02, 0.02], 12)),
            ("a faint spot", level([0.02, 0.02], 1, 240)),
            ("a faint spot in the board", level([0.5, 0.5], 6, 128)),
            ("grey in place of black", pixels(|p| grey(p, |v| v.max(100)))),
            ("grey paper", pixels(|p| grey(p, |v| v.min(250)))),
            ("noise", pixels(noise)),
            ("a check bar with a second end", on_bar(5.0, 0.3, 2.0, 0)),
            ("a check bar with a gap", on_bar(40.0, 20.0, 0.4, 255)),
            ("a check bar under a stroke", on_bar(40.0, 20.0, 1.0, 0)),
            ("a hole in the board", square([0.5, 0.5], 40)),
            (
                "black and white swapped",
                pixels(|mut p| {
                    image::imageops::invert(&mut p);
                    p.into()
                }),
            ),
            ("a mirrored shape", pixels(|p| image::imageops::flip_horizontal(&p).into())),
        ],
    )
}
