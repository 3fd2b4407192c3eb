//! Derives the fields of a ROS message from its definition (`ros2msg` text), as one line. This tests whether a type
//! with a known name has the expected fields.

use std::collections::BTreeMap;

/// The deepest nesting of types.
const DEEPEST: u32 = 12;
/// The most fields of a layout: more than any supported message has.
const MOST: usize = 4096;
/// The most bytes in the names of those fields. (A list is one field; its name contains those of its elements.)
const MOST_BYTES: usize = 1 << 16;
/// The most lines that are followed. (Types without fields that refer to each other multiply the lines at every level.)
const MOST_LINES: u32 = 1 << 16;

/// Returns the fields of a definition in order: `float64x7` for seven of them, `sequence<..>` for lists. `None` if the
/// text cannot be parsed.
pub(super) fn layout(definition: &str, name: &str) -> Option<String> {
    let mut types: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    let mut current = short(name);
    for line in definition.lines() {
        let line = line.trim();
        if line.len() >= 10 && line.bytes().all(|byte| byte == b'=') {
            continue;
        }
        if let Some(name) = line.strip_prefix("MSG:") {
            current = short(name.trim());
            continue;
        }
        types.entry(current.clone()).or_default().push(line);
    }
    let mut fields = Vec::new();
    let mut lines = MOST_LINES;
    flatten(&types, &short(name), DEEPEST, &mut lines, &mut fields)?;
    Some(written(&fields))
}

/// Shortens `geometry_msgs/msg/Pose` to `geometry_msgs/Pose`.
pub(super) fn short(name: &str) -> String {
    name.replace("/msg/", "/")
}

/// Joins the fields, with a count for equal consecutive ones.
fn written(fields: &[String]) -> String {
    let groups = fields.chunk_by(|a, b| a == b);
    let words: Vec<String> = groups
        .filter_map(|group| {
            let first = group.first()?;
            Some(match group.len() {
                1 => first.clone(),
                count => format!("{first}x{count}"),
            })
        })
        .collect();
    words.join(" ")
}

/// Returns the number of bytes in all names.
fn bytes(fields: &[String]) -> usize {
    fields.iter().map(String::len).sum()
}

fn flatten(
    types: &BTreeMap<String, Vec<&str>>,
    name: &str,
    deeper: u32,
    left: &mut u32,
    out: &mut Vec<String>,
) -> Option<()> {
    let deeper = deeper.checked_sub(1)?;
    let Some(lines) = types.get(name) else {
        // Definitions may leave out these types.
        if matches!(
            name,
            "builtin_interfaces/Time" | "builtin_interfaces/Duration"
        ) {
            out.extend(["int32", "uint32"].map(String::from));
            return Some(());
        }
        return None;
    };
    for line in lines {
        *left = left.checked_sub(1)?;
        let line = line.split('#').next().unwrap_or("").trim();
        let mut words = line.split_whitespace();
        let (Some(kind), Some(field)) = (words.next(), words.next()) else {
            if line.is_empty() {
                continue;
            }
            return None;
        };
        // A constant is not a field. (A bounded string has `<=` in its type.)
        if field.contains('=') || words.next().is_some_and(|word| word.starts_with('=')) {
            continue;
        }
        let (kind, list) = match kind.split_once('[') {
            None => (kind, None),
            Some((kind, list)) => (kind, Some(list.strip_suffix(']')?)),
        };
        let mut one = Vec::new();
        element(types, name, kind, deeper, left, &mut one)?;
        match list.map(str::parse::<usize>) {
            None => out.append(&mut one),
            Some(Ok(count)) => {
                if count.checked_mul(one.len())?.checked_add(out.len())? > MOST
                    || count.checked_mul(bytes(&one))? > MOST_BYTES
                {
                    return None;
                }
                // An array of elements without fields may have any length.
                let all = one.iter().cycle().take(count * one.len());
                out.extend(all.cloned());
            }
            Some(Err(_)) => out.push(format!("sequence<{}>", written(&one))),
        }
        if out.len() > MOST || bytes(out) > MOST_BYTES {
            return None;
        }
    }
    Some(())
}

fn element(
    types: &BTreeMap<String, Vec<&str>>,
    within: &str,
    kind: &str,
    deeper: u32,
    left: &mut u32,
    out: &mut Vec<String>,
) -> Option<()> {
    let kind = kind.split("<=").next().unwrap_or(kind);
    match kind {
        "bool" | "byte" | "char" | "float32" | "float64" | "int8" | "uint8" | "int16"
        | "uint16" | "int32" | "uint32" | "int64" | "uint64" | "string" | "wstring" => {
            out.push(kind.to_string());
            Some(())
        }
        "time" | "duration" => flatten(types, "builtin_interfaces/Time", deeper, left, out),
        "Header" => flatten(types, "std_msgs/Header", deeper, left, out),
        _ if kind.contains('/') => flatten(types, &short(kind), deeper, left, out),
        _ => {
            let package = within.split('/').next()?;
            flatten(types, &format!("{package}/{kind}"), deeper, left, out)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const ARRAY: &str = "std_msgs/Header header\nAprilTagDetection[] detections\n\
        ================================================================================\n\
        MSG: apriltag_msgs/AprilTagDetection\nstring<=8 family # of tags\nuint8 A=1\nuint8 B = 2\nint32 id\nint32 hamming\n\
        float32 goodness 0.5\nfloat32 decision_margin\nPoint centre\nPoint[4] corners\nfloat64[9] homography\n\
        ================================================================================\n\
        MSG: apriltag_msgs/msg/Point\nfloat64 x\nfloat64 y\n\
        ================================================================================\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n";

    #[test]
    fn nested_types_are_one_line() {
        assert_eq!(
            layout(ARRAY, "apriltag_msgs/msg/AprilTagDetectionArray").as_deref(),
            Some("int32 uint32 string sequence<string int32x2 float32x2 float64x19>")
        );
    }

    /// Empty types have no fields, so a limit on fields does not bound the time.
    #[test]
    fn empty_types_take_bounded_time() {
        let empty = "Nothing[9999999999999] x\n====================\nMSG: a/Nothing\nuint8 A=1\n";
        assert_eq!(layout(empty, "a/msg/T").as_deref(), Some(""));
        let mut nested = String::new();
        for level in 0..10 {
            nested += &format!("====================\nMSG: a/T{level}\n");
            nested += &format!("T{} x\n", level + 1).repeat(100);
        }
        nested += "====================\nMSG: a/T10\nuint8 A=1\n";
        assert_eq!(layout(&format!("T0 x\n{nested}"), "a/msg/T"), None);
    }

    /// Each list is one field, so the number of fields is not a bound: these 327 bytes would produce names of 172 GB.
    #[test]
    fn nested_lists_take_bounded_memory() {
        let mut text = String::from("A0[] x\n");
        for level in 0..4 {
            text += &format!(
                "==========\nMSG: a/A{level}\nB{level}[2048] a\n==========\nMSG: a/B{level}\nA{}[] x\nint8 y\n",
                level + 1
            );
        }
        text += "==========\nMSG: a/A4\nint8 x\n";
        assert!(text.len() < 400);
        assert_eq!(layout(&text, "a/msg/T"), None);
    }

    #[test]
    fn invalid_definition_has_no_layout() {
        for bad in [
            "Point p\n",
            "float64\n",
            "float64[9 x\n",
            "Itself a\n====================\nMSG: a/Itself\nItself b\n",
            "float64[999999999999] x\n",
        ] {
            assert_eq!(layout(bad, "a/msg/T"), None, "{bad}");
        }
    }
}
