//! Opens a bag, and finds the places of frames on the robot.

use super::Reading;
use crate::site_input::Failure;
use posegate_files::files::{FileError, Files, Input};
use posegate_files::printable::{printable, toml_key};
use posegate_replay::recording::{
    BAD_FOLDER, Bag, BagFile, BodyFrames, Recording, RecordingError, Role, Wanted, files_of,
};

/// The topic of static transforms.
const STATIC: &str = "/tf_static";

/// Returns the files of a bag, each registered as an input: the file itself, or those of a folder.
pub fn parts(files: &Files, input: &Input) -> Result<Vec<BagFile<'static>>, Failure> {
    if input.is_standard() {
        let opened = files.open(input)?;
        return Ok(vec![BagFile::Stream(opened.reader, opened.name)]);
    }
    let paths = files_of(input.as_path()).map_err(|fault| Failure::usage(fault, BAD_FOLDER))?;
    for path in &paths {
        files.register(path)?;
    }
    Ok(paths.into_iter().map(BagFile::Path).collect())
}

/// Opens the recording as a bag, with the names of its frames.
pub fn open(
    reading: &Reading<'_>,
    files: &Files,
    wanted: &[Wanted],
) -> Result<Bag<'static>, Failure> {
    let bag = Bag::of_files(parts(files, reading.log)?, wanted);
    Ok(bag.with_frames(reading.options.frames()))
}

/// Returns the places of frames on the robot: those of the site and, if the poses of the wanted topics need others, those of the bag's
/// static transforms.
pub fn body(
    reading: &Reading<'_>,
    files: &Files,
    wanted: &[Wanted],
) -> Result<BodyFrames, Failure> {
    let body = all_of_site(reading);
    // A stream cannot be read twice.
    if !reading.log.as_path().exists() || !needs_more(reading, files, &body, wanted)? {
        return Ok(body);
    }
    let transforms = Wanted {
        topic: STATIC.into(),
        role: Role::Static,
    };
    let mut bag = open(reading, files, &[transforms])?.with_body(body);
    while bag.next().map_err(failure)?.is_some() {}
    let mut body = bag.into_body();
    body.add_static();
    Ok(body)
}

/// Returns the places of a site's frames, for a file that names no frames.
pub fn of_site(reading: &Reading<'_>) -> Result<BodyFrames, Failure> {
    let body = all_of_site(reading);
    let lever = |name: &String| body.place(name).is_some_and(|[x, y, _]| [x, y] != [0.0; 2]);
    match reading.options.child_frame.as_slice() {
        [name] if reading.is_partial && lever(name) => {
            let (topic, child) = (reading.log.display().to_string(), name.clone());
            Err(failure(RecordingError::PartialCovariance { topic, child }))
        }
        _ => Ok(body),
    }
}

fn all_of_site(reading: &Reading<'_>) -> BodyFrames {
    let body = BodyFrames::new(&reading.site.frames)
        .with_origin(reading.site.map_origin)
        .with_named(&reading.options.child_frame)
        .with_base(reading.options.base_frame.as_deref());
    if reading.is_partial {
        body.of_partial_covariances()
    } else {
        body
    }
}

/// Returns `true` if a named frame, or that of the first message of a wanted topic, has no known place.
fn needs_more(
    reading: &Reading<'_>,
    files: &Files,
    body: &BodyFrames,
    wanted: &[Wanted],
) -> Result<bool, Failure> {
    let named = &reading.options.child_frame;
    if named.iter().any(|name| body.place(name).is_none()) {
        return Ok(true);
    }
    let mut bag = open(reading, files, wanted)?.with_body(body.clone());
    loop {
        match bag.next() {
            Ok(Some(_)) => {}
            Ok(None) => return Ok(false),
            Err(RecordingError::ChildFrame { .. }) => return Ok(true),
            // The replay reports it.
            Err(_) => return Ok(false),
        }
        let read = &bag.diagnostics().read;
        if wanted
            .iter()
            .all(|wanted| read.get(&wanted.topic).is_some_and(|count| *count > 0))
        {
            return Ok(false);
        }
    }
}

/// Returns the failure for a recording that cannot be read.
pub fn failure(error: RecordingError) -> Failure {
    match error {
        RecordingError::Io { file, source } => FileError::Unread {
            name: file,
            cause: source,
        }
        .into(),
        RecordingError::ChildFrame { ref child, .. } if child.is_empty() => Failure::usage(
            error.to_string(),
            "the messages name no child frame: if the poses are those of the robot's base, give --child-frame base_link; else the frame's \
             name, with its place in the site ([frame.NAME])",
        ),
        RecordingError::ChildFrame {
            ref child,
            ref known,
            ..
        } => {
            let (child, key) = (printable(child), toml_key(child));
            let known = match known.as_str() {
                "" => String::new(),
                known => format!(" (known: {})", printable(known)),
            };
            Failure::usage(
                error.to_string(),
                &format!(
                    "add its place to the site: [frame.{key}] with x, y, z, roll_deg, pitch_deg, yaw_deg{known}; if it is the robot's base, \
                     give --child-frame {child}"
                ),
            )
        }
        RecordingError::PartialCovariance { .. } => Failure::usage(
            error.to_string(),
            "give poses of the base, a source that fills its covariance (--cross-terms filled), or --set bounded",
        ),
        RecordingError::NotABag { .. } => Failure::usage(
            error.to_string(),
            "record it again, or copy it again; `ros2 bag reindex` mends a folder's list of files",
        ),
        error => Failure::input(error),
    }
}
