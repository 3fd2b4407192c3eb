//! Cameras from TOML.

use super::calibration::Misfit;
use super::calibration::{self, Numbers};
use super::error::SiteError;
use super::named::NamedFile;
use super::reader::{Key, Node, Table};
use super::{Note, SiteCamera, keys, places, poses};
use posegate::certify::{Calibration, CertifiedCamera, Image, LensError, Roi};
use posegate::shape::{Intrinsics, Lens, Tolerance};

const WIDEST_IMAGE: u32 = 100_000;

/// The keys that a calibration file replaces.
const NUMBERS: [&Key; 5] = [
    &keys::FX,
    &keys::FY,
    &keys::CX,
    &keys::CY,
    &keys::DISTORTION,
];

/// Reads a camera. Also returns its calibration file if it names one.
/// Adds to `notes` what was assumed.
pub(super) fn camera(
    node: &Node<'_>,
    notes: &mut Vec<Note>,
) -> Result<(SiteCamera, Option<NamedFile>), SiteError> {
    let table = node.table(&[
        &keys::WIDTH,
        &keys::HEIGHT,
        &keys::FX,
        &keys::FY,
        &keys::CX,
        &keys::CY,
        &keys::MOUNT,
        &keys::MOUNT_TOLERANCE,
        &keys::INTRINSICS,
        &keys::DISTORTION,
        &keys::CALIBRATION,
        &keys::IMAGE,
        &keys::BORDER,
        &keys::ROI,
        &keys::BINNING,
    ])?;
    let (numbers, named) = match table.optional(&keys::CALIBRATION) {
        None => (own_numbers(&table)?, None),
        Some(file) => {
            let (mut numbers, named) = of_file(&table, &file)?;
            notes.append(&mut numbers.notes);
            (numbers, Some(named))
        }
    };
    let calibration = Calibration {
        size_px: numbers.size_px,
        focal_px: numbers.focal_px,
        axis_px: numbers.axis_px,
        lens: numbers.lens,
        image: image(&table, &numbers)?,
        roi: match table.optional(&keys::ROI) {
            Some(node) => Some(roi(&node)?),
            None => numbers.roi,
        },
        binning: match table.optional(&keys::BINNING) {
            Some(node) => binning(&node)?,
            None => numbers.binning,
        },
        border_px: match table.optional(&keys::BORDER) {
            Some(node) => node.number()?,
            None => 0.0,
        },
    };
    let tolerance = match table.optional(&keys::INTRINSICS) {
        Some(node) => intrinsics(&node, &calibration)?,
        None => Intrinsics::NONE,
    };
    let (calibration, view) =
        unfolded(calibration, tolerance, notes).map_err(|fault| unseen(&table, fault))?;
    let camera = SiteCamera {
        camera: view.camera,
        mount: poses::pose3(&table.required(&keys::MOUNT)?)?,
        mount_tolerance: match table.optional(&keys::MOUNT_TOLERANCE) {
            Some(node) => places::mount_tolerance(&node)?,
            None => Tolerance::NONE,
        },
        tolerance,
        kept: view.kept,
        calibration,
    };
    Ok((camera, named))
}

/// The steps of the search for a border within which a lens does not fold.
const BORDER_STEPS: u32 = 10;

/// Returns the certified camera and its calibration. If the lens folds within the image, the border of the image is not used, as if the
/// site had a `border_px`, and a note says so.
fn unfolded(
    calibration: Calibration,
    tolerance: Intrinsics,
    notes: &mut Vec<Note>,
) -> Result<(Calibration, CertifiedCamera), LensError> {
    let fault = match seen(&calibration, tolerance) {
        Ok(view) => return Ok((calibration, view)),
        Err(fault) => fault,
    };
    let LensError::Folds { fold_px, image_px } = fault else {
        return Err(fault);
    };
    let [width, height] = calibration.size_px;
    let (mut folds, mut fits) = (calibration.border_px, 0.5 * width.min(height));
    let mut found = None;
    for _ in 0..BORDER_STEPS {
        let border_px = libm::ceil(0.5 * (folds + fits));
        let narrower = Calibration {
            border_px,
            ..calibration
        };
        match seen(&narrower, tolerance) {
            Ok(view) => {
                fits = border_px;
                found = Some((narrower, view));
            }
            Err(LensError::Folds { .. }) => folds = border_px,
            Err(_) => fits = border_px,
        }
    }
    let (narrower, view) = found.ok_or(fault)?;
    notes.push(Note {
        code: "lens_folds",
        message: format!(
            "the distortion folds at {fold_px:.1} px from the optical axis, and the image reaches {image_px:.1} px: a border of {} px is not used",
            narrower.border_px
        ),
        help: "calibrate again with the pattern in the corners of the image too, or with fewer coefficients",
    });
    Ok((narrower, view))
}

