//! The estimates that tests replay: generated from a seed, the same text on every machine. Only
//! operations that IEEE 754 defines to the last bit are used (no sine, no logarithm).

use std::fmt::Write;

/// An estimate with its times, as a row of a CSV file.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Row {
    /// Time at which the estimate was made, s.
    pub t_s: f64,
    /// Time at which the estimate is used, s.
    pub now_s: f64,
    /// x, y in m, yaw in rad.
    pub pose: [f64; 3],
    /// Covariance by rows: m^2, m rad, rad^2.
    pub covariance: [[f64; 3]; 3],
}

const HEADER: &str = "t_s,now_s,x_m,y_m,yaw_rad,cov_xx,cov_xy,cov_xyaw,cov_yy,cov_yyaw,cov_yawyaw,cov_yx,cov_yawx,cov_yawy";
/// One degree in rad.
const DEGREE: f64 = core::f64::consts::PI / 180.0;
/// Square root of the chi-square quantile of 0.99 with 3 degrees of freedom: the radius of a set.
const RADIUS: f64 = 3.368_214_2;
/// The dock's half widths: m, m, rad.
const DOCK: [f64; 3] = [0.08, 0.06, 4.0 * DEGREE];
/// The time at which a millisecond clock of 32 bits wraps.
const WRAP_S: f64 = 4_294_967.296;

/// Returns the rows as text. Entries of the covariance's lower half are left empty if they equal those of the upper
/// half.
pub fn text() -> String {
    let mut text = format!("{HEADER}\n");
    for row in rows() {
        let [[xx, xy, xt], [yx, yy, yt], [tx, ty, tt]] = row.covariance;
        let [x, y, yaw] = row.pose;
        let upper = [row.t_s, row.now_s, x, y, yaw, xx, xy, xt, yy, yt, tt];
        for value in upper {
            write!(text, "{value:?},").expect("a string takes text");
        }
        let lower = [(yx, xy), (tx, xt), (ty, yt)]
            .map(|(lower, upper)| (lower.to_bits() != upper.to_bits()).then_some(lower));
        let lower = lower.map(|value| value.map_or(String::new(), |value| format!("{value:?}")));
        writeln!(text, "{}", lower.join(",")).expect("a string takes text");
    }
    text
}

/// Reads rows from a CSV file: columns by name in any order. Without `now_s` the time of use is that of the stamp.
///
/// # Panics
/// If a column is missing or a field is not a number.
pub fn parse(text: &str) -> Vec<Row> {
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().expect("a header").split(',').collect();
    lines
        .map(|line| {
            let fields: Vec<&str> = line.split(',').collect();
            let optional = |name: &str| -> Option<f64> {
                let at = names.iter().position(|n| *n == name)?;
                let field = fields.get(at).filter(|field| !field.is_empty())?;
                Some(
                    field
                        .parse()
                        .unwrap_or_else(|_| panic!("`{field}` is no number")),
                )
            };
            let value = |name: &str| optional(name).unwrap_or_else(|| panic!("no {name}: {line}"));
            let (xy, xt, yt) = (value("cov_xy"), value("cov_xyaw"), value("cov_yyaw"));
            Row {
                t_s: value("t_s"),
                now_s: optional("now_s").unwrap_or_else(|| value("t_s")),
                pose: [value("x_m"), value("y_m"), value("yaw_rad")],
                covariance: [
                    [value("cov_xx"), xy, xt],
                    [optional("cov_yx").unwrap_or(xy), value("cov_yy"), yt],
                    [
                        optional("cov_yawx").unwrap_or(xt),
                        optional("cov_yawy").unwrap_or(yt),
                        value("cov_yawyaw"),
                    ],
                ],
            }
        })
        .collect()
}

fn rows() -> Vec<Row> {
    let mut rows = Rows {
        random: 0x9e37_79b9_7f4a_7c15,
        rows: Vec::new(),
    };
    rows.near_the_dock();
    rows.in_view_of_the_tag();
    rows.on_the_borders();
    rows.far_and_wide();
    rows.impossible();
    rows.extreme();
    rows.at_all_ages();
    rows.rows
}

/// Returns a covariance from standard deviations and correlations xy, x-yaw, y-yaw.
fn covariance([x, y, yaw]: [f64; 3], [xy, x_yaw, y_yaw]: [f64; 3]) -> [[f64; 3]; 3] {
    let (xy, x_yaw, y_yaw) = (xy * x * y, x_yaw * x * yaw, y_yaw * y * yaw);
    [
        [x * x, xy, x_yaw],
        [xy, y * y, y_yaw],
        [x_yaw, y_yaw, yaw * yaw],
    ]
}

const SMALL: [f64; 3] = [0.004, 0.003, 0.2 * DEGREE];

struct Rows {
    random: u64,
    rows: Vec<Row>,
}

