//! What the detections of `posegate learn bounds` were taken with.

use crate::site_input::{Failure, site};
use posegate_files::files::{Files, Input};
use posegate_learn::TakenWith;
use posegate_site::Site;

/// The camera and the tags of the data. A site whose camera, mount or tag differs refuses the model.
#[derive(clap::Args)]
pub struct Arguments {
    /// The camera of the site (--site) with which the detections were taken, at its mount on the robot
    #[arg(long, requires = "site")]
    camera: Option<String>,
    /// The site file that has the camera; the tags are those of the site if all are equal
    #[arg(long, requires = "camera")]
    site: Option<Input>,
    /// Instead of a site: the focal length along a row, pixels
    #[arg(long, conflicts_with = "camera", allow_negative_numbers = true)]
    fx: Option<f64>,
    /// The focal length along a column, pixels
    #[arg(long, requires = "fx", allow_negative_numbers = true)]
    fy: Option<f64>,
    /// The width of the tags, metres: of the border that detectors measure
    #[arg(long, allow_negative_numbers = true)]
    tag_size: Option<f64>,
    /// The family of the tags, as detectors name it
    #[arg(long)]
    family: Option<String>,
}

impl Arguments {
    /// Returns the site and the camera.
    pub fn rig(&self) -> (Option<&Input>, Option<&str>) {
        (self.site.as_ref(), self.camera.as_deref())
    }

    /// Returns what the detections were taken with, or `None` if nothing is stated.
    pub fn described(&self, files: &Files) -> Result<Option<TakenWith>, Failure> {
        let mut taken = match (&self.camera, &self.site) {
            (Some(name), Some(input)) => {
                of_site(&site(files, input)?, name, &input.display().to_string())?
            }
            _ => TakenWith::default(),
        };
        taken.fx = self.fx.or(taken.fx);
        taken.fy = self.fy.or(taken.fy);
        taken.tag_size = self.tag_size.or(taken.tag_size);
        taken.family = self.family.clone().or(taken.family);
        if self.camera.is_some() && (taken.tag_size.is_none() || taken.family.is_none()) {
            return Err(Failure::usage(
                "the site's tags differ".to_owned(),
                "state those of the data: --tag-size METRES --family NAME",
            ));
        }
        Ok((taken != TakenWith::default()).then_some(taken))
    }
}

/// Returns a site's camera, and its tags if all are equal.
fn of_site(site: &Site, name: &str, file: &str) -> Result<TakenWith, Failure> {
    let camera = site.cameras.get(name).ok_or_else(|| {
        let known: Vec<&str> = site.cameras.keys().map(String::as_str).collect();
        Failure::usage(
            format!("{file}: there is no camera `{name}`"),
            &format!("its cameras are {}", known.join(", ")),
        )
    })?;
    let mut tags = site.tags.values();
    let first = tags.next();
    let family = first.filter(|first| {
        let mut others = tags.clone();
        others.all(|tag| tag.family == first.family)
    });
    let size = first.filter(|first| tags.all(|tag| (tag.tag.size - first.tag.size).abs() < 1e-9));
    Ok(TakenWith {
        camera: Some(name.to_owned()),
        tag_size: size.map(|tag| tag.tag.size),
        family: family.map(|tag| tag.family.clone()),
        ..camera.taken_with()
    })
}
