//! Damaged detections and camera infos at the boundary where CDR becomes a message: no panic, and no permit that a
//! plain pinhole camera and an independent reader of the same bytes contradict.

use damage::{Random, damage};
use posegate::bake::BakeInput;
use posegate::gate::self_test;
use posegate::report::Heading;
use posegate_ros2::arguments::Arguments;
use posegate_ros2::clock::Now;
use posegate_ros2::message::{AprilTagDetection, AprilTagDetectionArray, CameraInfo, Header};
use posegate_ros2::permit_gate::{Origin, PermitGate};
use posegate_ros2::settings::NodeSettings;
use posegate_site::Site;
use rustdds::no_key::{DeserializerAdapter, SerializerAdapter};
use rustdds::{CDRDeserializerAdapter, CDRSerializerAdapter, RepresentationIdentifier};

mod damage;

const SITE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/live/tags.toml");
const START_S: i32 = 1_800_000_000;
const PAYLOADS: u64 = 20_000;
/// The camera of the site: focal length, middle, size, place ahead of the robot's centre.
const FOCAL: f64 = 1720.0;
const MIDDLE: [f64; 2] = [640.0, 480.0];
const SIZE: [u32; 2] = [1280, 960];
const AHEAD: f64 = 0.25;
/// Ten deviations of a corner, pixels.
const FITS_PX: f64 = 3.0;
const ORIGIN: Origin = Origin {
    publisher: [1; 16],
    number: 1,
};

fn now(ms: i128) -> Now {
    Now::from_ns(i128::from(START_S) * 1_000_000_000 + ms * 1_000_000)
}

/// The corners of a tag of the site from a pose, in a pinhole camera, pixels.
fn corners(id: i32, [x, y, yaw]: [f64; 3]) -> [[f64; 2]; 4] {
    let (size, tag, normal) = match id {
        7 => (0.04, [1.25, 0.0], 200.0f64),
        _ => (0.15, [1.35, 0.2], 225.0),
    };
    let (sin, cos) = normal.to_radians().sin_cos();
    let half = 0.5 * size;
    [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[across, up]| {
        let world = [tag[0] - sin * across - x, tag[1] + cos * across - y];
        let ahead = yaw.cos() * world[0] + yaw.sin() * world[1] - AHEAD;
        let left = yaw.cos() * world[1] - yaw.sin() * world[0];
        [
            MIDDLE[0] - FOCAL * left / ahead,
            MIDDLE[1] - FOCAL * up / ahead,
        ]
    })
}

fn header() -> Header {
    Header {
        stamp: now(0).time(),
        frame_id: "front".into(),
    }
}

fn detections() -> AprilTagDetectionArray {
    let of = |id| AprilTagDetection {
        family: "tag36h11".into(),
        id,
        hamming: 0,
        goodness: 0.0,
        decision_margin: 80.0,
        centre: MIDDLE,
        corners: corners(id, [0.0; 3]),
        homography: [0.0; 9],
    };
    AprilTagDetectionArray {
        header: header(),
        detections: vec![of(8), of(7)],
    }
}

fn info() -> CameraInfo {
    let [cx, cy] = MIDDLE;
    CameraInfo {
        header: header(),
        height: SIZE[1],
        width: SIZE[0],
        distortion_model: "plumb_bob".into(),
        d: vec![0.0; 5],
        k: [FOCAL, 0.0, cx, 0.0, FOCAL, cy, 0.0, 0.0, 1.0],
        r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
        p: [FOCAL, 0.0, cx, 0.0, 0.0, FOCAL, cy, 0.0, 0.0, 0.0, 1.0, 0.0],
        ..CameraInfo::default()
    }
}

/// Reads little-endian CDR, without any code of the node.
struct Cdr<'a> {
    payload: &'a [u8],
    at: usize,
}

