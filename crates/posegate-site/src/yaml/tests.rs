use super::*;

const MESSAGES: FormatMessages = FormatMessages {
    what: "a test file",
    written: "write it otherwise",
    numbers: "write numbers plainly",
    not_finite: "measure again",
    length: "write all numbers",
    reads_first: false,
};

fn document(text: &str) -> Document<'_> {
    let source = Source {
        file: "t.yaml",
        text,
    };
    Document::new(source, &MESSAGES).expect("no tab")
}

fn fault(text: &str) -> SiteError {
    // A tree may name so much that it cannot be printed.
    match document(text).parse() {
        Ok(_) => panic!("no fault: {:.60}", text),
        Err(error) => error,
    }
}

/// Returns the message, the line and the column of a fault.
fn place(error: &SiteError) -> (&str, usize, usize) {
    let at = error.at.expect("a place");
    (&error.message, at.line, at.column)
}

#[test]
fn values_have_their_positions() {
    let text = "a: 1.5\nb: [2, 'three']\nc:\n  d: &x {e: 4}\nf: *x\n";
    let document = document(text);
    let root = document.parse().unwrap();
    let map = document.map(&root).unwrap();
    assert_eq!(map.keys().collect::<Vec<_>>(), ["a", "b", "c", "f"]);
    let at = |node: &Node| &text[node.at.clone()];
    let a = map.get("a").unwrap();
    assert_eq!((at(a), document.number(a).unwrap()), ("1.5", 1.5));
    let list = document.list(map.get("b").unwrap()).unwrap();
    assert_eq!((at(&list[0]), at(&list[1])), ("2", "'three'"));
    assert_eq!(document.text(&list[1]).unwrap(), "three");
    // An alias has the place where it stands, and the value that it names.
    let f = map.get("f").unwrap();
    assert_eq!(at(f), "*x");
    let e = document.map(f).unwrap().get("e").unwrap();
    assert_eq!((at(e), document.whole(e).unwrap()), ("4", 4));
}

/// An empty value is no default: it would be 0 or the identity where someone has still to write a number.
#[test]
fn empty_values_are_refused() {
    let document = document("a:\nb: ~\nc: null\nd: 'null'\ne: ''\nf: {g: }\n");
    let root = document.parse().unwrap();
    let map = document.map(&root).unwrap();
    for key in ["a", "b", "c"] {
        let node = map.get(key).unwrap();
        for error in [
            document.text(node).unwrap_err(),
            document.number(node).unwrap_err(),
            document.whole(node).unwrap_err(),
            document.list(node).unwrap_err(),
            document.map(node).err().unwrap(),
        ] {
            assert_eq!(&*error.message, "found no value", "{key}");
        }
        assert!(document.list_or_none(Some(node)).unwrap().is_empty());
    }
    for (key, text) in [("d", "null"), ("e", "")] {
        let node = map.get(key).unwrap();
        assert_eq!(document.text(node).unwrap(), text);
        assert!(document.list_or_none(Some(node)).is_err());
    }
    assert!(map.get("h").is_none() && document.list_or_none(None).unwrap().is_empty());
    for nothing in ["", "# nothing\n", "---\n", "~\n"] {
        let document = self::document(nothing);
        let root = document.parse().unwrap();
        assert_eq!(document.map(&root).unwrap().keys().count(), 0);
    }
    for other in ["word\n", "[1]\n"] {
        let document = self::document(other);
        let root = document.parse().unwrap();
        assert!(document.map(&root).is_err(), "{other}");
    }
}

/// A tag may change what a value means.
#[test]
fn tags_are_refused() {
    for value in [
        "!degrees 5",
        "!!float 5",
        "!!str 5",
        "!!null 5",
        "!!int 3.7",
        "! 5",
        "!!float [5]",
        "!!float {b: 5}",
        "!!opencv-matrix [5]",
        "!!opencv-matrix 5",
        "!!merge 5",
        "&b !t 5",
    ] {
        let error = fault(&format!("a: {value}\n"));
        assert!(
            error.message.contains("the value has the tag `!"),
            "{value}: {error}"
        );
        assert!(error.expected.is_some() && error.help.is_some() && error.at.unwrap().line == 1);
    }
    // It would be a key like others, and its map would be ignored.
    assert!(
        fault("b: &b {c: 1}\nd: {!!merge '<<': *b}\n")
            .message
            .contains("`!!merge`")
    );
    let text = "a: !!opencv-matrix\n  data: [5]\nb: &b {c: 1}\nd: {!!merge <<: *b}\n";
    let document = document(text);
    let root = document.parse().unwrap();
    let map = document.map(&root).unwrap();
    assert!(
        document
            .map(map.get("a").unwrap())
            .unwrap()
            .get("data")
            .is_some()
    );
    assert!(
        document
            .map(map.get("d").unwrap())
            .unwrap()
            .get("c")
            .is_some()
    );
}

