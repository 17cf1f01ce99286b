//! Damaged PDF.

use lopdf::{Dictionary, Document, Object, ObjectId, Stream, dictionary};

use super::edit::{append, before, find, swap};
use super::{Case, Damage, cases};

/// Changes the objects of a document.
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

/// Lists a resource of the page.
fn resource(kind: &'static str) -> Damage {
    page("Resources", move |_| {
        Object::Dictionary(dictionary! { kind => dictionary! { "R" => Object::Null } })
    })
}

/// Puts operators at the beginning of the page.
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

/// Sets words of the information.
fn info(key: &'static str, words: &'static str) -> Damage {
    document(move |document| {
        let id = document.trailer.get(b"Info").and_then(Object::as_reference).unwrap();
        let info = document.get_object_mut(id).and_then(Object::as_dict_mut).unwrap();
        info.set(key, Object::string_literal(words));
    })
}

/// Changes the packed content of the page.
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

/// Of a board.
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
            ("a script when it is opened", "key OpenAction", catalog("OpenAction", script)),
            ("actions", "key AA", catalog("AA", some)),
            (
                "embedded files",
                "key Names",
                catalog("Names", |_| {
                    Object::Dictionary(
                        dictionary! { "EmbeddedFiles" => dictionary! { "Names" => Vec::<Object>::new() } },
                    )
                }),
            ),
            ("layers", "key OCProperties", catalog("OCProperties", some)),
            ("a form", "key AcroForm", catalog("AcroForm", some)),
            ("metadata", "key Metadata", catalog("Metadata", some)),
            ("an outline", "key Outlines", catalog("Outlines", some)),
            ("another version", "key Version", catalog("Version", |_| name("2.0"))),
            (
                "output intents",
                "key OutputIntents",
                catalog("OutputIntents", |_| Vec::<Object>::new().into()),
            ),
            ("full screen", "a PageMode other", catalog("PageMode", |_| name("FullScreen"))),
            (
                "scaled prints",
                "print scaling",
                catalog("ViewerPreferences", |_| {
                    Object::Dictionary(dictionary! { "PrintScaling" => "AppDefault" })
                }),
            ),
            (
                "several copies",
                "key NumCopies",
                catalog("ViewerPreferences", |_| {
                    Object::Dictionary(dictionary! { "PrintScaling" => "None", "NumCopies" => 2 })
                }),
            ),
            (
                "no word on scaling",
                "no viewer preferences",
                catalog("ViewerPreferences", |_| Object::Null),
            ),
            (
                "an annotation",
                "annotations",
                page("Annots", |document| {
                    let note = dictionary! { "Type" => "Annot", "Subtype" => "Square", "Rect" => boxed([0, 0, 99, 99]) };
                    Object::Array(vec![document.add_object(note).into()])
                }),
            ),
            ("a page that is turned", "key Rotate", page("Rotate", |_| 180.into())),
            ("a larger unit", "key UserUnit", page("UserUnit", |_| 2.into())),
            ("transparency", "key Group", page("Group", some)),
            ("actions of the page", "key AA", page("AA", some)),
            ("a thumbnail", "key Thumb", page("Thumb", some)),
            ("a transition", "key Trans", page("Trans", some)),
            ("a cropped page", "a CropBox", page("CropBox", |_| boxed([0, 0, 400, 400]))),
            ("a trimmed page", "a TrimBox", page("TrimBox", |_| boxed([0, 0, 400, 400]))),
            ("a bleed", "key BleedBox", page("BleedBox", |_| boxed([0, 0, 400, 400]))),
            (
                "a shifted page",
                "does not begin at the origin",
                page("MediaBox", |_| boxed([-10, 0, 842, 595])),
            ),
            ("a graphics state", "resources of ExtGState", resource("ExtGState")),
            ("a font", "resources of Font", resource("Font")),
            ("a picture", "resources of XObject", resource("XObject")),
            ("a pattern", "resources of Pattern", resource("Pattern")),
            ("properties of layers", "resources of Properties", resource("Properties")),
            (
                "content in two streams",
                "other than one stream",
                page("Contents", |document| {
                    let id = document.get_page_contents(page_id(document))[0];
                    Object::Array(vec![id.into(), id.into()])
                }),
            ),
            (
                "another filter",
                "not of FlateDecode",
                page("Contents", |document| {
                    let stream = Stream::new(dictionary! { "Filter" => "LZWDecode" }, Vec::new());
                    document.add_object(stream).into()
                }),
            ),
            (
                "content from a file",
                "key F",
                page("Contents", |document| {
                    let stream = Stream::new(
                        dictionary! { "F" => Object::string_literal("a.txt") },
                        Vec::new(),
                    );
                    document.add_object(stream).into()
                }),
            ),
            (
                "a page that is listed twice",
                "listed twice",
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
                "pages within themselves",
                "an object that is no page",
                document(|document| {
                    let pages =
                        document.catalog().unwrap().get(b"Pages").unwrap().as_reference().unwrap();
                    let list =
                        document.get_object_mut(pages).and_then(Object::as_dict_mut).unwrap();
                    list.set("Kids", vec![Object::Reference(pages)]);
                }),
            ),
            ("a state by name", "operator /G", operators("/G gs")),
            ("a layer", "operator /OC", operators("/OC /L BDC")),
            ("a picture on the page", "operator /I", operators("/I Do")),
            ("a picture in line", "operator BI", operators("BI ID EI")),
            ("words", "operator BT", operators("BT ET")),
            ("a clip", "operator W", operators("0 0 m 9 0 l 9 9 l h W n")),
            ("another scale", "operator cm", operators("1.01 0 0 1.01 0 0 cm")),
            ("dashes", "operator [3]", operators("[3] 0 d")),
            ("a shading", "operator /S", operators("/S sh")),
            ("a rectangle", "operator re", operators("0 0 9 9 re f*")),
            ("a nonzero filling", "operator f:", content(|text| text.replacen("f*", "f ", 1))),
            ("white marks", "operator k with [0.0, 0.0, 0.0, 0.0]", operators("0 0 0 0 k")),
            ("coloured marks", "operator rg", operators("1 0 0 rg")),
            ("grey marks", "operator g", operators("0.5 g")),
            ("lines of no width", "operator w with [0.0]", operators("0 w")),
            ("a comment", "operator %", operators("% 1 0 0 rg")),
            ("operands that are missing", "operator m with 1 operands", operators("0 m 9 9 l S")),
            ("a line from nowhere", "operator l in this place", operators("9 9 l S")),
            (
                "a colour within a path",
                "operator k in this place",
                operators("0 0 m 0 0 0 1 k 9 9 l S"),
            ),
            (
                "a page that ends early",
                "ends within a path",
                content(|text| format!("{text} 0 0 m")),
            ),
            ("marks of the default colour", "a mark before any operator k", {
                content(|text| text.replacen("0 0 0 1 k\n", "", 1))
            }),
            ("a line of the default colour", "a mark before any operator K", {
                content(|text| format!("1 w 9 9 m 99 9 l S\n{text}"))
            }),
            (
                "a line of the default width",
                "a mark before any operator w",
                operators("0 0 0 1 K 9 9 m 99 9 l S"),
            ),
            ("a tile twice", "a mark that is drawn twice", {
                content(|text| {
                    let end = text.find("f*").unwrap() + 2;
                    let begin = text[..end].rfind("K\n").unwrap() + 2;
                    format!("{}\n{}", &text[..end], &text[begin..])
                })
            }),
            ("a hairline", "a mark so thin", operators("0 0 0 1 k 9 9 m 99 9 l h f*")),
            ("a thin line", "a mark so thin", operators("0 0 0 1 K 0.01 w 9 9 m 99 9 l S")),
            (
                "a thin area beside a thick one",
                "a mark so thin",
                operators("0 0 0 1 k 9 9 m 19 9 l 9 19 l h 9 9 m 99 9.01 l 9 9.02 l h f*"),
            ),
            ("a faint line", "spot of", operators("0 0 0 1 K 0.05 w 9 9 m 99 9 l S")),
            (
                "a dot of dust",
                "spot of",
                operators("0 0 0 1 k 9 9 m 9.1 9 l 9.1 9.1 l 9 9.1 l h f*"),
            ),
            (
                "marks off the page",
                "over the edge of the page",
                operators("0 0 0 1 k 900 9 m 910 9 l 910 19 l h f*"),
            ),
            (
                "a line over the edge",
                "over the edge of the page",
                operators("0 0 0 1 K 20 w 9 9 m 99 9 l S"),
            ),
            ("an object of no use", "an object of no use", {
                document(|document| {
                    document.add_object(Object::string_literal("hidden"));
                })
            }),
            ("an attached file of no use", "an object of no use", {
                document(|document| {
                    let file = dictionary! { "Type" => "EmbeddedFile" };
                    document.add_object(Stream::new(file, b"<html></html>".to_vec()));
                })
            }),
            ("another title", "a Title other", info("Title", "desk")),
            ("another description", "a Subject that", info("Subject", "a checkerboard")),
            ("another creator", "a Creator other", info("Creator", "a program")),
            (
                "an identifier of a change",
                "an ID that",
                document(|document| {
                    let id =
                        document.trailer.get_mut(b"ID").and_then(Object::as_array_mut).unwrap();
                    id[1] = Object::string_literal("changed");
                }),
            ),
            ("key words", "key Keywords", info("Keywords", "desk")),
            (
                "no words",
                "no dictionary",
                document(|document| {
                    document.trailer.remove(b"Info");
                }),
            ),
            (
                "pages side by side",
                "a PageLayout other",
                catalog("PageLayout", |_| name("TwoPageLeft")),
            ),
            ("a language", "key Lang", catalog("Lang", |_| Object::string_literal("en"))),
            ("a page of two units", "key UserUnit", page("UserUnit", |_| 1.into())),
            (
                "pages of another version",
                "version 2.0 instead of 1.6",
                swap("%PDF-1.6", "%PDF-2.0"),
            ),
            ("an older version", "version 1.0 instead of 1.6", swap("%PDF-1.6", "%PDF-1.0")),
            (
                "content that is not packed",
                "not of FlateDecode",
                document(|document| document.decompress()),
            ),
            (
                "content without its check sum",
                "cut off",
                packed(|data| data.truncate(data.len() - 4)),
            ),
            (
                "content of another check sum",
                "check sum is wrong",
                packed(|data| *data.last_mut().unwrap() ^= 1),
            ),
            ("content that ends early", "cut off", packed(|data| data.truncate(data.len() / 2))),
            ("content that goes on", "goes on behind", packed(|data| data.extend(b"more"))),
            ("a comment at the end", "spelling, order", before("startxref", "% desk\n")),
            (
                "a table that points elsewhere",
                "object 2 elsewhere",
                swap("0000000066", "0000000067"),
            ),
            ("a table of another place", "PDF", swap("startxref\n4", "startxref\n5")),
            ("a number on the next line", "spelling, order", swap("/Count 1", "/Count\n1")),
            ("a key twice", "there twice", swap("/PageMode/UseNone", "/Pages 5 0 R     ")),
            (
                "an object after the table",
                "key Page",
                before("startxref", "6 0 obj\n<</Page 0>>\nendobj\n"),
            ),
            (
                "content of another length",
                "content",
                Box::new(|bytes| {
                    let at = find(bytes, b"/Length ") + 8;
                    let digit = if bytes[at] == b'1' { b'2' } else { b'1' };
                    [&bytes[..at], &[digit], &bytes[at + 1..]].concat()
                }),
            ),
            ("encryption", "key Encrypt", swap("trailer\n<<", "trailer\n<</Encrypt 1 0 R")),
            ("an earlier revision", "key Prev", swap("trailer\n<<", "trailer\n<</Prev 9")),
            ("a later revision", "a second revision", append("\nstartxref\n0\n%%EOF\n")),
            ("data after the end", "data after the PDF", append("<html></html>")),
            ("data before the head", "data before the PDF", swap("%PDF", "\n%PDF")),
            (
                "a tile that is missing",
                "tile missing",
                content(|text| {
                    let end = text.find("f*").unwrap() + 2;
                    let start = text.find(" K").unwrap() + 2;
                    [&text[..start], &text[end..]].concat()
                }),
            ),
            (
                "a page that is missing",
                "without pages",
                document(|document| {
                    document.delete_pages(&[1]);
                    document.prune_objects();
                }),
            ),
        ],
    )
}