/// Returns the certified camera. Its border is widened by the farthest distance that the tolerance can move a point
/// of the image.
pub(super) fn seen(
    calibration: &Calibration,
    tolerance: Intrinsics,
) -> Result<CertifiedCamera, LensError> {
    let view = CertifiedCamera::of(calibration)?;
    if tolerance == Intrinsics::NONE {
        return Ok(view);
    }
    let image = view.camera;
    let reach_px = tolerance.reach_px([image.width_px, image.height_px], [image.cx, image.cy]);
    CertifiedCamera::of(&Calibration {
        border_px: (calibration.border_px + reach_px).next_up(),
        ..*calibration
    })
}

/// Reads the tolerance of a calibration. Refused for a rectified image: the effect of the tolerance on
/// rectification is not modelled.
fn intrinsics(node: &Node<'_>, calibration: &Calibration) -> Result<Intrinsics, SiteError> {
    let Calibration {
        focal_px: [fx, fy],
        axis_px: [cx, cy],
        ..
    } = *calibration;
    let same = match calibration.image {
        Image::Rect(rect) => calibration.lens == Lens::Pinhole && rect == [fx, fy, cx, cy],
        _ => true,
    };
    if same {
        places::intrinsics(node)
    } else {
        Err(node
            .error(format!(
                "`{}` is supported only for raw images, and for cameras without distortion",
                node.path()
            ))
            .expected("no `tolerance` if the detector reads the rectified image")
            .help("read the raw image, or give a `border_px` that is wide enough"))
    }
}

fn pixels(table: &Table<'_>, key: &'static Key) -> Result<f64, SiteError> {
    let node = table.required(key)?;
    node.whole(1..=WIDEST_IMAGE).map(f64::from)
}

/// Reads the numbers that the site file itself gives.
fn own_numbers(table: &Table<'_>) -> Result<Numbers, SiteError> {
    let size_px = [pixels(table, &keys::WIDTH)?, pixels(table, &keys::HEIGHT)?];
    let focal_px = [table.number(&keys::FX)?, table.number(&keys::FY)?];
    let axis_px = [table.number(&keys::CX)?, table.number(&keys::CY)?];
    let lens = match table.optional(&keys::DISTORTION) {
        Some(node) => distortion(&node)?,
        None => Lens::Pinhole,
    };
    Ok(Numbers {
        size_px,
        focal_px,
        axis_px,
        lens,
        rect: [focal_px[0], focal_px[1], axis_px[0], axis_px[1]],
        ..Numbers::default()
    })
}

fn distortion(node: &Node<'_>) -> Result<Lens, SiteError> {
    let table = node.table(&[&keys::MODEL, &keys::COEFFICIENTS])?;
    let model = table.required(&keys::MODEL)?;
    let name = model.text()?;
    let node = table.required(&keys::COEFFICIENTS)?;
    let numbers = node.array()?;
    let numbers = numbers.iter().map(Node::number);
    let numbers = numbers.collect::<Result<std::vec::Vec<f64>, SiteError>>()?;
    match calibration::lens(name, &numbers) {
        Some(Ok(lens)) => Ok(lens),
        Some(Err(Misfit::Count(wanted))) => Err(node.error(format!(
            "`{}` has {} coefficients, {name} has {wanted}",
            node.path(),
            numbers.len()
        ))),
        Some(Err(Misfit::Terms(terms))) => Err(node.error(format!(
            "`{}` has {terms}, which {name} does not have",
            node.path()
        ))),
        None => Err(model.unknown_word(["plumb_bob", "rational_polynomial", "equidistant"])),
    }
}

/// Reads the numbers of a calibration file. Its image size must equal the site's, if the site gives one.
fn of_file(table: &Table<'_>, file: &Node<'_>) -> Result<(Numbers, NamedFile), SiteError> {
    if let Some(key) = NUMBERS.iter().find(|key| table.has(key.name)) {
        let name = key.name;
        let message = format!("{} has both `calibration` and `{name}`", table.title());
        return Err(table
            .error_at_key(name, message)
            .expected("the numbers in one place only")
            .help(format!("remove `{name}`, or `calibration`")));
    }
    let mut size_px = [None, None];
    for (size, key) in size_px.iter_mut().zip([&keys::WIDTH, &keys::HEIGHT]) {
        if table.has(key.name) {
            *size = Some(pixels(table, key)?);
        }
    }
    calibration::read(file, size_px)
}

