//! The objects of a PDF that every viewer shows the same way: pages of black paths, with nothing hidden, overlaid,
//! executed or attached.

use std::collections::BTreeSet;

use glam::DVec2;
use lopdf::xref::XrefEntry;
use lopdf::{Dictionary, Document, Object, ObjectId, StringFormat, decode_text_string};

use crate::syntax::findings::Findings;
use crate::syntax::pages::pdf_content;
use crate::syntax::words::{Words, is_creator};
use crate::syntax::zlib::unpack;
use deltille_files::export::pdf::{VERSION, color_spaces, graphics_states};
use deltille_files::limits::Limits;
use deltille_layout::Finish;

/// Permitted keys of the trailer, catalogue, information dictionary, page tree and page.
const TRAILER: [&str; 4] = ["Root", "Info", "Size", "ID"];
const CATALOG: [&str; 5] = ["Type", "Pages", "PageLayout", "PageMode", "ViewerPreferences"];
const INFO: [&str; 3] = ["Title", "Subject", "Creator"];
const PAGES: [&str; 3] = ["Type", "Count", "Kids"];
const PAGE: [&str; 8] =
    ["Type", "Parent", "MediaBox", "TrimBox", "CropBox", "Resources", "Contents", "Annots"];
/// Kinds of resources that a page may list without entries.
const RESOURCES: [&str; 4] = ["Font", "XObject", "ExtGState", "Shading"];
/// The bytes before the content of a stream, and the permitted keys of its dictionary.
const STREAM_BEGINS: &[u8] = b">>stream";
const STREAM: [&str; 2] = ["Length", "Filter"];

/// The second line of the file: bytes that are not text, so that programs treat the file as binary.
const BINARY_MARK: &[u8] = b"\n%\xbb\xad\xc0\xde\n";

/// Inspects a PDF for constructs that are not allowed.
///
/// # Errors
///
/// Returns an error if the file is not a readable PDF or exceeds the limits.
pub(in crate::syntax) fn check(
    bytes: &[u8],
    words: &Words,
    limits: &Limits,
) -> Result<Findings, String> {
    if positions(bytes, b"%PDF-").is_empty() {
        return Err("not a readable PDF (no %PDF header)".to_owned());
    }
    let mut found = Findings::default();
    head(bytes, &mut found);
    trailer(bytes, &mut found);
    if !found.0.is_empty() {
        return Ok(found);
    }
    let mut document =
        Document::load_mem(bytes).map_err(|error| format!("not a readable PDF ({error})"))?;
    let classic = !positions(bytes, b"trailer").is_empty();
    found.unless(classic, "the end", "a cross-reference stream");
    table(&document, bytes, &mut found);
    if !found.0.is_empty() {
        return Ok(found);
    }
    let (between, streams) = split_streams(bytes);
    limits.check_nodes(document.objects.len()).map_err(|exceeded| exceeded.to_string())?;
    let (finish, cut_lines) = (&words.finish, 0);
    let mut inspection =
        Inspection { document: &document, between, streams, limits, finish, cut_lines, found };
    inspection.names();
    inspection.catalog();
    inspection.info(words);
    inspection.identifier();
    inspection.pages(&words.cut_lines)?;
    inspection.unused();
    let mut found = inspection.found;
    if !found.refuse() {
        check_rewrite(&mut document, bytes, &mut found);
    }
    Ok(found)
}

/// Checks that the file begins with the version and the binary mark.
fn head(bytes: &[u8], found: &mut Findings) {
    let Some(rest) = bytes.strip_prefix(b"%PDF-") else {
        return found.add("the header", "data before the PDF");
    };
    if let Some(rest) = rest.strip_prefix(VERSION.as_bytes()) {
        let marked = rest.starts_with(BINARY_MARK);
        return found.unless(
            marked,
            "the header",
            "bytes other than a version and the binary mark",
        );
    }
    let version: Vec<u8> = rest.iter().copied().take(3).collect();
    let version = String::from_utf8_lossy(&version).into_owned();
    found.add("the header", format!("version {version} instead of {VERSION}"));
}

