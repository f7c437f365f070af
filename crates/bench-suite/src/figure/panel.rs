//! A plot with two axes: frame, grid, ticks, labels, and lines inside; and legends.

use super::axis::Axis;
use super::colour::{INK, PAPER};
use super::line::Line;
use super::picture::{Align, Font, Picture};

/// Length of a legend's sample line, in points.
const SAMPLE: f64 = 34.0;
/// Average width of a letter of a label, in points.
const LETTER: f64 = 6.6;
/// Distance of two rows of a legend.
const ROW: f64 = 20.0;
/// Room between the text of a tick and that of the last or of the next.
const TEXT_ROOM: f64 = 26.0;
const NEXT_TEXT: f64 = 18.0;

/// A plot's place on the page and its axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Panel {
    /// Left, top, width and height of the frame, in points.
    pub place: (f64, f64, f64, f64),
    /// Room between the frame and the left and right ends of the horizontal axis.
    pub inset: (f64, f64),
    /// Horizontal axis.
    pub horizontal: Axis,
    /// Vertical axis.
    pub vertical: Axis,
}

impl Panel {
    /// A plot whose horizontal axis ends at its frame.
    pub fn new(place: (f64, f64, f64, f64), horizontal: Axis, vertical: Axis) -> Self {
        Self {
            place,
            inset: (0.0, 0.0),
            horizontal,
            vertical,
        }
    }

    /// Draws background, grid and frame with ticks and the axes' labels.
    pub fn frame(&self, picture: &mut Picture) {
        let (x, y, width, height) = self.place;
        picture.rectangle(self.place, PAPER, None);
        let texts = self.horizontal.ticks().filter(|(_, text)| !text.is_empty());
        let last = texts
            .last()
            .map_or(0.0, |tick| self.across_fraction(tick.0));
        let mut free = f64::NEG_INFINITY;
        for (fraction, text) in self.horizontal.ticks() {
            let at = self.across_fraction(fraction);
            picture.line((at, y), (at, y + height));
            // Of texts that would touch the one before or the last, the ticks alone are drawn.
            let is_last = at >= last - 1e-9;
            let has_room = at >= free && last - at >= TEXT_ROOM;
            if !text.is_empty() && (is_last || has_room) {
                picture.text(at, y + height + 16.0, text, Font::Remark, Align::Centre);
                free = at + NEXT_TEXT;
            }
        }
        for (fraction, text) in self.vertical.ticks() {
            let at = y + height * (1.0 - fraction);
            picture.line((x, at), (x + width, at));
            picture.text(x - 7.0, at + 4.0, text, Font::Remark, Align::Right);
        }
        picture.rectangle(self.place, "none", Some(INK));
        let (middle, label) = (x + width / 2.0, &self.horizontal.label);
        picture.text(middle, y + height + 36.0, label, Font::Label, Align::Centre);
        let lengths = self.vertical.ticks().map(|(_, text)| text.chars().count());
        let room = 7.0 + LETTER * lengths.max().unwrap_or(0) as f64 + 14.0;
        let (left, label) = (x - room, &self.vertical.label);
        picture.vertical_text(left, y + height / 2.0, label, Font::Label);
        picture.text(x, y - 8.0, &self.vertical.unit, Font::Remark, Align::Left);
    }

    /// Draws a name above the middle of the frame.
    pub fn heading(&self, picture: &mut Picture, name: &str) {
        let (x, y, width, _) = self.place;
        picture.text(x + width / 2.0, y - 8.0, name, Font::Heading, Align::Centre);
    }

    /// Draws a line through points of the data.
    pub fn curve(
        &self,
        picture: &mut Picture,
        line: &Line,
        points: impl IntoIterator<Item = (f64, f64)>,
    ) {
        let points: Vec<(f64, f64)> = points
            .into_iter()
            .map(|point| self.on_page(point))
            .collect();
        line.draw(picture, &points);
    }

    /// Where a point of the data lies on the page.
    pub fn on_page(&self, (a, b): (f64, f64)) -> (f64, f64) {
        let (_, y, _, height) = self.place;
        (
            self.across(a),
            y + height * (1.0 - self.vertical.fraction(b)),
        )
    }

    /// Where a number of the horizontal axis lies on the page.
    pub fn across(&self, number: f64) -> f64 {
        self.across_fraction(self.horizontal.fraction(number))
    }

    /// Horizontal place of a fraction of the axis.
    fn across_fraction(&self, fraction: f64) -> f64 {
        let (x, _, width, _) = self.place;
        let (left, right) = self.inset;
        x + left + (width - left - right) * fraction
    }
}

/// Sample lines with their names in a row that starts at (x, y): outside every frame, so that no data is covered.
pub fn legend_row<'a>(
    picture: &mut Picture,
    (x, y): (f64, f64),
    entries: impl IntoIterator<Item = (Line, &'a str)>,
) {
    let mut left = x;
    for (line, name) in entries {
        sample(picture, (left, y), &line, name);
        left += SAMPLE + 8.0 + LETTER * name.chars().count() as f64 + 26.0;
    }
}

/// The same below each other.
pub fn legend_column<'a>(
    picture: &mut Picture,
    (x, y): (f64, f64),
    entries: impl IntoIterator<Item = (Line, &'a str)>,
) {
    for (row, (line, name)) in entries.into_iter().enumerate() {
        sample(picture, (x, y + ROW * row as f64), &line, name);
    }
}

fn sample(picture: &mut Picture, (x, y): (f64, f64), line: &Line, name: &str) {
    line.draw(picture, &[(x, y), (x + SAMPLE, y)]);
    picture.text(x + SAMPLE + 8.0, y + 4.0, name, Font::Label, Align::Left);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn corners_of_the_data_are_corners_of_the_frame_but_for_the_inset() {
        let axis = |ends| Axis::linear("a", ends, 0.5);
        let place = (10.0, 20.0, 100.0, 50.0);
        let mut panel = Panel::new(place, axis((0.0, 2.0)), axis((-1.0, 1.0)));
        assert_eq!(panel.on_page((0.0, -1.0)), (10.0, 70.0));
        assert_eq!(panel.on_page((2.0, 1.0)), (110.0, 20.0));
        panel.inset = (12.0, 20.0);
        assert_eq!(panel.on_page((0.0, 1.0)), (22.0, 20.0));
        assert_eq!(panel.on_page((2.0, 1.0)), (90.0, 20.0));
    }
}
