//! A success set whose tag hangs elsewhere.

use super::{Exclusion, Shape, SuccessSet, Tag, Visibility};

impl SuccessSet {
    /// The tags that it looks at, each once, in the order in which they are met.
    #[must_use]
    pub fn tags(&self) -> Vec<Tag> {
        let mut tags = Vec::new();
        let mut set = self.clone();
        each_view(&mut set.shape, &mut |view| {
            if !tags.contains(&view.tag) {
                tags.push(view.tag);
            }
        });
        tags
    }

    /// The same set where every view of a tag is changed: the tag's place, its size, its tolerance. Walls before the
    /// tag stay. An allowed error of an observation holds for the changed tag too: views from too far are then outside.
    #[must_use]
    pub fn with_views_of(&self, tag: &Tag, change: impl Fn(&mut Visibility)) -> Self {
        let mut set = self.clone();
        each_view(&mut set.shape, &mut |view| {
            if view.tag == *tag {
                change(view);
                view.keep_error_room();
            }
        });
        set
    }
}

fn each_view(shape: &mut Shape, change: &mut dyn FnMut(&mut Visibility)) {
    match shape {
        Shape::Visibility(view)
        | Shape::Bounded { view, .. }
        | Shape::Apart(
            Exclusion::Near { view, .. }
            | Exclusion::Square { view, .. }
            | Exclusion::Hidden { view, .. },
        ) => {
            change(view);
        }
        Shape::Any(sets) | Shape::All(sets) => {
            sets.iter_mut().for_each(|set| each_view(set, change));
        }
        Shape::Box(_)
        | Shape::Footprint(_)
        | Shape::Apart(Exclusion::Obstacle(_) | Exclusion::Gap(_)) => {}
    }
}

impl SuccessSet {
    /// The same set where a wall does not hide a tag: the one that carries it does not, however the tag is off. Other tags it
    /// hides as before.
    #[must_use]
    pub fn without_wall(&self, name: &str, tag: &Tag) -> Self {
        let mut set = self.clone();
        without_wall(&mut set.shape, name, tag);
        set
    }
}

fn without_wall(shape: &mut Shape, name: &str, tag: &Tag) {
    if let Shape::All(sets) = shape {
        let hides = |set: &Shape| matches!(set, Shape::Apart(Exclusion::Hidden { wall, view }) if wall.name == name && view.tag == *tag);
        sets.retain(|set| !hides(set));
    }
    if let Shape::Any(sets) | Shape::All(sets) = shape {
        sets.iter_mut().for_each(|set| without_wall(set, name, tag));
    }
}
