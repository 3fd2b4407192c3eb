//! One of several small panels: a success set, and pose-sets about the goal, at one heading.

use super::Result;
use posegate_show::draw::Subject;
use posegate_show::draw::palette;
use posegate_show::draw::scene::{Inside, Panel, Picture, signed};
use posegate_show::draw::study::{Answer, CaseStudy, PoseSetSpec};

/// The data that all panels of a row share.
pub struct Row<'a> {
    /// The study.
    pub study: &'a CaseStudy,
    /// The task whose success set is drawn.
    pub task: &'a str,
    /// The pose-sets, drawn where their yaw interval includes the heading.
    pub answers: &'a [Answer],
    /// Distance between ticks, metres.
    pub tick: f64,
}

impl Row<'_> {
    /// Draws the panel of a heading, titled with a name, the heading and a note; `more` adds to its content.
    pub fn draw(
        &self,
        picture: &mut Picture,
        panel: &Panel,
        name: &str,
        yaw_deg: f64,
        note: &str,
        more: impl FnOnce(&mut Inside<'_>),
    ) -> Result<()> {
        let subject = Subject::new(&self.study.site, self.task)?;
        // A finer border than a pixel is not visible.
        let border = subject.section(yaw_deg, &panel.window, 1.0 / panel.scale);
        let title = format!("{name}yaw {}°{note}", signed(yaw_deg));
        panel.draw(picture, &title, self.tick, |inside| {
            inside.success_set(&border);
            self.pose_sets(inside, yaw_deg);
            more(inside);
        });
        Ok(())
    }

    fn pose_sets(&self, inside: &mut Inside<'_>, yaw_deg: f64) {
        for answer in self.answers {
            if let PoseSetSpec::Bounded {
                translation,
                yaw_deg: bound,
            } = answer.known
                && yaw_deg.abs() <= bound
            {
                inside.disc([0.0, 0.0], translation, &palette::PAPER_SET);
            }
        }
    }
}
