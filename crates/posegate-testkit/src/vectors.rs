//! The requests of the vector file, made from a seed: the same bytes on every machine. Only
//! operations that IEEE 754 defines to the last bit are used (no sine, no logarithm). The border of
//! acceptance is found with the gates themselves.

use crate::replay::{HEADER_LENGTH, MAGIC, WITH_REPLY, answer, reply};
use core::f64::consts::{PI, TAU};
use posegate::recordings::Evaluator;
use posegate::set::{Estimate, RadiusSquared};
use posegate::table::checksum;
use posegate::wire::{Request, Uncertainty};

/// Decisions in the file.
pub const COUNT: u32 = 10_650;
/// One reply is kept per this number of requests; with all replies the file would exceed 1 MB. Coprime
/// to the number of tables and of kinds, so that each kind on each table has replies.
const REPLY_EVERY: u32 = 7;
const SEED: u64 = 0x243f_6a88_85a3_08d3;
/// The smallest number above zero.
const TINY: f64 = f64::from_bits(1);

/// Requests after which the gates' turns repeat: two for each but the last, which has one.
const ROUND: u32 = 15;

/// Returns the file. The requests go to the gates in turn.
pub fn file(gates: &[Evaluator<'_>]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(1 << 20);
    bytes.extend(MAGIC);
    bytes.extend(COUNT.to_le_bytes());
    debug_assert_eq!(bytes.len(), HEADER_LENGTH);
    let mut maker = Maker {
        random: SEED,
        gates,
        places: gates.iter().map(Place::of).collect(),
        table: 0,
    };
    for index in 0..COUNT {
        let (round, place) = (index / ROUND, index % ROUND);
        let others = gates.len() as u32 - 1;
        let (table, turn) = if place < 2 * others {
            (place % others, 2 * round + place / others)
        } else {
            (others, round)
        };
        maker.table = table as usize;
        let request = Request {
            sequence: index as u16,
            ..maker.request(turn)
        };
        let body = request.body();
        let code = answer(&request, gates).expect("a gate of every number");
        let with_reply = index % REPLY_EVERY == 0;
        bytes.push(if with_reply { code | WITH_REPLY } else { code });
        bytes.push(body.len() as u8);
        bytes.extend(body);
        if with_reply {
            bytes.extend(reply(&request, gates).body());
        }
    }
    let crc = checksum(&bytes);
    bytes.extend(crc.to_le_bytes());
    bytes
}

/// Where a table lies.
struct Place {
    /// Goal in the world: m, m, rad.
    goal: [f64; 3],
    cos: f64,
    sin: f64,
    /// Middle of the cells in the goal frame.
    middle: [f64; 3],
    half: [f64; 3],
    radius_squared: RadiusSquared,
}

impl Place {
    fn of(gate: &Evaluator<'_>) -> Self {
        let table = gate.table().expect("a table");
        let (goal, cells) = (table.goal(), table.cells());
        let metres = |um: i32| f64::from(um) / 1e6;
        let radians = |units: u64| units as f64 * (TAU / 4_294_967_296.0);
        let (x, y) = (
            [metres(cells.x_lo_um), metres(cells.x_hi_um())],
            [metres(cells.y_lo_um), metres(cells.y_hi_um())],
        );
        let span = radians(cells.yaw_span);
        let yaw = radians(u64::from(cells.yaw_lo.0));
        Self {
            goal: [
                metres(goal.pose.x_um),
                metres(goal.pose.y_um),
                radians(u64::from(goal.pose.yaw.0)),
            ],
            cos: f64::from(goal.cos_q30) / f64::from(1 << 30),
            sin: f64::from(goal.sin_q30) / f64::from(1 << 30),
            middle: [0.5 * (x[0] + x[1]), 0.5 * (y[0] + y[1]), yaw + 0.5 * span],
            half: [0.5 * (x[1] - x[0]), 0.5 * (y[1] - y[0]), 0.5 * span],
            radius_squared: table.radius_squared(),
        }
    }

    /// Returns the pose in the world of a pose relative to the middle of the cells.
    fn pose(&self, [x, y, yaw]: [f64; 3]) -> [f64; 3] {
        let (x, y) = (self.middle[0] + x, self.middle[1] + y);
        let yaw = self.goal[2] + self.middle[2] + yaw;
        [
            self.goal[0] + self.cos * x - self.sin * y,
            self.goal[1] + self.sin * x + self.cos * y,
            // Above half a turn as a negative angle.
            if yaw > PI { yaw - TAU } else { yaw },
        ]
    }
}

/// The form of a pose-set, without its size.
#[derive(Clone, Copy)]
enum Form {
    /// Deviations; correlations xy, x-yaw, y-yaw.
    Gaussian([f64; 3], [f64; 3]),
    /// Translation, yaw.
    Bounded(f64, f64),
}

impl Form {
    fn times(self, size: f64) -> Uncertainty {
        match self {
            Self::Gaussian(deviations, [xy, x_yaw, y_yaw]) => {
                let [x, y, yaw] = deviations.map(|deviation| deviation * size);
                let (xy, x_yaw, y_yaw) = (xy * x * y, x_yaw * x * yaw, y_yaw * y * yaw);
                Uncertainty::Gaussian([
                    [x * x, xy, x_yaw],
                    [xy, y * y, y_yaw],
                    [x_yaw, y_yaw, yaw * yaw],
                ])
            }
            Self::Bounded(translation, yaw) => Uncertainty::Bounded {
                translation_m: translation * size,
                yaw_rad: yaw * size,
            },
        }
    }
}

struct Maker<'a> {
    random: u64,
    gates: &'a [Evaluator<'a>],
    places: Vec<Place>,
    /// The table of the request.
    table: usize,
}

