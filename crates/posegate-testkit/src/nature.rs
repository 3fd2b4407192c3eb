//! The true places of tag and camera, the detector's observation of them, and the pose that a robot computes from the
//! places in the site file. Uses matrices, and no code of the crate.

/// Pseudo-random numbers (splitmix64).
pub struct Random(pub u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    /// Returns a number from `low` to below `high`.
    pub fn within(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns one of a list.
    ///
    /// # Panics
    /// If the list is empty.
    pub fn one_of<T: Copy>(&mut self, all: &[T]) -> T {
        all[(self.bits() % all.len() as u64) as usize]
    }

    fn direction(&mut self) -> Vector {
        loop {
            let v = [(); 3].map(|()| self.within(-1.0, 1.0));
            let length = norm(v);
            if length > 0.1 && length < 1.0 {
                return v.map(|c| c / length);
            }
        }
    }
}

/// A vector in space, metres; or angles about x, y and z.
pub type Vector = [f64; 3];

/// Returns the length of a vector.
pub fn norm(v: Vector) -> f64 {
    (v[0] * v[0] + v[1] * v[1] + v[2] * v[2]).sqrt()
}

fn cross(a: Vector, b: Vector) -> Vector {
    [
        a[1] * b[2] - a[2] * b[1],
        a[2] * b[0] - a[0] * b[2],
        a[0] * b[1] - a[1] * b[0],
    ]
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// A rigid motion: the rows of the rotation, and the translation.
#[derive(Clone, Copy)]
pub struct Rigid {
    /// Rows of the rotation.
    pub turn: [Vector; 3],
    /// Metres.
    pub way: Vector,
}

impl Rigid {
    /// Returns the motion with rotation `Rz(yaw) Ry(pitch) Rx(roll)`, degrees, and a translation.
    pub fn of([x, y, z]: Vector, [roll, pitch, yaw]: Vector) -> Self {
        let about = |axis: Vector, angle: f64| Self::about(axis, angle.to_radians());
        let turn = about([0.0, 0.0, 1.0], yaw)
            .then(&about([0.0, 1.0, 0.0], pitch))
            .then(&about([1.0, 0.0, 0.0], roll));
        Self {
            way: [x, y, z],
            ..turn
        }
    }

    /// Returns a rotation about a unit axis, radians (Rodrigues).
    fn about(k: Vector, angle: f64) -> Self {
        let (sin, cos) = angle.sin_cos();
        let column = |e: Vector| {
            let across = cross(k, e);
            let along = dot(k, e) * (1.0 - cos);
            [0, 1, 2].map(|i| e[i] * cos + across[i] * sin + k[i] * along)
        };
        let columns = [
            column([1.0, 0.0, 0.0]),
            column([0.0, 1.0, 0.0]),
            column([0.0, 0.0, 1.0]),
        ];
        Self {
            turn: [0, 1, 2].map(|row| [0, 1, 2].map(|i: usize| columns[i][row])),
            way: [0.0; 3],
        }
    }

    fn apply(&self, v: Vector) -> Vector {
        [0, 1, 2].map(|i| dot(self.turn[i], v) + self.way[i])
    }

    /// Returns `self * other`.
    pub fn then(&self, other: &Self) -> Self {
        Self {
            turn: self.turn.map(|row| {
                [0, 1, 2].map(|c: usize| (0..3).map(|k| row[k] * other.turn[k][c]).sum())
            }),
            way: self.apply(other.way),
        }
    }

    /// Returns the motion that undoes this one.
    pub fn inverse(&self) -> Self {
        let turn = [0, 1, 2].map(|r: usize| [0, 1, 2].map(|c: usize| self.turn[c][r]));
        let back = Self {
            turn,
            way: [0.0; 3],
        };
        Self {
            turn,
            way: back.apply(self.way).map(|c| -c),
        }
    }

    fn axis(&self, column: usize) -> Vector {
        self.turn.map(|row| row[column])
    }

    fn yaw(&self) -> f64 {
        self.turn[1][0].atan2(self.turn[0][0])
    }
}

/// A tag, a camera on the robot, and their tolerances.
#[derive(Clone, Copy, Debug)]
pub struct World {
    /// Place of the tag in the world: metres; roll, pitch, yaw in degrees.
    pub tag: [Vector; 2],
    /// Place of the camera on the robot: metres; roll, pitch, yaw in degrees.
    pub mount: [Vector; 2],
    /// Metres, degrees about the vertical.
    pub tag_off: [f64; 2],
    /// Metres, degrees about any axis.
    pub mount_off: [f64; 2],
}

/// The displacements, and the detector's error: its direction on the floor and the sign of its yaw error.
#[derive(Clone, Copy)]
struct Off {
    tag: Vector,
    turn: f64,
    mount: Vector,
    axis: Vector,
    lean: f64,
    detector: [f64; 2],
    yaw: f64,
    /// The lean of the detector's pose of the robot as a share of [`LEAN_DEG`], and the direction of its axis.
    leans: f64,
    leans_about: f64,
}

/// Largest lean of the detector's pose of the robot, degrees, as stated in `crates/posegate-site/src/language.md`.
const LEAN_DEG: f64 = 20.0;

/// Returns distance, angle to the optical axis and angle to the tag's normal: m, rad.
fn view(camera: &Rigid, tag: &Rigid) -> [f64; 3] {
    let ray = [0, 1, 2].map(|i| tag.way[i] - camera.way[i]);
    let angle = |a: Vector, b: Vector| norm(cross(a, b)).atan2(dot(a, b));
    [
        norm(ray),
        angle(camera.axis(0), ray),
        angle(tag.axis(0), ray.map(|c| -c)),
    ]
}

impl World {
    /// Returns the largest errors of the robot's computed pose in all trials, metres and radians. `detector` bounds the
    /// detector's errors for the true view. It returns `None` for views that must not be used.
    ///
    /// # Errors
    /// If the success set lets in a view that must not be used.
    pub fn worst(
        &self,
        pose: Vector,
        detector: &dyn Fn([f64; 3]) -> Option<(f64, f64)>,
        random: &mut Random,
        tries: u32,
    ) -> Result<[f64; 2], String> {
        let mut worst = [0.0f64; 2];
        let mut note = |found: [f64; 2]| worst = [0, 1].map(|i| worst[i].max(found[i]));
        // All displacements towards one direction.
        for k in 0..24 {
            let angle = f64::from(k) * core::f64::consts::TAU / 24.0;
            for turn in [1.0, -1.0] {
                for (yaw, leans) in [
                    (1.0, 1.0),
                    (-1.0, 1.0),
                    (1.0, -1.0),
                    (-1.0, -1.0),
                    (1.0, 0.0),
                ] {
                    let off = Off {
                        leans,
                        ..self.toward(pose, angle, [turn, yaw])
                    };
                    note(self.error(pose, &off, detector)?);
                    // The camera's rotation moves the position most about another axis than the yaw.
                    let upright = Off {
                        axis: [0.0, 0.0, yaw],
                        ..off
                    };
                    note(self.error(pose, &upright, detector)?);
                }
            }
        }
        for _ in 0..tries {
            let sign = |random: &mut Random| random.one_of(&[1.0, -1.0]);
            let share = |random: &mut Random| random.one_of(&[1.0, 1.0, 0.5, 0.0]);
            let angle = random.within(0.0, core::f64::consts::TAU);
            let size = share(random);
            let off = Off {
                tag: random.direction().map(|c| c * size),
                turn: sign(random) * share(random),
                mount: random.direction(),
                axis: random.direction(),
                lean: share(random),
                detector: [angle.cos(), angle.sin()],
                yaw: sign(random),
                leans: sign(random) * share(random),
                leans_about: random.within(0.0, core::f64::consts::TAU),
            };
            note(self.error(pose, &off, detector)?);
        }
        Ok(worst)
    }

    /// Returns the combination of errors that add up towards a direction of the floor.
    fn toward(&self, [x, y, heading]: Vector, angle: f64, [turn, yaw]: [f64; 2]) -> Off {
        let (sin, cos) = angle.sin_cos();
        let away = [x - self.tag[0][0], y - self.tag[0][1]];
        // The inverse of the tag's rotation moves the robot by a chord, at a right angle to the radius.
        let across = [turn * away[1], -turn * away[0]];
        let lever = away[0].hypot(away[1]).max(1e-9);
        let chord = across.map(|c| c / lever);
        // A direction between the wanted one and that of the chord, weighted by the rotation.
        let rotation_m = self.tag_off[1].to_radians() * lever;
        let to = [
            cos + 10.0 * rotation_m * chord[0],
            sin + 10.0 * rotation_m * chord[1],
        ];
        let length = to[0].hypot(to[1]).max(1e-9);
        let to = to.map(|c| c / length);
        // In the robot's frame.
        let own = [
            heading.cos() * to[0] + heading.sin() * to[1],
            heading.cos() * to[1] - heading.sin() * to[0],
            0.0,
        ];
        let axis = cross(self.mount[0], own.map(|c| -c));
        let length = norm(axis);
        Off {
            tag: [-to[0], -to[1], 0.0],
            turn,
            mount: own,
            axis: if length > 1e-9 {
                axis.map(|c| c / length)
            } else {
                [0.0, 0.0, 1.0]
            },
            lean: 1.0,
            detector: to,
            yaw,
            leans: 0.0,
            leans_about: angle,
        }
    }

    fn error(
        &self,
        [x, y, heading]: Vector,
        off: &Off,
        detector: &dyn Fn([f64; 3]) -> Option<(f64, f64)>,
    ) -> Result<[f64; 2], String> {
        let robot = Rigid::of([x, y, 0.0], [0.0, 0.0, heading.to_degrees()]);
        let surveyed = Rigid::of(self.tag[0], self.tag[1]);
        let calibrated = Rigid::of(self.mount[0], self.mount[1]);
        // The true places.
        let turned = |axis: Vector, deg: f64, of: &Rigid, by: Vector| Rigid {
            turn: Rigid::about(axis, deg.to_radians()).then(of).turn,
            way: [0, 1, 2].map(|i| of.way[i] + by[i]),
        };
        let tag = turned(
            [0.0, 0.0, 1.0],
            off.turn * self.tag_off[1],
            &surveyed,
            off.tag.map(|c| c * self.tag_off[0]),
        );
        let mount = turned(
            off.axis,
            off.lean * self.mount_off[1],
            &calibrated,
            off.mount.map(|c| c * self.mount_off[0]),
        );
        let at = view(&robot.then(&mount), &tag);
        let (metres, radians) = detector(at)
            .ok_or_else(|| format!("the error model has no bound for the view {at:?}"))?;
        // The detector's pose if tag and camera were known exactly. Its error on the floor is at its bounds, and it leans,
        // which the bounds do not limit. The bounds were measured with a camera that is not rotated; a rotated camera
        // turns the error in height.
        let lean = (off.leans * LEAN_DEG).to_radians();
        let height = norm([x - self.tag[0][0], y - self.tag[0][1], self.tag[0][2]]);
        let upright = Rigid::about([0.0, 0.0, 1.0], heading);
        let tipped = upright
            .then(&Rigid::about(
                off.axis,
                (off.lean * self.mount_off[1]).to_radians(),
            ))
            .then(&upright.inverse());
        let away = tipped.apply([
            metres * off.detector[0],
            metres * off.detector[1],
            lean.sin() * height,
        ]);
        let (sin, cos) = off.leans_about.sin_cos();
        let detected = Rigid::of(
            [x + away[0], y + away[1], away[2]],
            [
                off.leans * LEAN_DEG * sin,
                off.leans * LEAN_DEG * cos,
                (heading + radians * off.yaw).to_degrees(),
            ],
        );
        let measured = detected.then(&mount).inverse().then(&tag);
        // The pose that the robot computes.
        let computed = surveyed.then(&calibrated.then(&measured).inverse());
        let way = computed.yaw() - heading;
        Ok([
            (computed.way[0] - x).hypot(computed.way[1] - y),
            way.sin().atan2(way.cos()).abs(),
        ])
    }
}
