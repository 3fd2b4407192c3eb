//! Damaged payloads at the boundary where CDR becomes a message: no panic, and no permit that an independent reader
//! of the same bytes and the plain definition of the success set contradict.

use damage::{Random, damage};
use posegate::gate::self_test;
use posegate_ros2::arguments::Arguments;
use posegate_ros2::clock::Now;
use posegate_ros2::message::{
    Header, Odometry, Pose, PoseWithCovariance, PoseWithCovarianceStamped, Single,
};
use posegate_ros2::permit_gate::{Origin, PermitGate};
use posegate_ros2::poses::Poses;
use posegate_ros2::settings::NodeSettings;
use rustdds::no_key::{DeserializerAdapter, SerializerAdapter};
use rustdds::{CDRDeserializerAdapter, CDRSerializerAdapter, RepresentationIdentifier};

mod damage;

const TABLE: &[u8] = include_bytes!("../../../examples/tables/dock.posegate");
const START_S: i32 = 1_800_000_000;
const PAYLOADS: u64 = 100_000;

fn good() -> PoseWithCovarianceStamped {
    let mut covariance = [0.0; 36];
    (covariance[0], covariance[7], covariance[35]) = (1e-4, 1e-4, 1e-5);
    PoseWithCovarianceStamped {
        header: Header {
            stamp: Now::from_ns(i128::from(START_S) * 1_000_000_000).time(),
            frame_id: "map".into(),
        },
        pose: PoseWithCovariance {
            pose: Pose {
                position: [0.01, 0.0, 0.0],
                orientation: [0.0, 0.0, 0.0, 1.0],
            },
            covariance,
        },
    }
}

/// Reads a payload by the rules of CDR, little-endian, without any code of the node: frame, position, orientation, covariance.
fn read(payload: &[u8]) -> Option<(i32, u32, Vec<u8>, [f64; 43])> {
    let word = |at: usize| {
        Some(u32::from_le_bytes(
            payload.get(at..at + 4)?.try_into().ok()?,
        ))
    };
    let length = word(8)? as usize;
    let text = payload.get(12..12 + length)?;
    let begin = (12 + length).next_multiple_of(8);
    let mut numbers = [0.0; 43];
    for (k, number) in numbers.iter_mut().enumerate() {
        let bytes = payload.get(begin + 8 * k..begin + 8 * k + 8)?;
        *number = f64::from_le_bytes(bytes.try_into().ok()?);
    }
    // The byte that ends the text is not compared with zero; other readers of CDR do not compare it either.
    let (_, name) = text.split_last()?;
    Some((word(0)? as i32, word(4)?, name.to_vec(), numbers))
}

/// Returns `true` if the dock of the example could permit these numbers: a necessary condition, in plain floats.
fn may_permit((sec, nanosec, frame, numbers): &(i32, u32, Vec<u8>, [f64; 43])) -> bool {
    let [x, y, _, qx, qy, qz, qw] = *numbers.first_chunk::<7>().unwrap();
    let covariance = &numbers[7..];
    let norm = qx * qx + qy * qy + qz * qz + qw * qw;
    let yaw = 2.0 * qz.atan2(qw);
    let yaw = yaw.sin().atan2(yaw.cos());
    let radius = 11.3449f64.sqrt() * 0.999;
    let reach = |at: usize| radius * covariance[at].sqrt();
    let is_inside = x.abs() + reach(0) <= 0.08
        && y.abs() + reach(7) <= 0.06
        && yaw.abs() + reach(35) <= 4f64.to_radians();
    let is_fresh = (*sec, *nanosec) == (START_S, 0)
        || (*sec == START_S - 1 && *nanosec > 250_000_000)
        || (*sec == START_S && *nanosec < 1_000_000);
    let frame = frame.strip_prefix(b"/").unwrap_or(frame);
    is_fresh && is_inside && frame == b"map" && (norm - 1.0).abs() < 1e-4
}

#[test]
fn damaged_payloads_never_permit_wrongly() {
    let arguments = Arguments::read(
        "dock.posegate --ros-args -p stands_still:=true -p cross_terms:=filled -p permits_in_a_row:=1 -p inhibit_hold_ms:=1"
            .split(' ')
            .map(str::to_owned),
    ).unwrap();
    let settings = NodeSettings::new(&arguments, TABLE).unwrap();
    let gate = settings.gate();
    let now = |ms: i128| Now::from_ns(i128::from(START_S) * 1_000_000_000 + ms * 1_000_000);
    let message = CDRSerializerAdapter::<PoseWithCovarianceStamped>::to_bytes(&good());
    let original = message.unwrap().to_vec();
    let mut random = Random(1);
    let (mut parsed, mut permits, mut wrong) = (0u64, 0u64, 0u64);
    for _ in 0..PAYLOADS {
        let mut payload = original.clone();
        damage(&mut payload, &mut random);
        let _ = CDRDeserializerAdapter::<Odometry>::from_bytes(
            &payload,
            RepresentationIdentifier::CDR_LE,
        );
        let _ = CDRDeserializerAdapter::<Single<u8>>::from_bytes(
            &payload,
            RepresentationIdentifier::CDR_LE,
        );
        let _ = CDRDeserializerAdapter::<PoseWithCovarianceStamped>::from_bytes(
            &payload,
            RepresentationIdentifier::CDR_BE,
        );
        let read_message = CDRDeserializerAdapter::<PoseWithCovarianceStamped>::from_bytes(
            &payload,
            RepresentationIdentifier::CDR_LE,
        );
        let Ok(message) = read_message else {
            continue;
        };
        parsed += 1;
        let mut node = PermitGate::new(self_test(), TABLE, &settings, &gate, now(-10)).unwrap();
        let origin = Origin {
            publisher: [1; 16],
            number: 1,
        };
        let mut poses = Poses::new(&settings.poses, "/amcl_pose");
        let PoseWithCovarianceStamped { header, pose } = message;
        let report = poses.pose(header, None, &pose.pose, Some(pose.covariance));
        if node.pose(now(0), &report, origin).is_open {
            permits += 1;
            let is_right = read(&payload).is_some_and(|numbers| may_permit(&numbers));
            wrong += u64::from(!is_right);
        }
    }
    println!(
        "\n{{\"name\": \"ros2: damaged payloads\", \"value\": {PAYLOADS}, \"parsed\": {parsed}, \"permits\": {permits}, \"wrong\": {wrong}}}"
    );
    assert_eq!(wrong, 0);
    // The test shows nothing if all payloads are refused, or if all are harmless.
    assert!(parsed > PAYLOADS / 4 && permits > PAYLOADS / 20 && permits < parsed);
}