impl Maker<'_> {
    /// Makes request `turn` to the present table.
    fn request(&mut self, turn: u32) -> Request {
        // Counts through the choices of a kind.
        let choice = turn / 16;
        match turn % 16 {
            0..4 => self.at_the_border_by_size(),
            4 | 5 => self.bent(),
            6..9 => self.at_the_border_by_place(),
            9 | 10 => self.anywhere(),
            11 => self.wound_up(choice),
            12 => self.tiny(choice),
            13 => self.correlated(choice),
            14 => self.impossible(choice),
            _ => match choice % 3 {
                0 => self.at_any_age(choice / 3),
                1 => self.far(),
                _ => self.wide(choice / 3),
            },
        }
    }

    // Numbers.

    /// SplitMix64 (Steele, Lea and Flood 2014).
    fn bits(&mut self) -> u64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, count: u64) -> u64 {
        (self.bits() >> 11) % count
    }

    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.bits() >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn sign(&mut self) -> f64 {
        if self.below(2) == 0 { -1.0 } else { 1.0 }
    }

    /// Returns a number between 1e-6 and 1e-1, small ones as likely as large ones.
    fn hair(&mut self) -> f64 {
        let powers = [1e-6, 1e-5, 1e-4, 1e-3, 1e-2];
        self.uniform(1.0, 10.0) * powers[self.below(5) as usize]
    }

    // Poses and forms.

    fn place(&self) -> &Place {
        &self.places[self.table]
    }

    /// Returns an offset from the middle of the cells, up to `share` of the distance to their ends.
    fn offset(&mut self, share: f64) -> [f64; 3] {
        let half = self.place().half;
        half.map(|half| half * self.uniform(-share, share))
    }

    /// Returns an offset at which a tiny set is permitted.
    fn inside(&mut self) -> [f64; 3] {
        loop {
            let offset = self.offset(1.0);
            if self.permits(offset, Form::Bounded(1e-4, 1e-4), 1.0) {
                return offset;
            }
        }
    }

    /// Returns a form of the size of the cells' extent or much smaller.
    fn form(&mut self) -> Form {
        let half = self.place().half;
        let mut extent = || {
            half.map(|half| {
                let share = self.uniform(0.05, 1.0);
                0.5 * half * share * share
            })
        };
        let [x, y, yaw] = extent();
        if self.below(100) < 44 {
            Form::Gaussian([x, y, yaw], self.correlations())
        } else {
            Form::Bounded(x.min(y), yaw)
        }
    }

    /// Returns correlations of a positive definite matrix: scalar products of three unit vectors.
    fn correlations(&mut self) -> [f64; 3] {
        let mut unit = || {
            let v = [(); 3].map(|()| self.uniform(-1.0, 1.0));
            let length = (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt();
            v.map(|c| c / length)
        };
        let (a, b, c) = (unit(), unit(), unit());
        let dot = |a: [f64; 3], b: [f64; 3]| 0.98 * (a[0] * b[0] + a[1] * b[1] + a[2] * b[2]);
        [dot(a, b), dot(a, c), dot(b, c)]
    }

    // Requests.

    /// Returns a request about a pose in the world, with an allowed age.
    fn about(&mut self, [x_m, y_m, yaw_rad]: [f64; 3], spread: Uncertainty) -> Request {
        let stamp_ms = self.bits() as u32;
        let age_ms = self.below(201) as u32;
        let site = self.place().radius_squared;
        // A sender may be stricter than the site.
        let stricter = RadiusSquared::from_q16(site.q16() + self.below(1 << 20) as u32);
        Request {
            sequence: 0,
            table: self.table as u8,
            stamp_ms,
            now_ms: stamp_ms.wrapping_add(age_ms),
            radius_squared: stricter
                .filter(|_| stamp_ms.is_multiple_of(8))
                .unwrap_or(site),
            estimate: Estimate { x_m, y_m, yaw_rad },
            spread,
        }
    }

    fn at(&mut self, offset: [f64; 3], form: Form, size: f64) -> Request {
        let pose = self.place().pose(offset);
        self.about(pose, form.times(size))
    }

    /// Returns `true` if the set with the site's radius is permitted. Uses no random numbers.
    fn permits(&self, offset: [f64; 3], form: Form, size: f64) -> bool {
        let [x_m, y_m, yaw_rad] = self.place().pose(offset);
        let request = Request {
            sequence: 0,
            table: self.table as u8,
            stamp_ms: 0,
            now_ms: 0,
            radius_squared: self.place().radius_squared,
            estimate: Estimate { x_m, y_m, yaw_rad },
            spread: form.times(size),
        };
        answer(&request, self.gates) == Some(0)
    }

    fn at_the_border_by_size(&mut self) -> Request {
        let (offset, form) = (self.inside(), self.form());
        self.sized_to_the_border(offset, form)
    }

    /// Makes a set that is wide in yaw and in the plane, so that it is bent in the robot's frame.
    fn bent(&mut self) -> Request {
        let [x, y, yaw] = self.inside();
        let (half, site) = (self.place().half, self.place().radius_squared);
        let radius = (f64::from(site.q16()) / 65_536.0).sqrt();
        let turn = half[2].min(0.5) * self.uniform(0.3, 0.6) / radius;
        let [across, along] = [half[0], half[1]].map(|v| v * self.uniform(0.1, 0.5) / radius);
        let form = Form::Gaussian([across, along, turn], self.correlations());
        // A heading with slack on both sides.
        self.sized_to_the_border([x, y, 0.3 * yaw], form)
    }

    /// Makes a set slightly larger or smaller than the largest one that is permitted.
    fn sized_to_the_border(&mut self, offset: [f64; 3], form: Form) -> Request {
        let permits = |size: f64| self.permits(offset, form, size);
        let mut inside = 1.0;
        for _ in 0..40 {
            if permits(inside) {
                break;
            }
            inside *= 0.5;
        }
        let mut outside = 2.0 * inside;
        for _ in 0..40 {
            if !permits(outside) {
                break;
            }
            outside *= 2.0;
        }
        let border = between(inside, outside, permits);
        let size = border * (1.0 + self.sign() * self.hair());
        self.at(offset, form, size)
    }

    /// Makes a set slightly nearer or farther than the last permitted place on its way out.
    fn at_the_border_by_place(&mut self) -> Request {
        let half = self.place().half;
        loop {
            let (from, form) = (self.inside(), self.form());
            let size = self.uniform(0.01, 0.3);
            let way = half.map(|half| 2.0 * half * self.uniform(-1.0, 1.0));
            let along = |part: f64| core::array::from_fn(|axis| from[axis] + part * way[axis]);
            let permits = |part: f64| self.permits(along(part), form, size);
            if permits(0.0) && !permits(1.0) {
                let border = between(0.0, 1.0, permits);
                let part = border * (1.0 + self.sign() * self.hair());
                return self.at(along(part), form, size);
            }
        }
    }

    fn anywhere(&mut self) -> Request {
        let (offset, form) = (self.offset(1.05), self.form());
        let size = self.uniform(0.05, 0.6);
        self.at(offset, form, size)
    }

    /// Makes headings of many turns and at +-180 degrees, and sets of many headings.
    fn wound_up(&mut self, choice: u32) -> Request {
        let (mut offset, form) = (self.inside(), self.form());
        let turns = match choice % 4 {
            0 => 2600.0,
            1 => 1.0,
            2 => self.below(2600) as f64,
            _ => {
                let place = self.place();
                let seam = (PI - place.goal[2] - place.middle[2]).rem_euclid(TAU);
                let seam = if seam > PI { seam - TAU } else { seam };
                if seam.abs() < place.half[2] {
                    offset[2] = seam + self.sign() * self.hair();
                }
                0.0
            }
        };
        let mut request = self.at(offset, form, 0.05);
        request.estimate.yaw_rad += self.sign() * turns * TAU;
        if let Uncertainty::Bounded { yaw_rad, .. } = &mut request.spread
            && choice % 8 == 7
        {
            *yaw_rad = PI * self.uniform(0.9, 40.0);
        }
        request
    }
}

/// Returns the point at which acceptance ends, between an inner and an outer value, by bisection.
fn between(mut inside: f64, mut outside: f64, permits: impl Fn(f64) -> bool) -> f64 {
    for _ in 0..36 {
        let middle = 0.5 * (inside + outside);
        if permits(middle) {
            inside = middle;
        } else {
            outside = middle;
        }
    }
    inside
}

#[path = "vectors_extreme.rs"]
mod extreme;
