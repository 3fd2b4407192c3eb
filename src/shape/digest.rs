//! The digest of what decides on a task: a controller compares it with the one in its table.

use super::camera::Sighted;
use super::{
    BoxSet, Camera, Clear, Edge, ErrorLimit, ErrorModel, Exclusion, Footprint, Lens, Pose3Deg,
    PoseDeg, Round, Shape, Sharpness, SuccessSet, Tag, Tolerance, Visibility, Wall, Window,
};
use sha2::{Digest, Sha256};

impl SuccessSet {
    /// Returns the task digest: SHA-256 of what decides on the task, that is the goal, the set with all its numbers as the site file resolves
    /// them (camera, tag, tolerances, outlines), and the site's confidence `epsilon`. Comments, names, the table's extent and layout, and
    /// other tasks do not change it.
    #[must_use]
    pub fn digest(&self, epsilon: f64) -> [u8; 32] {
        let mut to = Sha256::new_with_prefix(b"posegate task 1\n");
        self.goal.add_to(&mut to);
        self.shape.add_to(&mut to);
        epsilon.add_to(&mut to);
        to.finalize().into()
    }
}

/// A value that decides. Numbers are added as 8 bytes, little-endian; lists with their length before, alternatives with their number before,
/// so that different values have different bytes.
trait Deciding {
    fn add_to(&self, to: &mut Sha256);
}

impl Deciding for f64 {
    fn add_to(&self, to: &mut Sha256) {
        // Zero has two signs, and one meaning.
        to.update((self + 0.0).to_bits().to_le_bytes());
    }
}

impl Deciding for u64 {
    fn add_to(&self, to: &mut Sha256) {
        to.update(self.to_le_bytes());
    }
}

impl<T: Deciding> Deciding for [T] {
    fn add_to(&self, to: &mut Sha256) {
        (self.len() as u64).add_to(to);
        self.iter().for_each(|item| item.add_to(to));
    }
}

impl<T: Deciding, const N: usize> Deciding for [T; N] {
    fn add_to(&self, to: &mut Sha256) {
        self.as_slice().add_to(to);
    }
}

impl<T: Deciding> Deciding for Vec<T> {
    fn add_to(&self, to: &mut Sha256) {
        self.as_slice().add_to(to);
    }
}

impl<T: Deciding> Deciding for std::sync::Arc<[T]> {
    fn add_to(&self, to: &mut Sha256) {
        self.as_ref().add_to(to);
    }
}

impl<T: Deciding> Deciding for Option<T> {
    fn add_to(&self, to: &mut Sha256) {
        self.as_slice().add_to(to);
    }
}

/// Adds all fields of each struct, in this order: a new field does not compile before it is named here.
macro_rules! deciding {
    ($($name:ident { $($field:ident),+ })+) => {$(
        impl Deciding for $name {
            fn add_to(&self, to: &mut Sha256) {
                let Self { $($field),+ } = self;
                $($field.add_to(to);)+
            }
        }
    )+};
}

deciding! {
    PoseDeg { x, y, yaw_deg }
    Pose3Deg { x, y, z, roll_deg, pitch_deg, yaw_deg }
    BoxSet { x, y, yaw_deg }
    Round { centre, axes, turn_deg }
    Clear { footprint, obstacle, gap }
    Camera { width_px, height_px, fx, fy, cx, cy, sighted }
    Sighted { lens, window, edge, numbers }
    Edge { field, border_px }
    Tolerance { translation, turn_deg }
    ErrorModel { translation, yaw_deg }
    ErrorLimit { model, translation, yaw_deg }
    Visibility {
        camera, mount, tag, d_max, phi_max_deg, psi_max_deg, z_near, tag_tolerance, mount_tolerance,
        sharpness, error_room
    }
}

impl Deciding for Footprint {
    fn add_to(&self, to: &mut Sha256) {
        let Self {
            footprint,
            region,
            inset,
            round,
        } = self;
        footprint.add_to(to);
        region.add_to(to);
        inset.add_to(to);
        // A set without an ellipse has the digest that it had before there were any.
        if let Some(round) = round {
            round.add_to(to);
        }
    }
}

impl Deciding for Tag {
    fn add_to(&self, to: &mut Sha256) {
        let Self { id, size, pose } = self;
        u64::from(*id).add_to(to);
        size.add_to(to);
        pose.add_to(to);
    }
}

impl Deciding for Sharpness {
    fn add_to(&self, to: &mut Sha256) {
        let Self { px_per_bit, bits } = self;
        px_per_bit.add_to(to);
        u64::from(*bits).add_to(to);
    }
}

impl Deciding for Lens {
    fn add_to(&self, to: &mut Sha256) {
        let model: u64 = match self {
            Self::Pinhole => 0,
            Self::PlumbBob(_) => 1,
            Self::RationalPolynomial(_) => 2,
            Self::Equidistant(_) => 3,
        };
        model.add_to(to);
        self.coefficients().add_to(to);
    }
}

impl Deciding for Window {
    fn add_to(&self, to: &mut Sha256) {
        self.planes().add_to(to);
    }
}

impl Deciding for Wall {
    fn add_to(&self, to: &mut Sha256) {
        // Its name, and where no tag may be mounted, hide no tag.
        let Self {
            name: _,
            corners,
            z,
            keep_outs: _,
        } = self;
        corners.add_to(to);
        z.add_to(to);
    }
}

impl Deciding for Exclusion {
    fn add_to(&self, to: &mut Sha256) {
        match self {
            Self::Obstacle(clear) => add(0, [clear], to),
            Self::Gap { clear, regions } => add(1, [clear as &dyn Deciding, regions], to),
            Self::Near { view, d_min } => add(2, [view as &dyn Deciding, d_min], to),
            Self::Square { view, psi_min_deg } => add(3, [view as &dyn Deciding, psi_min_deg], to),
            Self::Hidden { view, wall } => add(4, [view as &dyn Deciding, wall], to),
        }
    }
}