impl Cdr<'_> {
    fn bytes<const N: usize>(&mut self) -> Option<[u8; N]> {
        let begin = self.at.next_multiple_of(N);
        self.at = begin + N;
        self.payload.get(begin..self.at)?.try_into().ok()
    }

    fn word(&mut self) -> Option<u32> {
        self.bytes().map(u32::from_le_bytes)
    }

    fn numbers<const N: usize>(&mut self) -> Option<[f64; N]> {
        let mut numbers = [0.0; N];
        for number in &mut numbers {
            *number = f64::from_le_bytes(self.bytes()?);
        }
        Some(numbers)
    }

    fn text(&mut self) -> Option<Vec<u8>> {
        let length = self.word()? as usize;
        let text = self.payload.get(self.at..self.at + length)?;
        self.at += length;
        // Some writers omit the zero of an empty text.
        Some(
            text.split_last()
                .map_or(Vec::new(), |(_, text)| text.to_vec()),
        )
    }

    fn header(&mut self) -> Option<(u32, u32, Vec<u8>)> {
        Some((self.word()?, self.word()?, self.text()?))
    }
}

/// Returns `true` if detections with these bytes could permit at a pose: a necessary condition, in plain floats.
fn may_permit(payload: &[u8], pose: [f64; 3]) -> Option<bool> {
    let mut cdr = Cdr { payload, at: 0 };
    let (sec, nanosec, frame) = cdr.header()?;
    let (sec, start) = (i64::from(sec as i32), i64::from(START_S));
    let is_fresh =
        (sec == start && nanosec < 1_000_000) || (sec == start - 1 && nanosec > 250_000_000);
    let [x, y, yaw] = pose;
    let is_inside = x.abs() < 0.08 && y.abs() < 0.2 && yaw.abs() < 9f64.to_radians();
    let (mut used, mut fits) = (0, true);
    for _ in 0..cdr.word()? {
        let family = cdr.text()?;
        let (id, hamming) = (cdr.word()? as i32, cdr.word()? as i32);
        let _ = (cdr.word()?, cdr.word()?, cdr.numbers::<2>()?);
        let seen = cdr.numbers::<8>()?;
        let _ = cdr.numbers::<9>()?;
        let is_known =
            [b"tag36h11".as_slice(), b"36h11"].contains(&family.as_slice()) && [7, 8].contains(&id);
        if !is_known || hamming != 0 {
            continue;
        }
        used += 1;
        let expected = corners(id, pose);
        let apart = seen
            .iter()
            .zip(expected.as_flattened())
            .map(|(a, b)| (a - b).abs());
        fits &= apart.fold(0.0, f64::max) < FITS_PX && seen.iter().all(|pixel| pixel.is_finite());
    }
    Some(is_fresh && is_inside && frame == b"front" && used > 0 && fits)
}

/// Returns `true` if a camera info with these bytes could be that of the site's camera: a necessary condition, in
/// plain floats.
fn may_be_the_camera(payload: &[u8]) -> Option<bool> {
    let mut cdr = Cdr { payload, at: 0 };
    let (_, _, frame) = cdr.header()?;
    let (height, width) = (cdr.word()?, cdr.word()?);
    let _ = cdr.text()?;
    let count = cdr.word()?;
    let mut d = [0.0; 8];
    for k in 0..count as usize {
        *d.get_mut(k)? = cdr.numbers::<1>()?[0];
    }
    let (k, _, p) = (
        cdr.numbers::<9>()?,
        cdr.numbers::<9>()?,
        cdr.numbers::<12>()?,
    );
    // The upper left corner of the image, where a lens moves a pixel most.
    let ray = [-MIDDLE[0] / FOCAL, -MIDDLE[1] / FOCAL];
    let r2 = ray[0] * ray[0] + ray[1] * ray[1];
    let radial = 1.0 + r2 * (d[0] + r2 * (d[1] + r2 * d[4]));
    let tangential = [
        2.0 * d[2] * ray[0] * ray[1] + d[3] * (r2 + 2.0 * ray[0] * ray[0]),
        d[2] * (r2 + 2.0 * ray[1] * ray[1]) + 2.0 * d[3] * ray[0] * ray[1],
    ];
    let is_near = |focal: [f64; 2], middle: [f64; 2], radial: f64, tangential: [f64; 2]| {
        (0..2).all(|axis| {
            let pixel = middle[axis] + focal[axis] * (ray[axis] * radial + tangential[axis]);
            pixel.abs() < 1.001 && (middle[axis] - MIDDLE[axis]).abs() < 1.001
        })
    };
    let raw = is_near([k[0], k[4]], [k[2], k[5]], radial, tangential);
    let rect = is_near([p[0], p[5]], [p[2], p[6]], 1.0, [0.0; 2]);
    Some(frame == b"front" && [width, height] == SIZE && (raw || rect))
}

