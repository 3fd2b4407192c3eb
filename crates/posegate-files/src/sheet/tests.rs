use super::*;

/// Returns the rows of the columns `a` and `b`, numbers of at least 0, or the message.
fn read(settings: &csv::ReaderBuilder, text: &str) -> Result<Vec<[f64; 2]>, String> {
    let read = || -> Result<_, SheetError> {
        let mut sheet = Sheet::with(settings, text.as_bytes(), "s.csv")?;
        let columns = each(["a", "b"], |name| sheet.needed(name, &["a", "b"]))?;
        let mut rows = Vec::new();
        while let Some(line) = sheet.line()? {
            let size = |column| line.number(column, |size| size >= 0.0, "a size");
            rows.push(each(columns, size)?);
        }
        Ok(rows)
    };
    read().map_err(|error| error.to_string())
}

fn usual(text: &str) -> Result<Vec<[f64; 2]>, String> {
    read(&settings(), text)
}

fn message<T: std::fmt::Debug>(read: Result<T, SheetError>) -> String {
    read.unwrap_err().to_string()
}

#[test]
fn columns_are_found_by_name_and_others_are_ignored() {
    let rows = usual("b,note,a,note\n2,x,1,y\n 4 ,,3,\n");
    assert_eq!(rows.unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
    let mut sheet = Sheet::new("c,a,c\n5,6,7\n".as_bytes(), "s.csv").unwrap();
    let first = sheet.first("c").unwrap();
    assert_eq!(sheet.line().unwrap().unwrap().text(first), "5");
}

#[test]
fn faults_have_line_and_column() {
    let missing = "there is no column `b`; expected a header with a, b (this one has \"a, c\")";
    for (text, expected) in [
        (
            "a,b,a\n",
            "1:3: the column `a` appears twice; keep one of them",
        ),
        ("a,c\n1,2\n", &format!("1:1: {missing}")),
        ("a,b\n1,2\n3\n", "3:2: 1 fields; the header has 2"),
        ("a,b\n1,2\n3,4,5\n", "3:3: 3 fields; the header has 2"),
        ("a,b\n1,2\n3, x \n", "3:2: `x` in `b`; expected a size"),
        ("a,b\n1,2\n,4\n", "3:1: `` in `a`; expected a size"),
        ("a,b\n1,nan\n", "2:2: `nan` in `b`; expected a size"),
        ("a,b\n1,-1\n", "2:2: `-1` in `b`; expected a size"),
    ] {
        assert_eq!(usual(text).unwrap_err(), format!("s.csv:{expected}"));
    }
}

/// Lines are counted as an editor counts them: with blank lines, comments, line ends of Windows and fields of several lines.
#[test]
fn lines_are_those_of_an_editor() {
    let mut settings = settings();
    settings.comment(Some(b'#')).quoting(true);
    for (text, place) in [
        ("a,b\n1,2\n\n\n3,x\n", "5:2"),
        ("a,b\n1,2\n\n3,x", "4:2"),
        ("# sizes\n\na,b\n# 5\n1,2\n# 6\n# 7\n3,x\n# 8\n", "8:2"),
        ("# sizes\na,c\n", "2:1"),
        ("a,b,c\n1,2,\"p\nq\nr\"\n3,x,\"p\nq\"\n", "5:2"),
        ("a,b\n1,2\n3", "3:2"),
        ("a,b\n1,2\n \n", "3:2"),
    ] {
        for text in [text.to_owned(), text.replace('\n', "\r\n")] {
            let error = read(&settings, &text).unwrap_err();
            assert!(error.starts_with(&format!("s.csv:{place}:")), "{error}");
        }
    }
    assert_eq!(usual("a,b\r\n\r\n1,2\r\n\r\n").unwrap(), [[1.0, 2.0]]);
    let mut sheet = Sheet::new(&b"a,b\n1,2\n\n3,\xff\n"[..], "s.csv").unwrap();
    sheet.line().unwrap();
    let error = sheet.line().map(|_| ()).unwrap_err().to_string();
    let expected = "s.csv:4:2: bytes that are not UTF-8; save the file as UTF-8";
    assert_eq!(error, expected);
    // The first line of a row of several lines, also if the row has another fault.
    for (text, expected) in [
        (&b"a,b\n1,2\n\"3\n\",\xff\n"[..], "s.csv:3:2: bytes"),
        (b"a,b\n1,2\n3,\"4\n5,6\n", "s.csv:3: a quote"),
        (b"a,b\r\n1,2\r\n3,\"4", "s.csv:3: a quote"),
    ] {
        let mut sheet = Sheet::with(&settings, text, "s.csv").unwrap();
        sheet.line().unwrap();
        let error = sheet.line().map(|_| ()).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
}

/// A file whose lines end with carriage returns alone would be one header.
#[test]
fn carriage_returns_without_line_feeds_are_refused() {
    for (text, line) in [
        ("a,b,note\r1,2,x\r", 1),
        ("a,b\n1,2\n3\r,4\n", 3),
        ("a,b\r\n1,2\r3,4\r\n", 2),
    ] {
        let error = usual(text).unwrap_err();
        let place = format!("s.csv:{line}: a carriage return without a line feed");
        assert!(error.starts_with(&place), "{error}");
    }
    assert_eq!(usual("a,b\r\r\n1,2\r\r\n").unwrap(), [[1.0, 2.0]]);
}

#[test]
fn line_that_cannot_be_read_is_named() {
    let text = format!("a,b\n1,2\n{}", "3".repeat(2 << 20));
    let mut sheet = Sheet::new(crate::input::Lines::new(text.as_bytes()), "s.csv").unwrap();
    sheet.line().unwrap();
    let error = sheet.line().map(|_| ()).unwrap_err().to_string();
    assert!(error.starts_with("s.csv:3: "), "{error}");
}

/// The mark may arrive byte by byte.
#[test]
fn byte_order_mark_is_not_part_of_a_name() {
    let text = "\u{feff} a ,b\n1,2\n";
    assert_eq!(usual(text).unwrap(), [[1.0, 2.0]]);
    let bytes = text.as_bytes();
    let sheet = Sheet::new(bytes[..1].chain(&bytes[1..]), "s.csv").unwrap();
    assert_eq!(sheet.names(), ["a", "b"]);
}

#[test]
fn comments_and_quotes_are_read_only_if_the_settings_allow_them() {
    let text = "# sizes\na,b\n# 5,6\n1,2\n7,x\n";
    assert!(usual(text).unwrap_err().contains("no column `a`"));
    let error = read(settings().comment(Some(b'#')), text).unwrap_err();
    assert_eq!(error, "s.csv:5:2: `x` in `b`; expected a size");
    let text = "a,b,c\n1,2,\"x\n3,4,\"\n";
    assert_eq!(usual(text).unwrap(), [[1.0, 2.0], [3.0, 4.0]]);
    assert_eq!(read(settings().quoting(true), text).unwrap(), [[1.0, 2.0]]);
}

#[test]
fn fields_have_types() {
    let mut sheet = Sheet::new("a,b\n 1 ,\nnan,x\n".as_bytes(), "s.csv").unwrap();
    let [a, b] = each(["a", "b"], |name| sheet.needed(name, &[])).unwrap();
    let missing = sheet.optional("c").unwrap();
    let line = sheet.line().unwrap().unwrap();
    assert_eq!((line.whole(a).unwrap(), line.flag(a).unwrap()), (1, true));
    let optional = |column| line.optional_number(column, "a size").unwrap();
    assert_eq!(
        [missing, Some(b), Some(a)].map(optional),
        [None, None, Some(1.0)]
    );
    assert!(line.any_number(b, "").is_err() && line.empty(b, "").is_ok());
    let error = message(line.name(b, "a name"));
    assert_eq!(error, "s.csv:2:2: nothing in `b`; expected a name");
    let error = message(line.empty(a, "`b` is 0"));
    assert_eq!(
        error,
        "s.csv:2:1: `1` in `a`; expected nothing there: `b` is 0"
    );
    let line = sheet.line().unwrap().unwrap();
    assert!(line.any_number(a, "").unwrap().is_nan());
    assert_eq!(line.name(b, "").unwrap(), "x");
    assert!(line.optional_number(Some(b), "").is_err());
    let error = message(line.whole(a));
    assert_eq!(
        error,
        "s.csv:3:1: `nan` in `a`; expected a whole number, at least 0"
    );
    assert_eq!(
        message(line.flag(b)),
        "s.csv:3:2: `x` in `b`; expected 0 or 1"
    );
}
