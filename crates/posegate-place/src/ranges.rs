//! Parses ranges of a search space from the command line, and candidates from a file.

use posegate::shape::Pose3Deg;
use posegate_files::sheet::{Column, Sheet, SheetError, SheetFault, each, settings};

/// The names of the free numbers, in the order of [`super::Space::free`].
const NAMES: [&str; 4] = ["x", "y", "z", "yaw_deg"];

/// Reads ranges of x, y, z (metres) and yaw (degrees), each at most once: `x=0.3:7,y=-3:3,z=0:2,yaw_deg=0:360`.
///
/// # Errors
/// A description of the error.
pub fn ranges(text: &str) -> Result<[Option<[f64; 2]>; 4], String> {
    let mut ranges = [None; 4];
    for part in text.split(',') {
        let part = part.trim();
        let shape = || format!("`{part}` is not a range; write NAME=LOW:HIGH, like x=0.3:7");
        let (name, range) = part.split_once('=').ok_or_else(shape)?;
        let (low, high) = range.split_once(':').ok_or_else(shape)?;
        let place = NAMES.iter().position(|known| *known == name.trim());
        let place = place.ok_or_else(|| {
            format!(
                "`{}` is nothing that can be free; expected x, y, z or yaw_deg",
                name.trim()
            )
        })?;
        let number = |text: &str| {
            let number: Option<f64> = text.trim().parse().ok();
            number
                .filter(|number| number.is_finite())
                .ok_or_else(|| format!("`{}` in `{part}` is not a number", text.trim()))
        };
        if ranges[place].is_some() {
            return Err(format!("`{}` is given twice", NAMES[place]));
        }
        ranges[place] = Some([number(low)?, number(high)?]);
    }
    Ok(ranges)
}

/// A place to compare with others.
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// The place's name in the file, or its number from 1.
    pub name: String,
    /// The tag's pose in the world.
    pub pose: Pose3Deg,
}

/// Reads candidates from a CSV with the columns `x`, `y`, `z`, `yaw_deg`, and optionally `name`, `roll_deg`,
/// `pitch_deg`. Other columns are ignored.
///
/// # Errors
/// A description of the error, with file and line.
pub fn candidates(input: &[u8], file: &str) -> Result<Vec<Candidate>, String> {
    read(input, file).map_err(|error| match *error.fault {
        SheetFault::Field { text, name, .. } => format!(
            "{file}:{}: `{text}` in column `{name}` is not a number",
            error.line
        ),
        fault => format!("{file}:{}: {fault}", error.line),
    })
}

fn read(input: &[u8], file: &str) -> Result<Vec<Candidate>, SheetError> {
    let mut sheet = Sheet::with(settings().comment(Some(b'#')), input, file)?;
    // Of repeated columns, the first one is used.
    let needed = |name| sheet.first(name).ok_or_else(|| sheet.missing(name, &NAMES));
    let [x, y, z, yaw] = each(NAMES, needed)?;
    let [name, roll, pitch] = ["name", "roll_deg", "pitch_deg"].map(|name| sheet.first(name));
    let mut all: Vec<Candidate> = Vec::new();
    while let Some(line) = sheet.line()? {
        let number = |column| line.number(column, |_| true, "a finite number");
        let or_zero = |column: Option<Column>| column.map_or(Ok(0.0), number);
        let pose = Pose3Deg {
            x: number(x)?,
            y: number(y)?,
            z: number(z)?,
            roll_deg: or_zero(roll)?,
            pitch_deg: or_zero(pitch)?,
            yaw_deg: number(yaw)?,
        };
        let name = match name.map_or("", |column| line.text(column)) {
            "" => (all.len() + 1).to_string(),
            name => name.to_owned(),
        };
        if all.iter().any(|other| other.name == name) {
            return Err(line.wrong_row(format!("a second candidate `{name}`")));
        }
        all.push(Candidate { name, pose });
    }
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ranges_are_read() {
        let read = ranges("x=0.3:7, yaw_deg=0:360").unwrap();
        assert_eq!(read, [Some([0.3, 7.0]), None, None, Some([0.0, 360.0])]);
        for (text, what) in [
            ("x", "NAME=LOW:HIGH"),
            ("x=1", "NAME=LOW:HIGH"),
            ("w=1:2", "nothing that can be free"),
            ("x=1:two", "`two`"),
            ("x=1:inf", "`inf`"),
            ("x=1:2,x=1:2", "twice"),
            ("", "not a range"),
        ] {
            assert!(ranges(text).unwrap_err().contains(what), "{text}");
        }
    }

    #[test]
    fn candidates_are_read() {
        let read = candidates(
            b"name,x,y,z,yaw_deg\npost,1,2,0.5,180\n,3,4,0.5,90\n",
            "c.csv",
        )
        .unwrap();
        assert_eq!(
            (read[0].name.as_str(), read[0].pose.yaw_deg),
            ("post", 180.0)
        );
        assert_eq!((read[1].name.as_str(), read[1].pose.x), ("2", 3.0));
        for (text, what) in [
            ("x,y,z\n1,2,3\n", "c.csv:1: there is no column `yaw_deg`"),
            ("x,y,z,yaw_deg\n1,2,nan,3\n", "c.csv:2: `nan` in column `z`"),
            ("x,y,z,yaw_deg\n1,2,3\n", "c.csv:2"),
            (
                "name,x,y,z,yaw_deg\na,1,2,3,4\na,1,2,3,4\n",
                "c.csv:3: a second candidate `a`",
            ),
        ] {
            let error = candidates(text.as_bytes(), "c.csv").unwrap_err();
            assert!(error.contains(what), "{error}");
        }
    }
}
