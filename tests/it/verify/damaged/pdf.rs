//! Damaged PDF.

use lopdf::{Dictionary, Document, Object, ObjectId, Stream, dictionary};

use super::edit::{append, before, find, swap};
use super::{Case, Damage, cases};

/// Edits the objects of a document.
fn document(edit: impl Fn(&mut Document) + 'static) -> Damage {
    Box::new(move |bytes| {
        let mut document = Document::load_mem(bytes).unwrap();
        edit(&mut document);
        let mut damaged = Vec::new();
        document.save_to(&mut damaged).unwrap();
        damaged
    })
}

fn page_id(document: &Document) -> ObjectId {
    document.get_pages()[&1]
}

/// Sets a key of the catalogue.
fn catalog(key: &'static str, value: impl Fn(&mut Document) -> Object + 'static) -> Damage {
    document(move |document| {
        let value = value(document);
        document.catalog_mut().unwrap().set(key, value);
    })
}

/// Sets a key of the page.
fn page(key: &'static str, value: impl Fn(&mut Document) -> Object + 'static) -> Damage {
    document(move |document| {
        let (id, value) = (page_id(document), value(document));
        document.get_object_mut(id).and_then(Object::as_dict_mut).unwrap().set(key, value);
    })
}

/// Adds a resource to the page.
fn resource(kind: &'static str) -> Damage {
    page("Resources", move |_| {
        Object::Dictionary(dictionary! { kind => dictionary! { "R" => Object::Null } })
    })
}

/// Inserts operators at the beginning of the page.
fn operators(text: &'static str) -> Damage {
    content(move |content| format!("{text}\n{content}"))
}

fn content(edit: impl Fn(&str) -> String + 'static) -> Damage {
    document(move |document| {
        let id = page_id(document);
        let content = document.get_page_content(id);
        let text = edit(std::str::from_utf8(&content).unwrap());
        document.change_page_content(id, text.into_bytes()).unwrap();
    })
}

/// Sets a text of the information dictionary.
fn info(key: &'static str, words: &'static str) -> Damage {
    document(move |document| {
        let id = document.trailer.get(b"Info").and_then(Object::as_reference).unwrap();
        let info = document.get_object_mut(id).and_then(Object::as_dict_mut).unwrap();
        info.set(key, Object::string_literal(words));
    })
}

/// Edits the compressed content of the page.
fn packed(edit: impl Fn(&mut Vec<u8>) + 'static) -> Damage {
    document(move |document| {
        let id = document.get_page_contents(page_id(document))[0];
        let stream = document.get_object_mut(id).and_then(Object::as_stream_mut).unwrap();
        let mut packed = stream.content.clone();
        edit(&mut packed);
        stream.set_content(packed);
    })
}

fn name(name: &str) -> Object {
    Object::Name(name.as_bytes().to_vec())
}

fn boxed(ends: [i64; 4]) -> Object {
    Object::Array(ends.map(Object::Integer).to_vec())
}