impl Deciding for Shape {
    fn add_to(&self, to: &mut Sha256) {
        match self {
            Self::Box(set) => add(0, [set], to),
            Self::Footprint(set) => add(1, [set], to),
            Self::Visibility(view) => add(2, [view], to),
            Self::Bounded { view, limit } => add(3, [view as &dyn Deciding, limit], to),
            Self::Apart(exclusion) => add(4, [exclusion], to),
            Self::Any(sets) => add(5, [sets], to),
            Self::All(sets) => add(6, [sets], to),
        }
    }
}

/// Adds an alternative: its number and its fields.
fn add<const N: usize>(number: u64, fields: [&dyn Deciding; N], to: &mut Sha256) {
    number.add_to(to);
    fields.iter().for_each(|field| field.add_to(to));
}

#[cfg(test)]
mod tests {
    use super::super::visibility::test_view;
    use super::*;

    const GOAL: PoseDeg = PoseDeg {
        x: 1.0,
        y: 2.0,
        yaw_deg: 30.0,
    };

    fn of(shape: Shape) -> SuccessSet {
        SuccessSet { goal: GOAL, shape }
    }

    fn dock() -> SuccessSet {
        of(Shape::Box(BoxSet {
            x: [-0.08, 0.08],
            y: [-0.06, 0.06],
            yaw_deg: [-4.0, 4.0],
        }))
    }

    /// Firmware has the digest of its task: no release may change it without saying so.
    #[test]
    fn digests_stay_the_same_in_every_release() {
        let digits = |digest: [u8; 32]| -> String {
            digest[..8]
                .iter()
                .map(|byte| format!("{byte:02x}"))
                .collect()
        };
        assert_eq!(digits(dock().digest(0.99)), "a39808ec02851b87");
        assert_eq!(
            digits(of(Shape::Visibility(test_view())).digest(0.99)),
            "18118f203b09583e"
        );
    }

    /// Every number that decides changes the digest, and so does the way in which sets are combined.
    #[test]
    fn each_deciding_number_changes_the_digest() {
        let mut digests = std::collections::BTreeSet::new();
        let mut count = 0;
        let mut add = |set: &SuccessSet, epsilon| {
            digests.insert(set.digest(epsilon));
            count += 1;
        };
        let boxed = |change: &dyn Fn(&mut BoxSet)| {
            let mut set = dock();
            if let Shape::Box(set) = &mut set.shape {
                change(set);
            }
            set
        };
        add(&dock(), 0.99);
        add(&dock(), 0.9);
        for axis in 0..2 {
            add(&boxed(&|set| set.x[axis] *= 1.5), 0.99);
            add(&boxed(&|set| set.y[axis] *= 1.5), 0.99);
            add(&boxed(&|set| set.yaw_deg[axis] *= 1.5), 0.99);
        }
        let goals: [&dyn Fn(&mut PoseDeg); 3] =
            [&|goal| goal.x += 1.0, &|goal| goal.y += 1.0, &|goal| {
                goal.yaw_deg += 1.0
            }];
        for change in goals {
            let mut set = dock();
            change(&mut set.goal);
            add(&set, 0.99);
        }
        let changes: [&dyn Fn(&mut Visibility); 16] = [
            &|_| {},
            &|view| view.camera.width_px += 1.0,
            &|view| view.camera.fx += 1.0,
            &|view| view.camera.cy += 1.0,
            &|view| view.mount.z += 1.0,
            &|view| view.mount.pitch_deg += 1.0,
            &|view| view.tag.id += 1,
            &|view| view.tag.size += 1.0,
            &|view| view.tag.pose.yaw_deg += 1.0,
            &|view| view.d_max += 1.0,
            &|view| view.phi_max_deg += 1.0,
            &|view| view.psi_max_deg += 1.0,
            &|view| view.z_near += 1.0,
            &|view| view.tag_tolerance.translation += 1.0,
            &|view| view.mount_tolerance.translation += 1.0,
            &|view| view.error_room = Some([1.0, 1.0]),
        ];
        for change in changes {
            let mut view = test_view();
            change(&mut view);
            add(&of(Shape::Visibility(view)), 0.99);
            let near = Exclusion::Near { view, d_min: 0.5 };
            add(&of(Shape::Apart(near)), 0.99);
        }
        let inner = dock().shape;
        for sets in [vec![], vec![inner.clone()], vec![inner.clone(), inner]] {
            add(&of(Shape::Any(sets.clone())), 0.99);
            add(&of(Shape::All(sets.clone())), 0.99);
            add(&of(Shape::Any(vec![Shape::All(sets)])), 0.99);
        }
        assert_eq!(digests.len(), count);
    }

    #[test]
    fn the_name_of_a_wall_and_the_sign_of_zero_decide_nothing() {
        let hidden = |name: &str, keep_outs| {
            let wall = Wall {
                name: name.into(),
                corners: vec![[0.0, 0.0], [1.0, 0.0]],
                z: [0.0, 2.0],
                keep_outs,
            };
            let view = test_view();
            of(Shape::Apart(Exclusion::Hidden { view, wall })).digest(0.99)
        };
        let one = hidden("north", vec![]);
        assert_eq!(one, hidden("south", vec![[[0.0, 1.0], [0.0, 1.0]]]));
        let mut zero = dock();
        zero.goal.x = 0.0;
        let digest = zero.digest(0.99);
        zero.goal.x = -0.0;
        assert_eq!(zero.digest(0.99), digest);
    }
}
