//! The objects of a PDF that every viewer shows alike: pages of black paths, and nothing that is
//! hidden, laid over them, run or attached.

use std::collections::BTreeSet;

use lopdf::{Dictionary, Document, Object, ObjectId, StringFormat};

use super::{Findings, pdf_content};

/// The keys of a trailer.
const TRAILER: [&str; 4] = ["Root", "Info", "Size", "ID"];
const CATALOG: [&str; 5] = ["Type", "Pages", "PageLayout", "PageMode", "ViewerPreferences"];
const INFO: [&str; 3] = ["Title", "Subject", "Creator"];
const PAGES: [&str; 3] = ["Type", "Count", "Kids"];
const PAGE: [&str; 8] =
    ["Type", "Parent", "MediaBox", "TrimBox", "CropBox", "Resources", "Contents", "Annots"];
/// Kinds of resources that may be listed, as long as there are none.
const RESOURCES: [&str; 4] = ["Font", "XObject", "ExtGState", "Shading"];
/// Where the content of a stream begins.
const STREAM_BEGINS: &[u8] = b">>stream";
const STREAM: [&str; 2] = ["Length", "Filter"];

/// Most bytes of a page, unpacked: a hundred times the largest that is written.
const MOST_CONTENT: usize = 1 << 29;

/// Goes through a PDF.
pub(super) fn check(bytes: &[u8]) -> Result<Findings, String> {
    if positions(bytes, b"%PDF-").is_empty() {
        return Err("not a readable PDF (its head)".to_owned());
    }
    let mut found = Findings::default();
    trailer(bytes, &mut found);
    if !found.0.is_empty() {
        return Ok(found);
    }
    let document =
        Document::load_mem(bytes).map_err(|error| format!("not a readable PDF ({error})"))?;
    let classic = !positions(bytes, b"trailer").is_empty();
    found.unless(classic, "the end", "a cross-reference stream");
    let (between, streams) = split_streams(bytes);
    let mut walk = Walk { document: &document, between, streams, found };
    walk.names();
    walk.catalog();
    walk.info();
    walk.pages();
    Ok(walk.found)
}

/// One revision that begins with the first byte and ends with the last, its trailer with no key but
/// those listed: an earlier revision, encryption and a second table would have one.
fn trailer(bytes: &[u8], found: &mut Findings) {
    found.unless(bytes.starts_with(b"%PDF-1."), "the head", "data before the PDF");
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

/// Where a word stands in a file.
fn positions(bytes: &[u8], word: &[u8]) -> Vec<usize> {
    let windows = bytes.windows(word.len()).enumerate();
    windows.filter(|(_, window)| *window == word).map(|(at, _)| at).collect()
}

/// How many slashes, which begin names, an object is written with.
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

/// What stands between the streams of a file, and what is in them, without the ends of lines
/// around it.
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

/// The way through a document.
struct Walk<'a> {
    document: &'a Document,
    /// What stands between streams in the file.
    between: Vec<&'a [u8]>,
    /// What is in streams in the file.
    streams: Vec<&'a [u8]>,
    found: Findings,
}