/// Checks that every object begins at its offset in the cross-reference table. Otherwise, readers
/// that rebuild the table and readers that follow it would find different objects.
fn table(document: &Document, bytes: &[u8], found: &mut Findings) {
    for (number, entry) in &document.reference_table.entries {
        let &XrefEntry::Normal { offset, generation } = entry else { continue };
        let there = bytes.get(offset as usize..).unwrap_or_default();
        let head = format!("{number} {generation} obj");
        let holds = there.starts_with(head.as_bytes());
        found.unless(holds, "the table", format!("a wrong offset of object {number}"));
    }
}

/// Checks that the parsed objects, written again, reproduce the file byte for byte: the reader
/// neither skipped nor repaired anything.
fn check_rewrite(document: &mut Document, bytes: &[u8], found: &mut Findings) {
    let mut rewritten = Vec::with_capacity(bytes.len());
    let written = document.save_to(&mut rewritten).is_ok();
    if written && rewritten == bytes {
        return;
    }
    let at = rewritten.iter().zip(bytes).position(|(a, b)| a != b);
    let at = at.unwrap_or(rewritten.len().min(bytes.len()));
    found.add(format!("byte {at}"), "a spelling, order or table that is not as deltille writes it");
}

/// Checks that there is a single revision, which ends with the file, and that the trailer has permitted keys only. An
/// earlier revision, encryption and a second table each need another key.
fn trailer(bytes: &[u8], found: &mut Findings) {
    let Some(&at) = positions(bytes, b"trailer").last() else { return };
    let text = String::from_utf8_lossy(&bytes[at..]);
    let (dictionary, end) = text.split_once("startxref").unwrap_or((&text, ""));
    for key in dictionary.split('/').skip(1) {
        let key = key.split(|c: char| !c.is_ascii_alphanumeric()).next().unwrap_or_default();
        found.unless(TRAILER.contains(&key), "the trailer", format!("key {key}"));
    }
    let rest = end.split_once("%%EOF").map(|(_, rest)| rest.trim());
    found.unless(rest.is_none_or(str::is_empty), "the end", "data after the PDF");
    let tables = positions(bytes, b"startxref").len();
    found.unless(tables < 2, "the end", "a second revision");
}

/// Returns the offsets of a word in a file.
fn positions(bytes: &[u8], word: &[u8]) -> Vec<usize> {
    let windows = bytes.windows(word.len()).enumerate();
    windows.filter(|(_, window)| *window == word).map(|(at, _)| at).collect()
}

/// Returns the number of slashes, which begin names, in the written form of an object.
fn slashes(object: &Object) -> usize {
    let of_dictionary = |dictionary: &Dictionary| -> usize {
        dictionary.iter().map(|(_, value)| 1 + slashes(value)).sum()
    };
    match object {
        Object::Name(_) => 1,
        Object::String(text, StringFormat::Literal) => {
            text.iter().filter(|&&byte| byte == b'/').count()
        }
        Object::Array(list) => list.iter().map(slashes).sum(),
        Object::Dictionary(dictionary) => of_dictionary(dictionary),
        Object::Stream(stream) => of_dictionary(&stream.dict),
        _ => 0,
    }
}

/// Splits a file into the parts between its streams and the contents of the streams, without the line ends around
/// them.
fn split_streams(bytes: &[u8]) -> (Vec<&[u8]>, Vec<&[u8]>) {
    let (begins, ends) = (positions(bytes, STREAM_BEGINS), positions(bytes, b"endstream"));
    let (mut between, mut streams) = (Vec::new(), Vec::new());
    let mut from = 0;
    for begin in begins.into_iter().map(|at| at + STREAM_BEGINS.len()) {
        let Some(&end) = ends.iter().find(|&&end| end >= begin && begin >= from) else { continue };
        between.push(&bytes[from..begin]);
        streams.push(bytes[begin..end].trim_ascii());
        from = end;
    }
    between.push(&bytes[from..]);
    (between, streams)
}