#[test]
fn numbers_are_those_of_yaml() {
    for (text, value) in [
        ("0", 0.0),
        ("-1.5", -1.5),
        ("+2", 2.0),
        ("6.15e+02", 615.0),
        (".5", 0.5),
        ("1.", 1.0),
        ("010", 10.0),
        (".inf", f64::INFINITY),
        ("-.Inf", f64::NEG_INFINITY),
        ("+.INF", f64::INFINITY),
    ] {
        assert_eq!(number(text), Some(value), "{text}");
    }
    assert!(number(".nan").unwrap().is_nan() && number(".NaN").unwrap().is_nan());
    for text in [
        "", "~", "nan", "inf", "-inf", "infinity", ".Nan", "1e999", "1,5", "5cm", "1 2", "0x1F",
        "--1", "+-1",
    ] {
        assert_eq!(number(text), None, "{text}");
    }
    for (text, value) in [
        ("0", 0),
        ("7", 7),
        ("+7", 7),
        ("4294967295", u32::MAX),
        ("0x1F", 31),
        ("0o17", 15),
        // YAML 1.1 reads 7 too, and no number.
        ("007", 7),
        ("08", 8),
    ] {
        assert_eq!(whole(text), Some(value), "{text}");
    }
    for text in [
        "",
        "-1",
        "-0",
        "1.0",
        "1e3",
        // 10, and 8 in YAML 1.1.
        "010",
        "0x010g",
        "4294967296",
        "0x",
        "0x+1",
        "++1",
        "0b1",
        "1f",
    ] {
        assert_eq!(whole(text), None, "{text}");
    }
}

#[test]
fn merge_keys_add_what_is_missing() {
    let document = document(
        "x: &x {a: 1, b: 2}\ny: &y {b: 3, c: 4}\nz:\n  <<: [*x, *y]\n  a: 5\nw: {<<: *y}\n'<<': 6\n",
    );
    let root = document.parse().unwrap();
    let map = document.map(&root).unwrap();
    let whole = |of: &str, key: &str| {
        let map = document.map(map.get(of)?).ok()?;
        document.whole(map.get(key)?).ok()
    };
    assert_eq!(
        ["a", "b", "c"].map(|key| whole("z", key)),
        [Some(5), Some(2), Some(4)]
    );
    assert_eq!(
        ["a", "b", "c"].map(|key| whole("w", key)),
        [None, Some(3), Some(4)]
    );
    // In quotes it is a key like others.
    assert!(map.get("<<").is_some());
    assert_eq!(
        place(&fault("a: 1\n<<: 2\n")),
        ("`<<` has a value that is not a map", 2, 5)
    );
}

#[test]
fn faults_have_their_places() {
    let rows = [
        (
            "a: 1\nb: 2\na: 3\n",
            "`a` is there twice, first in line 1",
            3,
            1,
        ),
        (
            "a: 1\n\"a\": 3\n",
            "`\"a\"` is there twice, first in line 1",
            2,
            1,
        ),
        ("? [1, 2]\n: 3\n", "a key is empty, a list or a map", 1, 3),
        (": 3\n", "a key is empty, a list or a map", 1, 1),
        ("a: 1\n~: 3\n", "a key is empty, a list or a map", 2, 1),
        ("a: 1\n---\nb: 2\n", "the file has several documents", 2, 1),
        (
            "a: &x [1, *x]\n",
            "the alias is inside the value that it names",
            1,
            11,
        ),
    ];
    for (text, message, line, column) in rows {
        let error = fault(text);
        assert_eq!(place(&error), (message, line, column), "{text}");
        assert!(error.expected.is_some() && error.help.is_some(), "{error}");
    }
    // The parser's faults.
    for (text, line) in [
        ("a: [1, 2\nb: 3\n", 2),
        ("a: *none\n", 1),
        ("a: \"b\n", 1),
        ("a: 1\n b: 2\n", 2),
        ("a: b: c\n", 1),
    ] {
        let error = fault(text);
        let (message, found, _) = place(&error);
        assert!(
            message.starts_with("not read: ") && message.len() > 12,
            "{error}"
        );
        assert!(found.abs_diff(line) <= 1, "{error}");
        assert!(error.expected.is_some() && error.help.is_some(), "{error}");
    }
}