impl Rows {
    /// Returns a number uniform in `[low, high)` (splitmix64, Steele, Lea and Flood 2014).
    fn uniform(&mut self, low: f64, high: f64) -> f64 {
        self.random = self.random.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.random;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^= z >> 31;
        low + (high - low) * ((z >> 11) as f64 / (1u64 << 53) as f64)
    }

    fn within(&mut self, half: [f64; 3]) -> [f64; 3] {
        half.map(|half| self.uniform(-half, half))
    }

    /// Returns deviations between a hundredth of `largest` and `largest`, with many small values.
    fn deviations(&mut self, largest: [f64; 3]) -> [f64; 3] {
        largest.map(|largest| {
            let share = self.uniform(0.1, 1.0);
            largest * share * share
        })
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

    /// Adds a fresh row, 10 ms old.
    fn fresh(&mut self, pose: [f64; 3], covariance: [[f64; 3]; 3]) {
        let t_s = self.rows.len() as f64 / 4.0;
        self.aged(t_s, t_s + 0.01, pose, covariance);
    }

    fn aged(&mut self, t_s: f64, now_s: f64, pose: [f64; 3], covariance: [[f64; 3]; 3]) {
        self.rows.push(Row {
            t_s,
            now_s,
            pose,
            covariance,
        });
    }

    /// Adds sets in and near the dock's success set, from much smaller to somewhat larger than it.
    fn near_the_dock(&mut self) {
        for k in 0..120 {
            let share = f64::from(k % 4 + 1) / 4.0;
            let pose = self.within(DOCK.map(|half| half * share));
            let deviations = self.deviations(DOCK.map(|half| 0.4 * half));
            let correlations = self.correlations();
            self.fresh(pose, covariance(deviations, correlations));
        }
    }

    /// Adds sets at poses that see the tag and at poses that do not.
    fn in_view_of_the_tag(&mut self) {
        for k in 0..120 {
            let share = f64::from(k % 3 + 1) / 3.0;
            let pose = self.within([1.8 * share, 1.8 * share, 18.0 * DEGREE * share]);
            let deviations = self.deviations([0.25, 0.25, 3.0 * DEGREE]);
            let correlations = self.correlations();
            self.fresh(pose, covariance(deviations, correlations));
        }
    }

    /// Adds sets that end slightly inside and slightly outside of the dock's borders.
    fn on_the_borders(&mut self) {
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                for hair in [0.0, 1e-7, 1e-6, 1e-5, 1e-4, 1e-3] {
                    for direction in [-1.0, 1.0] {
                        let mut pose = [0.0; 3];
                        let reach = RADIUS * SMALL[axis] + direction * hair;
                        pose[axis] = side * (DOCK[axis] - reach);
                        self.fresh(pose, covariance(SMALL, [0.3, 0.2, 0.4]));
                    }
                }
            }
        }
    }

    /// Adds estimates off the tables, and sets that are too large for the tables.
    fn far_and_wide(&mut self) {
        for x in [2.1, -2.1, 30.0, 250.0, 300.0, -1999.0] {
            self.fresh([x, 0.0, 0.0], covariance(SMALL, [0.0; 3]));
            self.fresh([0.0, x, 0.0], covariance(SMALL, [0.0; 3]));
        }
        for yaw_deg in [21.0, -21.0, 90.0, 180.0, -180.0, 359.0, 361.0] {
            self.fresh([0.0, 0.0, yaw_deg * DEGREE], covariance(SMALL, [0.0; 3]));
        }
        for wide in [
            [0.7, 0.01, 0.01],
            [0.01, 0.7, 0.01],
            [0.01, 0.01, 0.2],
            [5.0, 5.0, 5.0],
            [50.0, 50.0, 20.0],
        ] {
            self.fresh([0.0; 3], covariance(wide, [0.0; 3]));
        }
    }

    /// Adds invalid estimates and covariances.
    fn impossible(&mut self) {
        let good = covariance(SMALL, [0.3, 0.2, 0.4]);
        let never = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for axis in 0..3 {
            for value in never {
                let mut pose = [0.0; 3];
                pose[axis] = value;
                self.fresh(pose, good);
            }
        }
        for pose in [
            [2000.1, 0.0, 0.0],
            [0.0, -1e300, 0.0],
            [0.0, 0.0, 16_384.0],
            [0.0, 0.0, -1e12],
            [f64::MAX, f64::MIN, 0.0],
        ] {
            self.fresh(pose, good);
        }
        for row in 0..3 {
            for column in row..3 {
                for value in never {
                    let mut bad = good;
                    bad[row][column] = value;
                    bad[column][row] = value;
                    self.fresh([0.0; 3], bad);
                }
            }
        }
        self.fresh([0.0; 3], [[0.0; 3]; 3]);
        self.fresh([0.0; 3], [[-0.0; 3]; 3]);
        self.fresh([0.05, -0.02, 0.01], [[0.0; 3]; 3]);
        for (row, column) in [(1, 0), (2, 0), (2, 1)] {
            for factor in [0.0, 1.1, -1.0, 1e300] {
                let mut bad = good;
                bad[row][column] *= factor;
                self.fresh([0.0; 3], bad);
            }
            // Asymmetric by a filter's rounding: still accepted.
            let mut rounded = good;
            rounded[row][column] *= 1.0 + 4.0 * f64::EPSILON;
            self.fresh([0.0; 3], rounded);
        }
        for axis in 0..3 {
            for value in [0.0, -1e-6, -good[axis][axis]] {
                let mut bad = good;
                bad[axis][axis] = value;
                self.fresh([0.0; 3], bad);
            }
        }
        for correlations in [
            [1.0, 0.0, 0.0],
            [0.0, -1.0, 0.0],
            [0.0, 0.0, 1.5],
            [0.9, 0.9, -0.9],
            [0.0, 0.0, 1e6],
        ] {
            self.fresh([0.0; 3], covariance(SMALL, correlations));
        }
        for huge in [
            [100.0, 0.01, 0.01],
            [0.01, 1e5, 0.01],
            [0.01, 0.01, 100.0],
            [1e150; 3],
        ] {
            self.fresh([0.0; 3], covariance(huge, [0.0; 3]));
        }
    }

    /// Adds valid estimates with extreme numbers.
    fn extreme(&mut self) {
        let tiny = f64::from_bits(1);
        let good = covariance(SMALL, [0.3, 0.2, 0.4]);
        for pose in [
            [tiny, -tiny, tiny],
            [-0.0; 3],
            [f64::MIN_POSITIVE, 0.0, -f64::EPSILON],
        ] {
            self.fresh(pose, good);
        }
        for deviation in [1e-3, 1e-6, 1e-9, 1e-20, 1e-100, 1e-154] {
            self.fresh([0.0; 3], covariance([deviation; 3], [0.3, 0.2, 0.4]));
            self.fresh(
                [0.0; 3],
                covariance([0.01, deviation, 0.001], [0.3, 0.2, 0.4]),
            );
            self.fresh(
                [0.0; 3],
                covariance([deviation, 0.01, deviation], [-0.5, 0.2, 0.0]),
            );
        }
        // Variances below the smallest normal number.
        self.fresh(
            [0.0; 3],
            [[tiny, 0.0, 0.0], [0.0, tiny, 0.0], [0.0, 0.0, tiny]],
        );
        self.fresh(
            [0.0; 3],
            [[1e-4, 0.0, 0.0], [0.0, tiny, 0.0], [0.0, 0.0, 1e-4]],
        );
        for near_one in [0.9, 0.999, 0.999_999, 0.999_999_999, 0.999_999_999_999] {
            for sign in [-1.0, 1.0] {
                let c = sign * near_one;
                self.fresh([0.0; 3], covariance(SMALL, [c, 0.0, 0.0]));
                self.fresh([0.0; 3], covariance(SMALL, [0.0, c, 0.0]));
                self.fresh([0.0; 3], covariance(SMALL, [0.0, 0.0, c]));
                self.fresh(
                    [0.01, 0.0, 0.0],
                    covariance([0.2, 0.1, 0.01], [c, 0.0, 0.0]),
                );
            }
        }
        let whole_turns = 2607.0;
        for yaw in [
            core::f64::consts::TAU,
            -core::f64::consts::TAU,
            core::f64::consts::TAU * whole_turns,
            -core::f64::consts::TAU * whole_turns,
            core::f64::consts::TAU * 100.0 + 3.9 * DEGREE,
            16_383.0,
            -16_383.0,
            16_383.999_999,
        ] {
            self.fresh([0.0, 0.0, yaw], good);
            self.fresh([0.01, -0.01, yaw], covariance([0.001; 3], [0.0; 3]));
        }
        self.fresh([2000.0, -2000.0, 0.0], good);
    }

    /// Adds estimates that are fresh, just too old, from the future, and across the wrap of the clock.
    fn at_all_ages(&mut self) {
        let good = covariance(SMALL, [0.3, 0.2, 0.4]);
        for start in [100.0, WRAP_S - 0.1, WRAP_S, WRAP_S / 2.0 - 0.05] {
            for age_s in [
                0.0,
                0.125,
                0.1875,
                0.203_125,
                0.25,
                60.0,
                WRAP_S / 2.0,
                -0.125,
                -0.0625,
                -3600.0,
            ] {
                if start + age_s >= 0.0 {
                    self.aged(start, start + age_s, [0.0; 3], good);
                }
            }
        }
        // Staleness is reported before any error of the numbers.
        self.aged(50.0, 51.0, [f64::NAN, 0.0, 0.0], [[0.0; 3]; 3]);
    }
}