/// Adds all objects that an object refers to.
fn references(document: &Document, object: &Object, used: &mut BTreeSet<ObjectId>) {
    let mut open = vec![object];
    while let Some(object) = open.pop() {
        match object {
            Object::Reference(id) if used.insert(*id) => open.extend(document.objects.get(id)),
            Object::Array(list) => open.extend(list),
            Object::Dictionary(dictionary) => {
                open.extend(dictionary.iter().map(|(_, value)| value))
            }
            Object::Stream(stream) => open.extend(stream.dict.iter().map(|(_, value)| value)),
            _ => {}
        }
    }
}

/// The inspection of a parsed document.
struct Inspection<'a> {
    document: &'a Document,
    /// The parts of the file between its streams.
    between: Vec<&'a [u8]>,
    /// The contents of the streams in the file.
    streams: Vec<&'a [u8]>,
    limits: &'a Limits,
    /// How the pages should be printed.
    finish: &'a Finish,
    /// Number of cut lines on the inspected page.
    cut_lines: usize,
    found: Findings,
}

impl<'a> Inspection<'a> {
    /// Returns the object itself, or the object that it refers to.
    fn resolve(&self, object: &'a Object) -> Option<&'a Object> {
        self.document.dereference(object).ok().map(|(_, object)| object)
    }

    /// Checks that the parser found as many names as the file contains. Of a repeated key or object, some readers
    /// take the first, others the last.
    fn names(&mut self) {
        let objects = self.document.objects.values().map(slashes);
        let trailer: usize =
            self.document.trailer.iter().map(|(_, value)| 1 + slashes(value)).sum();
        let read = objects.sum::<usize>() + trailer;
        let slashes = |part: &&[u8]| part.iter().filter(|&&byte| byte == b'/').count();
        let written: usize = self.between.iter().map(slashes).sum();
        self.found.unless(read == written, "the file", "a duplicate key or object");
    }

    /// Returns a value of a dictionary, with references resolved.
    fn value(&self, dictionary: &'a Dictionary, key: &str) -> Option<&'a Object> {
        self.resolve(dictionary.get(key.as_bytes()).ok()?)
    }

    /// Returns a value of a dictionary that is a name.
    fn name(&self, dictionary: &'a Dictionary, key: &str) -> Option<&'a [u8]> {
        self.value(dictionary, key)?.as_name().ok()
    }

    /// Checks that a dictionary has permitted keys only.
    fn keys(&mut self, dictionary: &Dictionary, place: &str, listed: &[&str]) {
        for (key, _) in dictionary {
            let key = String::from_utf8_lossy(key).into_owned();
            let known = listed.contains(&key.as_str());
            self.found.unless(known, place, format!("key {key}"));
        }
    }

    /// Checks that the catalogue opens single pages and that printing does not scale them.
    fn catalog(&mut self) {
        let place = "the catalogue";
        let document = self.document;
        let Ok(catalog) = document.catalog() else {
            self.found.add(place, "no dictionary");
            return;
        };
        self.keys(catalog, place, &CATALOG);
        for (key, stated) in
            [("Type", "Catalog"), ("PageMode", "UseNone"), ("PageLayout", "SinglePage")]
        {
            let holds = self.name(catalog, key) == Some(stated.as_bytes());
            self.found.unless(holds, place, format!("a {key} other than {stated}"));
        }
        let preferences = self.value(catalog, "ViewerPreferences");
        let Some(preferences) = preferences.and_then(|object| object.as_dict().ok()) else {
            return self.found.add(place, "no viewer preferences (prints may be scaled)");
        };
        self.keys(preferences, "the viewer preferences", &["PrintScaling"]);
        let unscaled = self.name(preferences, "PrintScaling") == Some(b"None");
        self.found.unless(unscaled, "the viewer preferences", "print scaling other than None");
    }

    /// Checks that title, subject and creator are those of the target, because viewers show them.
    fn info(&mut self, words: &Words) {
        let document = self.document;
        let place = "the information";
        let info = document.trailer.get(b"Info").ok().and_then(|object| self.resolve(object));
        let Some(info) = info.and_then(|object| object.as_dict().ok()) else {
            self.found.add(place, "no dictionary");
            return;
        };
        self.keys(info, place, &INFO);
        let text = |key: &str| decode_text_string(self.value(info, key)?).ok();
        let [title, subject, creator] = INFO.map(text);
        let title = title.as_deref() == Some(&*words.title);
        self.found.unseen_unless(title, place, "a Title other than the target's name");
        let subject = subject.as_ref() == Some(&words.subject);
        self.found.unseen_unless(subject, place, "a Subject that does not describe the target");
        let creator = creator.is_some_and(|creator| is_creator(&creator));
        self.found.unseen_unless(creator, place, "a Creator other than deltille");
    }

    /// Checks that both identifiers are equal. In a file that was changed after it was written, the second differs.
    fn identifier(&mut self) {
        let id = self.document.trailer.get(b"ID").and_then(Object::as_array).ok();
        let same = id.is_some_and(|id| {
            id.len() == 2 && id[0] == id[1] && id[0].as_str().is_ok_and(|text| text.len() == 16)
        });
        self.found.unless(same, "the trailer", "an ID that is not the same digest twice");
    }

    /// Checks that the trailer refers, directly or indirectly, to every object.
    fn unused(&mut self) {
        let document = self.document;
        let mut used = BTreeSet::new();
        document.trailer.iter().for_each(|(_, value)| references(document, value, &mut used));
        let unused = document.objects.keys().find(|id| !used.contains(id));
        if let Some((number, generation)) = unused {
            self.found.add(format!("object {number} {generation}"), "an unused object");
        }
    }

    /// Checks the page tree, which is a flat list, and every page. Returns an error if a page exceeds the limits.
    fn pages(&mut self, cut_lines: &[usize]) -> Result<(), String> {
        let document = self.document;
        let place = "the page tree";
        let root = document.catalog().ok().and_then(|catalog| catalog.get(b"Pages").ok());
        let Some((root, id)) = root.and_then(|object| {
            Some((self.resolve(object)?.as_dict().ok()?, object.as_reference().ok()?))
        }) else {
            self.found.add(place, "no dictionary");
            return Ok(());
        };
        self.keys(root, place, &PAGES);
        let Some(kids) = self.value(root, "Kids").and_then(|kids| kids.as_array().ok()) else {
            self.found.add(place, "no list of pages");
            return Ok(());
        };
        let count = self.value(root, "Count").and_then(|count| count.as_i64().ok());
        self.found.unless(count == Some(kids.len() as i64), place, "a wrong page count");
        let mut seen = BTreeSet::new();
        for (index, kid) in kids.iter().enumerate() {
            let place = format!("page {}", index + 1);
            self.cut_lines = cut_lines.get(index).copied().unwrap_or_default();
            let new = kid.as_reference().is_ok_and(|kid| seen.insert(kid));
            self.found.unless(new, &place, "a page that is listed twice or nested");
            match self.resolve(kid).and_then(|page| page.as_dict().ok()) {
                Some(page) => self.page(page, id, &place)?,
                None => self.found.add(&place, "no dictionary"),
            }
        }
        Ok(())
    }

    /// Checks a page: its boxes, the absence of annotations and resources, and its content.
    fn page(&mut self, page: &'a Dictionary, parent: ObjectId, place: &str) -> Result<(), String> {
        if self.name(page, "Type") != Some(b"Page") {
            self.found.add(place, "an object that is not a page");
            return Ok(());
        }
        self.keys(page, place, &PAGE);
        let own = page.get(b"Parent").and_then(Object::as_reference).is_ok_and(|id| id == parent);
        self.found.unless(own, place, "a parent other than the page tree");
        let size_pt = self.boxes(page, place);
        let annotations = page.has(b"Annots").then(|| self.value(page, "Annots")).flatten();
        let none = annotations.is_none_or(|list| list.as_array().is_ok_and(Vec::is_empty));
        self.found.unless(none, place, "annotations");
        self.resources(page, place);
        self.content(page, size_pt, place)
    }

    /// Checks that all boxes equal the page and start at the origin. Returns width and height in points.
    fn boxes(&mut self, page: &'a Dictionary, place: &str) -> DVec2 {
        let ends = |key: &str| -> Option<Vec<f32>> {
            let list = self.value(page, key)?.as_array().ok()?;
            list.iter().map(|end| self.resolve(end)?.as_float().ok()).collect()
        };
        let [media, trim, crop] = ["MediaBox", "TrimBox", "CropBox"].map(ends);
        let from_origin = media.as_ref().is_some_and(|m| m.len() == 4 && m[..2] == [0.0, 0.0]);
        self.found.unless(from_origin, place, "a MediaBox that does not begin at the origin");
        self.found.unless(crop == media, place, "a CropBox other than the page");
        self.found.unless(trim == media, place, "a TrimBox other than the page");
        match media.as_deref() {
            Some(&[_, _, width, height]) => DVec2::new(width.into(), height.into()),
            _ => DVec2::ZERO,
        }
    }

    /// Checks that a page has no resources except the stated spot colours.
    fn resources(&mut self, page: &'a Dictionary, place: &str) {
        let resources = self.value(page, "Resources").and_then(|object| object.as_dict().ok());
        let (spaces, states) = (color_spaces(self.finish), graphics_states(self.finish));
        let resources = resources.map(|resources| resources.iter().collect()).unwrap_or_default();
        let resources: Vec<(&Vec<u8>, &Object)> = resources;
        for stated in [("ColorSpace", &spaces), ("ExtGState", &states)] {
            let is_there = resources.iter().any(|(key, _)| *key == stated.0.as_bytes());
            let complete = is_there || stated.1.is_empty();
            self.found.unless(complete, place, format!("no {} for its spot colours", stated.0));
        }
        for (key, object) in resources {
            let key = String::from_utf8_lossy(key);
            let object = self.resolve(object).and_then(|object| object.as_dict().ok());
            let is_stated = object.is_some_and(|object| match &*key {
                "ColorSpace" => *object == spaces && !spaces.is_empty(),
                "ExtGState" => *object == states,
                key => RESOURCES.contains(&key) && object.is_empty(),
            });
            self.found.unless(is_stated, place, format!("resources of {key}"));
        }
    }

    /// Checks the content of a page: one stream, compressed as stated, with permitted operators.
    fn content(&mut self, page: &'a Dictionary, size_pt: DVec2, place: &str) -> Result<(), String> {
        let stream = self.value(page, "Contents").and_then(|object| object.as_stream().ok());
        let Some(stream) = stream else {
            self.found.add(place, "content other than one stream");
            return Ok(());
        };
        self.keys(&stream.dict, &format!("{place}, its content"), &STREAM);
        // A reader that repairs a wrong length takes everything up to the end.
        let whole = self.streams.contains(&stream.content.trim_ascii());
        self.found.unless(whole, place, "content with a wrong stated length");
        if self.name(&stream.dict, "Filter") != Some(b"FlateDecode") {
            self.found.add(place, "content with a filter other than FlateDecode");
            return Ok(());
        }
        let mut content = Vec::new();
        // Some readers show as much as they can decompress, others nothing.
        let most = self.limits.max_bytes;
        match unpack(&stream.content, most, |block| content.extend_from_slice(block)) {
            Some(_) => {
                let (finish, cut_lines) = (self.finish, self.cut_lines);
                let page = pdf_content::Content { size_pt, finish, cut_lines, page: place };
                pdf_content::check(&content, &page, self.limits, &mut self.found)
                    .map_err(|exceeded| format!("{place}: {exceeded}"))
            }
            None => {
                let construct = "content that is truncated, continues past its end, is too long, or \
                                 has a wrong checksum";
                self.found.add(place, construct);
                Ok(())
            }
        }
    }
}