#[test]
fn values_of_another_kind_are_named() {
    let document = document("a: {b: 1}\nc: [1]\nd: word\ne:\n");
    let root = document.parse().unwrap();
    let map = document.map(&root).unwrap();
    let [a, c, d] = ["a", "c", "d"].map(|key| map.get(key).unwrap());
    let rows = [
        (
            document.number(a).unwrap_err(),
            "found a map of keys",
            "a number",
        ),
        (document.text(c).unwrap_err(), "found a list", "a text"),
        (
            document.whole(d).unwrap_err(),
            "found `word`",
            "a whole number",
        ),
        (document.list(d).unwrap_err(), "found `word`", "a list"),
        (
            document.map(c).err().unwrap(),
            "found a list",
            "a test file",
        ),
        (
            document.only_keys(map, &["a", "c", "d"]).unwrap_err(),
            "unknown key `e`",
            "one of `a`, `c`, `d`",
        ),
        (
            document.numbers::<2>(c, "c").unwrap_err(),
            "c has 1 numbers",
            "2 numbers",
        ),
    ];
    for (error, message, expected) in rows {
        assert_eq!(
            (&*error.message, error.expected.as_deref()),
            (message, Some(expected))
        );
        assert!(error.help.is_some());
    }
}

/// Files that would fill the memory, the stack or a day of a reader that follows every alias.
#[test]
fn files_are_limited() {
    let too_many = "the file has too many values";
    let too_long = "the file has too long texts";
    let nests = "the file nests too deep";
    let refused = |text: &str, message: &str| {
        let error = fault(text);
        assert_eq!(&*error.message, message);
        let expected = error.expected.unwrap();
        assert!(expected.contains("250000 values"), "{expected}");
    };
    // Each list has the one before nine times.
    let laughs = |count: usize| {
        let mut text = String::from("a0: &a0 [1]\n");
        for at in 1..count {
            let list = vec![format!("*a{}", at - 1); 9].join(", ");
            text.push_str(&format!("a{at}: &a{at} [{list}]\n"));
        }
        text
    };
    assert!(document(&laughs(5)).parse().is_ok());
    refused(&laughs(60), too_many);
    // A chain of aliases is as deep as brackets are.
    let chain = |count: usize| {
        let mut text = String::from("a0: &a0 [1]\n");
        for at in 1..count {
            text.push_str(&format!("a{at}: &a{at} [*a{}]\n", at - 1));
        }
        text
    };
    assert!(document(&chain(60)).parse().is_ok());
    refused(&chain(5_000), nests);
    for (open, close) in [("[", "]"), ("{a: ", "}")] {
        let nested = |depth: usize| format!("{}1{}", open.repeat(depth), close.repeat(depth));
        assert!(document(&nested(60)).parse().is_ok());
        refused(&nested(100_000), nests);
    }
    // Maps that are merged count where they are merged, also those that add nothing.
    let merged = |count: usize| {
        let base: String = (0..100).map(|key| format!("k{key}: 1, ")).collect();
        let maps: String = (0..count)
            .map(|map| format!("m{map}: {{<<: *b}}\n"))
            .collect();
        format!("b: &b {{{base}}}\n{maps}")
    };
    assert!(document(&merged(1_000)).parse().is_ok());
    refused(&merged(1_300), too_many);
    let empty = |count: usize| {
        let maps: String = (0..count)
            .map(|map| format!("m{map}: {{<<: *l}}\n"))
            .collect();
        format!("e: &e {{}}\nl: &l [{}]\n{maps}", "*e, ".repeat(1_000))
    };
    assert!(document(&empty(200)).parse().is_ok());
    refused(&empty(400), too_many);
    let many = |count: usize| format!("a: [{}]\n", "1, ".repeat(count));
    assert!(document(&many(249_990)).parse().is_ok());
    refused(&many(250_001), too_many);
    // A long number, and a long key, many times.
    let long = |count: usize| {
        format!(
            "n: &n 0.{}1\na: [{}]\n",
            "0".repeat(100_000),
            "*n, ".repeat(count)
        )
    };
    assert!(document(&long(100)).parse().is_ok());
    refused(&long(1_000), too_long);
    let keys = |count: usize| {
        format!(
            "k: &k \"{}\"\na: [{}]\n",
            "a".repeat(100_000),
            "{*k : 1}, ".repeat(count)
        )
    };
    assert!(document(&keys(100)).parse().is_ok());
    refused(&keys(1_000), too_long);
}