/// Returns the image that the detector reads. `image` is required if raw and rectified image differ.
fn image(table: &Table<'_>, numbers: &Numbers) -> Result<Image, SiteError> {
    let [fx, fy, cx, cy] = numbers.rect;
    let same = [fx, fy] == numbers.focal_px && [cx, cy] == numbers.axis_px;
    let Some(node) = table.optional(&keys::IMAGE) else {
        if numbers.lens == Lens::Pinhole && same && numbers.turned.is_none() {
            return Ok(Image::Raw);
        }
        let message = format!(
            "`image` is missing from {}, whose raw image differs from the rectified one",
            table.title()
        );
        return Err(table.error(message).expected(keys::IMAGE.what).help(
            "look at the topic that the detector subscribes to: image_rect is `image = \"rect\"`, image_raw is \
             `image = \"raw\"`",
        ));
    };
    match node.text()? {
        "raw" => Ok(Image::Raw),
        "rect" => match &numbers.turned {
            Some(turned) => Err(turned.clone()),
            None => Ok(Image::Rect(numbers.rect)),
        },
        _ => Err(node.unknown_word(["rect", "raw"])),
    }
}

fn roi(node: &Node<'_>) -> Result<Roi, SiteError> {
    let table = node.table(&[
        &keys::X_OFFSET,
        &keys::Y_OFFSET,
        &keys::ROI_WIDTH,
        &keys::ROI_HEIGHT,
    ])?;
    // ROS encodes the whole image as all zeros.
    let whole = |key| table.required(key)?.whole(0..=WIDEST_IMAGE);
    let roi = Roi {
        x_offset: whole(&keys::X_OFFSET)?,
        y_offset: whole(&keys::Y_OFFSET)?,
        width: whole(&keys::ROI_WIDTH)?,
        height: whole(&keys::ROI_HEIGHT)?,
    };
    let is_full_image = [roi.x_offset, roi.y_offset, roi.width, roi.height] == [0; 4];
    for (size, key) in [
        (roi.width, &keys::ROI_WIDTH),
        (roi.height, &keys::ROI_HEIGHT),
    ] {
        if size == 0 && !is_full_image {
            return Err(table.required(key)?.out_of_range());
        }
    }
    Ok(roi)
}

fn binning(node: &Node<'_>) -> Result<[u32; 2], SiteError> {
    // ROS encodes 1 as 0.
    let whole = |node: &Node<'_>| node.whole(0..=100).map(|count| count.max(1));
    match node.array()?.as_slice() {
        [across, down] => Ok([whole(across)?, whole(down)?]),
        other => Err(node.error(format!("`{}` is an array of {}", node.path(), other.len()))),
    }
}

/// Returns the error for a camera without a usable view, at the key that causes the error.
fn unseen(table: &Table<'_>, fault: LensError) -> SiteError {
    let lens = if table.has(keys::CALIBRATION.name) {
        &keys::CALIBRATION
    } else {
        &keys::DISTORTION
    };
    let (key, expected, help) = match fault {
        LensError::Roi { .. } => (
            &keys::ROI,
            "a part of the image",
            "write offsets and sizes in pixels of the whole image without binning",
        ),
        LensError::Border { .. } => (
            &keys::BORDER,
            "a border that leaves some of the image",
            "make `border_px` smaller, or the camera's `tolerance`",
        ),
        LensError::Folds { .. } | LensError::NoField => (
            lens,
            "a distortion that maps no two rays to the same pixel of the image",
            "calibrate again with the pattern in the corners of the image too, or with fewer coefficients; or keep \
             to the part that is well calibrated with `roi` or `border_px`",
        ),
        LensError::Nothing { .. } => (
            lens,
            "an image of the space in front of the camera",
            "check the optical axis (cx, cy), the roi and the projection matrix",
        ),
        _ => (
            lens,
            "valid numbers of a camera",
            "check focal lengths, optical axis and coefficients",
        ),
    };
    let title = table.title();
    let mut message = String::from("the camera of ");
    message.push_str(&format!("{title} cannot be used: {fault}"));
    table
        .error_at_key(key.name, message)
        .expected(expected)
        .help(help)
}