fn settings(table: &[u8]) -> NodeSettings {
    let line = format!(
        "dock.posegate --site {SITE} --ros-args -p stands_still:=true -p use_detections:=true -p corner_sigma_px:=0.3 -p permits_in_a_row:=1 -p inhibit_hold_ms:=1"
    );
    let arguments = Arguments::read(line.split(' ').map(str::to_owned)).unwrap();
    NodeSettings::new(&arguments, table).unwrap()
}

fn table() -> Vec<u8> {
    let site = Site::read(SITE).unwrap();
    let task = site.task("dock").unwrap();
    let order = BakeInput {
        task: "dock",
        success: &task.success,
        spec: *site.table_spec(task).unwrap(),
        epsilon: site.epsilon,
    };
    posegate::verify::build(&order, &|| ()).unwrap().0
}

/// Damages one of the two messages of a look. Counts the payloads that are decoded, those that permit, and those that
/// must not.
fn count(
    original: &[u8],
    damaged: impl Fn(&[u8]) -> Option<(CameraInfo, AprilTagDetectionArray)>,
    may_permit: impl Fn(&[u8], [f64; 3]) -> Option<bool>,
) -> [u64; 3] {
    let table = table();
    let settings = settings(&table);
    let gate = settings.gate();
    let mut random = Random(1);
    let mut counts = [0; 3];
    for _ in 0..PAYLOADS {
        let mut payload = original.to_vec();
        damage(&mut payload, &mut random);
        let Some((info, detections)) = damaged(&payload) else {
            continue;
        };
        counts[0] += 1;
        let mut node = PermitGate::new(self_test(), &table, &settings, &gate, now(-10)).unwrap();
        node.camera_info(Some(&info));
        if node.detections(now(0), &detections, ORIGIN).is_open {
            counts[1] += 1;
            let estimate = node.last().unwrap().estimate;
            let Heading::Radians(yaw) = estimate.heading else {
                panic!("{estimate:?}");
            };
            let pose = [estimate.x_m, estimate.y_m, yaw];
            counts[2] += u64::from(may_permit(&payload, pose) != Some(true));
        }
    }
    counts
}

fn report(what: &str, [parsed, permits, wrong]: [u64; 3]) {
    println!(
        "\n{{\"name\": \"ros2: damaged {what}\", \"value\": {PAYLOADS}, \"parsed\": {parsed}, \"permits\": {permits}, \"wrong\": {wrong}}}"
    );
    assert_eq!(wrong, 0);
    // The test shows nothing if all payloads are refused, or if all are harmless.
    assert!(parsed > PAYLOADS / 4 && permits > PAYLOADS / 20 && permits < parsed);
}

#[test]
fn damaged_detections_never_permit_wrongly() {
    let bytes = CDRSerializerAdapter::<AprilTagDetectionArray>::to_bytes(&detections()).unwrap();
    let damaged = |payload: &[u8]| {
        let _ = CDRDeserializerAdapter::<AprilTagDetectionArray>::from_bytes(
            payload,
            RepresentationIdentifier::CDR_BE,
        );
        let read = CDRDeserializerAdapter::<AprilTagDetectionArray>::from_bytes(
            payload,
            RepresentationIdentifier::CDR_LE,
        );
        read.ok().map(|detections| (info(), detections))
    };
    report("detections", count(&bytes, damaged, may_permit));
}

#[test]
fn damaged_camera_infos_never_permit_wrongly() {
    let bytes = CDRSerializerAdapter::<CameraInfo>::to_bytes(&info()).unwrap();
    let damaged = |payload: &[u8]| {
        let read = CDRDeserializerAdapter::<CameraInfo>::from_bytes(
            payload,
            RepresentationIdentifier::CDR_LE,
        );
        read.ok().map(|info| (info, detections()))
    };
    let is_right = |payload: &[u8], _: [f64; 3]| may_be_the_camera(payload);
    report("camera infos", count(&bytes, damaged, is_right));
}