impl<'a> Walk<'a> {
    /// What an object is, references followed.
    fn resolve(&self, object: &'a Object) -> Option<&'a Object> {
        self.document.dereference(object).ok().map(|(_, object)| object)
    }

    /// As many names are read as stand in the file: of a key or an object that is there twice one
    /// reader takes the first, another the last.
    fn names(&mut self) {
        let objects = self.document.objects.values().map(slashes);
        let trailer: usize =
            self.document.trailer.iter().map(|(_, value)| 1 + slashes(value)).sum();
        let read = objects.sum::<usize>() + trailer;
        let slashes = |part: &&[u8]| part.iter().filter(|&&byte| byte == b'/').count();
        let written: usize = self.between.iter().map(slashes).sum();
        self.found.unless(read == written, "the file", "a key or an object that is there twice");
    }

    /// A value of a dictionary, references followed.
    fn value(&self, dictionary: &'a Dictionary, key: &str) -> Option<&'a Object> {
        self.resolve(dictionary.get(key.as_bytes()).ok()?)
    }

    fn name(&self, dictionary: &'a Dictionary, key: &str) -> Option<&'a [u8]> {
        self.value(dictionary, key)?.as_name().ok()
    }

    /// Names the keys of a dictionary that are not listed.
    fn keys(&mut self, dictionary: &Dictionary, place: &str, listed: &[&str]) {
        for (key, _) in dictionary {
            let key = String::from_utf8_lossy(key).into_owned();
            let known = listed.contains(&key.as_str());
            self.found.unless(known, place, format!("key {key}"));
        }
    }

    fn catalog(&mut self) {
        let place = "the catalogue";
        let document = self.document;
        let Ok(catalog) = document.catalog() else {
            return self.found.add(place, "no dictionary");
        };
        self.keys(catalog, place, &CATALOG);
        if catalog.has(b"PageMode") {
            let plain = self.name(catalog, "PageMode") == Some(b"UseNone");
            self.found.unless(plain, place, "a page mode other than UseNone");
        }
        let preferences = self.value(catalog, "ViewerPreferences");
        let Some(preferences) = preferences.and_then(|object| object.as_dict().ok()) else {
            return self.found.add(place, "no viewer preferences, so that prints may be scaled");
        };
        self.keys(preferences, "the viewer preferences", &["PrintScaling"]);
        let unscaled = self.name(preferences, "PrintScaling") == Some(b"None");
        self.found.unless(unscaled, "the viewer preferences", "print scaling other than None");
    }

    fn info(&mut self) {
        let document = self.document;
        let info = document.trailer.get(b"Info").ok().and_then(|object| self.resolve(object));
        if let Some(info) = info.and_then(|object| object.as_dict().ok()) {
            self.keys(info, "the information", &INFO);
        }
    }

    fn pages(&mut self) {
        let document = self.document;
        let place = "the page tree";
        let root = document.catalog().ok().and_then(|catalog| catalog.get(b"Pages").ok());
        let Some((root, id)) = root.and_then(|object| {
            Some((self.resolve(object)?.as_dict().ok()?, object.as_reference().ok()?))
        }) else {
            return self.found.add(place, "no dictionary");
        };
        self.keys(root, place, &PAGES);
        let Some(kids) = self.value(root, "Kids").and_then(|kids| kids.as_array().ok()) else {
            return self.found.add(place, "no list of pages");
        };
        let count = self.value(root, "Count").and_then(|count| count.as_i64().ok());
        self.found.unless(
            count == Some(kids.len() as i64),
            place,
            "a count that is not that of the pages",
        );
        let mut seen = BTreeSet::new();
        for (index, kid) in kids.iter().enumerate() {
            let place = format!("page {}", index + 1);
            let new = kid.as_reference().is_ok_and(|kid| seen.insert(kid));
            self.found.unless(new, &place, "a page that is listed twice, or within the list");
            match self.resolve(kid).and_then(|page| page.as_dict().ok()) {
                Some(page) => self.page(page, id, &place),
                None => self.found.add(&place, "no dictionary"),
            }
        }
    }

    fn page(&mut self, page: &'a Dictionary, parent: ObjectId, place: &str) {
        if self.name(page, "Type") != Some(b"Page") {
            return self.found.add(place, "an object that is no page");
        }
        self.keys(page, place, &PAGE);
        let own = page.get(b"Parent").and_then(Object::as_reference).is_ok_and(|id| id == parent);
        self.found.unless(own, place, "another parent than the page tree");
        self.boxes(page, place);
        let annotations = page.has(b"Annots").then(|| self.value(page, "Annots")).flatten();
        let none = annotations.is_none_or(|list| list.as_array().is_ok_and(Vec::is_empty));
        self.found.unless(none, place, "annotations");
        self.resources(page, place);
        self.content(page, place);
    }

    /// All boxes are the page, from its origin.
    fn boxes(&mut self, page: &'a Dictionary, place: &str) {
        let ends = |key: &str| -> Option<Vec<f32>> {
            let list = self.value(page, key)?.as_array().ok()?;
            list.iter().map(|end| self.resolve(end)?.as_float().ok()).collect()
        };
        let [media, trim, crop] = ["MediaBox", "TrimBox", "CropBox"].map(ends);
        let from_origin = media.as_ref().is_some_and(|m| m.len() == 4 && m[..2] == [0.0, 0.0]);
        self.found.unless(from_origin, place, "a MediaBox that does not begin at the origin");
        self.found.unless(crop == media, place, "a CropBox other than the page");
        self.found.unless(trim == media, place, "a TrimBox other than the page");
    }

    /// Nothing of a page needs a resource.
    fn resources(&mut self, page: &'a Dictionary, place: &str) {
        let resources = self.value(page, "Resources").and_then(|object| object.as_dict().ok());
        let Some(resources) = resources else { return };
        for (key, object) in resources {
            let key = String::from_utf8_lossy(key);
            let object = self.resolve(object).and_then(|object| object.as_dict().ok());
            let none = RESOURCES.contains(&&*key) && object.is_some_and(Dictionary::is_empty);
            self.found.unless(none, place, format!("resources of {key}"));
        }
    }

    fn content(&mut self, page: &'a Dictionary, place: &str) {
        let stream = self.value(page, "Contents").and_then(|object| object.as_stream().ok());
        let Some(stream) = stream else {
            return self.found.add(place, "content other than one stream");
        };
        self.keys(&stream.dict, &format!("{place}, its content"), &STREAM);
        // A reader that mends a wrong length takes what stands up to the end.
        let whole = self.streams.contains(&stream.content.trim_ascii());
        self.found.unless(whole, place, "content of another length than stated");
        let content = match stream.dict.has(b"Filter") {
            false => Some(stream.content.clone()),
            true if self.name(&stream.dict, "Filter") == Some(b"FlateDecode") => {
                stream.decompressed_content_with_limit(MOST_CONTENT).ok()
            }
            true => None,
        };
        match content {
            Some(content) => pdf_content::check(&content, place, &mut self.found),
            None => self.found.add(place, "content that is not of FlateDecode"),
        }
    }
}