/// Returns the cases for a board.
pub fn board() -> Vec<Case> {
    let some = |_: &mut Document| Object::Dictionary(Dictionary::new());
    let script = |_: &mut Document| {
        Object::Dictionary(
            dictionary! { "S" => "JavaScript", "JS" => Object::string_literal("app.beep()") },
        )
    };
    cases(
        "b.pdf",
        vec![
            ("a script when it is opened", catalog("OpenAction", script)),
            ("actions", catalog("AA", some)),
            (
                "embedded files",
                catalog("Names", |_| {
                    Object::Dictionary(
                        dictionary! { "EmbeddedFiles" => dictionary! { "Names" => Vec::<Object>::new() } },
                    )
                }),
            ),
            ("layers", catalog("OCProperties", some)),
            ("a form", catalog("AcroForm", some)),
            ("metadata", catalog("Metadata", some)),
            ("an outline", catalog("Outlines", some)),
            ("a different version", catalog("Version", |_| name("2.0"))),
            ("output intents", catalog("OutputIntents", |_| Vec::<Object>::new().into())),
            ("full screen", catalog("PageMode", |_| name("FullScreen"))),
            (
                "scaled prints",
                catalog("ViewerPreferences", |_| {
                    Object::Dictionary(dictionary! { "PrintScaling" => "AppDefault" })
                }),
            ),
            (
                "several copies",
                catalog("ViewerPreferences", |_| {
                    Object::Dictionary(dictionary! { "PrintScaling" => "None", "NumCopies" => 2 })
                }),
            ),
            ("no statement on scaling", catalog("ViewerPreferences", |_| Object::Null)),
            (
                "an annotation",
                page("Annots", |document| {
                    let note = dictionary! { "Type" => "Annot", "Subtype" => "Square", "Rect" => boxed([0, 0, 99, 99]) };
                    Object::Array(vec![document.add_object(note).into()])
                }),
            ),
            ("a rotated page", page("Rotate", |_| 180.into())),
            ("a larger unit", page("UserUnit", |_| 2.into())),
            ("transparency", page("Group", some)),
            ("page actions", page("AA", some)),
            ("a thumbnail", page("Thumb", some)),
            ("a transition", page("Trans", some)),
            ("a cropped page", page("CropBox", |_| boxed([0, 0, 400, 400]))),
            ("a trimmed page", page("TrimBox", |_| boxed([0, 0, 400, 400]))),
            ("a bleed", page("BleedBox", |_| boxed([0, 0, 400, 400]))),
            ("a shifted page", page("MediaBox", |_| boxed([-10, 0, 842, 595]))),
            ("a graphics state", resource("ExtGState")),
            ("a font", resource("Font")),
            ("an image", resource("XObject")),
            ("a pattern", resource("Pattern")),
            ("layer properties", resource("Properties")),
            (
                "content in two streams",
                page("Contents", |document| {
                    let id = document.get_page_contents(page_id(document))[0];
                    Object::Array(vec![id.into(), id.into()])
                }),
            ),
            (
                "a different filter",
                page("Contents", |document| {
                    let stream = Stream::new(dictionary! { "Filter" => "LZWDecode" }, Vec::new());
                    document.add_object(stream).into()
                }),
            ),
            (
                "content in an external file",
                page("Contents", |document| {
                    let stream = Stream::new(
                        dictionary! { "F" => Object::string_literal("a.txt") },
                        Vec::new(),
                    );
                    document.add_object(stream).into()
                }),
            ),
            (
                "a page listed twice",
                document(|document| {
                    let page = Object::Reference(page_id(document));
                    let pages =
                        document.catalog().unwrap().get(b"Pages").unwrap().as_reference().unwrap();
                    let pages =
                        document.get_object_mut(pages).and_then(Object::as_dict_mut).unwrap();
                    pages.set("Kids", vec![page.clone(), page]);
                    pages.set("Count", 2);
                }),
            ),
            (
                "a recursive page tree",
                document(|document| {
                    let pages =
                        document.catalog().unwrap().get(b"Pages").unwrap().as_reference().unwrap();
                    let list =
                        document.get_object_mut(pages).and_then(Object::as_dict_mut).unwrap();
                    list.set("Kids", vec![Object::Reference(pages)]);
                }),
            ),
            ("a named graphics state", operators("/G gs")),
            ("a layer", operators("/OC /L BDC")),
            ("an image on the page", operators("/I Do")),
            ("an inline image", operators("BI ID EI")),
            ("text", operators("BT ET")),
            ("a clip", operators("0 0 m 9 0 l 9 9 l h W n")),
            ("a different scale", operators("1.01 0 0 1.01 0 0 cm")),
            ("dashes", operators("[3] 0 d")),
            ("a shading", operators("/S sh")),
            ("a rectangle", operators("0 0 9 9 re f*")),
            ("nonzero filling", content(|text| text.replacen("f*", "f ", 1))),
            ("white marks", operators("0 0 0 0 k")),
            ("coloured marks", operators("1 0 0 rg")),
            ("grey marks", operators("0.5 g")),
            ("lines of zero width", operators("0 w")),
            ("a comment", operators("% 1 0 0 rg")),
            ("missing operands", operators("0 m 9 9 l S")),
            ("a line without a starting point", operators("9 9 l S")),
            ("a colour within a path", operators("0 0 m 0 0 0 1 k 9 9 l S")),
            ("a page that ends early", content(|text| format!("{text} 0 0 m"))),
            ("marks in the default colour", {
                content(|text| text.replacen("0 0 0 1 k\n", "", 1))
            }),
            ("a line in the default colour", {
                content(|text| format!("1 w 9 9 m 99 9 l S\n{text}"))
            }),
            ("a line of the default width", operators("0 0 0 1 K 9 9 m 99 9 l S")),
            ("a duplicate tile", {
                content(|text| {
                    let end = text.find("f*").unwrap() + 2;
                    let begin = text[..end].rfind("K\n").unwrap() + 2;
                    format!("{}\n{}", &text[..end], &text[begin..])
                })
            }),
            ("a hairline", operators("0 0 0 1 k 9 9 m 99 9 l h f*")),
            ("a thin line", operators("0 0 0 1 K 0.01 w 9 9 m 99 9 l S")),
            (
                "a thin area beside a thick one",
                operators("0 0 0 1 k 9 9 m 19 9 l 9 19 l h 9 9 m 99 9.01 l 9 9.02 l h f*"),
            ),
            ("a faint line", operators("0 0 0 1 K 0.05 w 9 9 m 99 9 l S")),
            ("a speck of dust", operators("0 0 0 1 k 9 9 m 9.1 9 l 9.1 9.1 l 9 9.1 l h f*")),
            ("marks off the page", operators("0 0 0 1 k 900 9 m 910 9 l 910 19 l h f*")),
            ("a line over the edge", operators("0 0 0 1 K 20 w 9 9 m 99 9 l S")),
            ("an unused object", {
                document(|document| {
                    document.add_object(Object::string_literal("hidden"));
                })
            }),
            ("an unused attached file", {
                document(|document| {
                    let file = dictionary! { "Type" => "EmbeddedFile" };
                    document.add_object(Stream::new(file, b"<html></html>".to_vec()));
                })
            }),
            ("a different title", info("Title", "desk")),
            ("a different description", info("Subject", "a checkerboard")),
            ("a different creator", info("Creator", "a program")),
            (
                "an identifier of a changed file",
                document(|document| {
                    let id =
                        document.trailer.get_mut(b"ID").and_then(Object::as_array_mut).unwrap();
                    id[1] = Object::string_literal("changed");
                }),
            ),
            ("keywords", info("Keywords", "desk")),
            (
                "no information dictionary",
                document(|document| {
                    document.trailer.remove(b"Info");
                }),
            ),
            ("pages side by side", catalog("PageLayout", |_| name("TwoPageLeft"))),
            ("a language", catalog("Lang", |_| Object::string_literal("en"))),
            ("a page with a user unit", page("UserUnit", |_| 1.into())),
            ("a newer version", swap("%PDF-1.6", "%PDF-2.0")),
            ("an older version", swap("%PDF-1.6", "%PDF-1.0")),
            ("uncompressed content", document(|document| document.decompress())),
            ("content without its checksum", packed(|data| data.truncate(data.len() - 4))),
            ("content with a wrong checksum", packed(|data| *data.last_mut().unwrap() ^= 1)),
            ("truncated content", packed(|data| data.truncate(data.len() / 2))),
            ("content with trailing data", packed(|data| data.extend(b"more"))),
            ("a comment at the end", before("startxref", "% desk\n")),
            ("a table that points elsewhere", swap("0000000066", "0000000067")),
            ("a table at a different offset", swap("startxref\n4", "startxref\n5")),
            ("a number on the next line", swap("/Count 1", "/Count\n1")),
            ("a duplicate key", swap("/PageMode/UseNone", "/Pages 5 0 R     ")),
            ("an object after the table", before("startxref", "6 0 obj\n<</Page 0>>\nendobj\n")),
            (
                "content with a wrong length",
                Box::new(|bytes| {
                    let at = find(bytes, b"/Length ") + 8;
                    let digit = if bytes[at] == b'1' { b'2' } else { b'1' };
                    [&bytes[..at], &[digit], &bytes[at + 1..]].concat()
                }),
            ),
            ("encryption", swap("trailer\n<<", "trailer\n<</Encrypt 1 0 R")),
            ("an earlier revision", swap("trailer\n<<", "trailer\n<</Prev 9")),
            ("a later revision", append("\nstartxref\n0\n%%EOF\n")),
            ("data after the end", append("<html></html>")),
            ("data before the head", swap("%PDF", "\n%PDF")),
            (
                "a missing tile",
                content(|text| {
                    let end = text.find("f*").unwrap() + 2;
                    let start = text.find(" K").unwrap() + 2;
                    [&text[..start], &text[end..]].concat()
                }),
            ),
            (
                "a missing page",
                document(|document| {
                    document.delete_pages(&[1]);
                    document.prune_objects();
                }),
            ),
        ],
    )
}
