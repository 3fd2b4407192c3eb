//! Success sets with a tag moved, changed or hidden differently.

use super::{Exclusion, Shape, SuccessSet, Tag, Visibility};

impl SuccessSet {
    /// Returns the tags that the set uses, each once, in order of occurrence.
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

    /// Returns the set's views of a tag, in order of occurrence; those of exclusions included.
    #[must_use]
    pub fn views_of(&self, tag: &Tag) -> Vec<Visibility> {
        let mut views = Vec::new();
        let mut set = self.clone();
        each_view(&mut set.shape, &mut |view| {
            if view.tag == *tag {
                views.push(*view);
            }
        });
        views
    }

    /// Returns the set with every view of a tag changed: the tag's pose, its size, its tolerance. Walls in front of the
    /// tag stay. An allowed error of an observation also applies to the changed tag: views from too far are then
    /// outside.
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
        | Shape::Apart(Exclusion::Obstacle(_) | Exclusion::Gap { .. }) => {}
    }
}

impl SuccessSet {
    /// Returns the set in which a wall does not hide a tag, because the tag is mounted on that wall, for any
    /// tolerance of the tag. The wall still hides other tags.
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
