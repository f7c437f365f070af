//! Figures 10 and 11: average and median nMSE over the contexts against n, a column a joint.

use super::axes::{Axis, Place};
use super::curves::{CurveKey, Curves, Point, Series, Statistic};
use super::picture::{Align, Font, INK, PAPER, Pen, Picture, QUIET};
use super::published_fig10::Published;
use crate::cell::TestSet;
use crate::error::BenchError;

/// Width and height of a panel.
const PANEL: (f64, f64) = (170.0, 176.0);
/// Left edge of the first panel: the axis label and the tick labels stand before it.
const LEFT: f64 = 84.0;
/// Top edge of the first panel: title, joint and unit stand above it.
const TOP: f64 = 96.0;
/// From one panel to the next; the room between takes tick labels.
const STEP: (f64, f64) = (220.0, 240.0);
/// Room below the last panel for the axis label, the legend and a remark.
const BOTTOM: f64 = 128.0;
/// Width that the title and the legend need at least.
const MIN_WIDTH: f64 = 1150.0;
/// Room between the outermost sizes and the frame.
const INSET: f64 = 12.0;
/// Width of a column for a size beyond the chapter's.
const APART: f64 = 40.0;
/// Largest size of the chapter's axis.
const LARGEST_ON_AXIS: usize = 1820;
/// Sizes that the chapter labels.
const LABELLED: [usize; 4] = [280, 532, 896, 1820];

/// Vertical axes of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// The chapter's: linear from 0, values above drawn near the top.
    Chapter,
    /// Logarithmic, each joint's own range.
    Log,
}

/// Pen of a line; colours that differ under the common colour blindnesses, and by dashes besides.
///
/// # Source
/// Colours: Okabe and Ito 2008, "Color Universal Design", the set of eight.
pub(crate) fn pen(series: Series) -> Pen {
    let (colour, width, dashes) = match series {
        Series::Single => ("#d55e00", 1.6, Some("2 3")),
        Series::Independent => ("#0072b2", 1.6, Some("7 3")),
        Series::Pooled => ("#009e73", 1.6, Some("8 3 2 3")),
        Series::TransferBic => (INK, 2.2, None),
        Series::SharedBic => ("#cc79a7", 1.6, None),
        Series::RigidBody => ("#e69f00", 1.6, Some("2 3")),
        Series::RigidBodyAndProcess => ("#e69f00", 1.6, None),
    };
    Pen {
        colour,
        width,
        dashes,
    }
}

/// Draws the figure of a test set.
///
/// # Errors
/// `Malformed` if the published axes cannot be read.
/// # Source
/// Figs. 10 (interp) and 11 (extrap).
pub fn draw(curves: &Curves, set: TestSet, scale: Scale) -> Result<Picture, BenchError> {
    let published = Published::read()?;
    let joints = curves.joints();
    let width = (LEFT + STEP.0 * joints.len() as f64).max(MIN_WIDTH);
    let height = TOP + STEP.1 + PANEL.1 + BOTTOM;
    let mut picture = Picture::new(width, height);
    title(&mut picture, set, scale);

    for (column, &joint) in joints.iter().enumerate() {
        let axis = axis(curves, &published, (joint, set), scale);
        for (row, statistic) in Statistic::ALL.into_iter().enumerate() {
            let panel = Panel {
                x: LEFT + STEP.0 * column as f64,
                y: TOP + STEP.1 * row as f64,
                axis: &axis,
                sizes: Sizes::of(curves),
            };
            panel.frame(&mut picture, joint);
            for series in drawn(scale) {
                let key = CurveKey {
                    joint,
                    set,
                    statistic,
                    series,
                };
                let points = curves.0.get(&key).map_or(&[][..], Vec::as_slice);
                panel.line(&mut picture, &key, points);
            }
        }
    }
    row_titles(&mut picture);
    legend(&mut picture, height - 54.0, scale, curves);
    Ok(picture)
}

/// Lines of a picture: those with a rigid-body model lie on the bottom of the chapter's axes.
fn drawn(scale: Scale) -> impl Iterator<Item = Series> {
    let is_drawn = move |series: &Series| match series {
        Series::RigidBody | Series::RigidBodyAndProcess => scale == Scale::Log,
        _ => true,
    };
    Series::DRAWN.into_iter().filter(is_drawn)
}

/// A joint's vertical axis, the same for average and median.
fn axis(
    curves: &Curves,
    published: &Published,
    (joint, set): (usize, TestSet),
    scale: Scale,
) -> Axis {
    let axes = published.axes(set);
    let chapter = Axis::Linear {
        top: axes.tops[joint - 1],
        tick: axes.ticks[joint - 1],
    };
    match scale {
        Scale::Chapter => chapter,
        Scale::Log => {
            let lines = curves.0.iter();
            let of_joint = lines.filter(|(key, _)| (key.joint, key.set) == (joint, set));
            let values = of_joint.flat_map(|(_, points)| points.iter().map(|p| p.value));
            Axis::log_around(values).unwrap_or(chapter)
        }
    }
}

fn title(picture: &mut Picture, set: TestSet, scale: Scale) {
    let number = match set {
        TestSet::Interp => 10,
        TestSet::Extrap => 11,
    };
    let axes = match scale {
        Scale::Chapter => "",
        Scale::Log => ", logarithmic",
    };
    let set = set.name();
    let title = format!("nMSE on {set} in 14 contexts{axes} (the chapter's figure {number})");
    picture.text(24.0, 34.0, &title, Font::Title, Align::Left);
}

fn row_titles(picture: &mut Picture) {
    for (row, statistic) in Statistic::ALL.into_iter().enumerate() {
        let y = TOP + STEP.1 * row as f64 + PANEL.1 / 2.0;
        let name = format!("{} of nMSEs", statistic.name());
        picture.vertical_text(30.0, y, &name, Font::Label);
    }
}

fn legend(picture: &mut Picture, y: f64, scale: Scale, curves: &Curves) {
    let mut about_n = String::from("n = all samples of the 14 contexts, on a log scale");
    if !Sizes::of(curves).apart.is_empty() {
        about_n.push_str("; behind the rule: not in the chapter");
    }
    picture.text(LEFT, y - 16.0, &about_n, Font::Remark, Align::Left);
    let is_drawn = |series: &Series| {
        Series::ALL.contains(series) || curves.0.keys().any(|key| key.series == *series)
    };
    for (i, series) in drawn(scale).filter(is_drawn).enumerate() {
        let x = LEFT + 150.0 * i as f64;
        let pen = pen(series);
        picture.stroke(vec![(x, y + 14.0), (x + 46.0, y + 14.0)], pen);
        picture.disc((x + 23.0, y + 14.0), 3.0, pen.colour, pen.colour);
        picture.text(x + 56.0, y + 18.0, series.name(), Font::Label, Align::Left);
    }
    // All values fit on a logarithmic axis.
    if scale == Scale::Chapter {
        let remark = "open circle: above the axis";
        picture.text(LEFT, y + 42.0, remark, Font::Remark, Align::Left);
    }
}

/// Numbers of samples: those of the chapter's axis, and those that stand apart at its right.
struct Sizes {
    on_axis: Vec<usize>,
    apart: Vec<usize>,
}

impl Sizes {
    /// All of them on the axis where none is within the chapter's.
    fn of(curves: &Curves) -> Self {
        let sizes = curves.sizes();
        let (on_axis, apart): (Vec<usize>, Vec<usize>) =
            sizes.iter().partition(|&&n| n <= LARGEST_ON_AXIS);
        if on_axis.is_empty() {
            return Self {
                on_axis: sizes,
                apart: Vec::new(),
            };
        }
        Self { on_axis, apart }
    }
}

/// Where one plot stands, and its axes.
struct Panel<'a> {
    x: f64,
    y: f64,
    axis: &'a Axis,
    sizes: Sizes,
}

impl Panel<'_> {
    fn frame(&self, picture: &mut Picture, joint: usize) {
        let (width, height) = PANEL;
        let (x, y) = (self.x, self.y);
        picture.rectangle((x, y, width, height), PAPER, None);
        for (fraction, label) in self.axis.ticks() {
            let tick_y = y + height * (1.0 - fraction);
            picture.line((x, tick_y), (x + width, tick_y));
            picture.text(x - 6.0, tick_y + 4.0, &label, Font::Remark, Align::Right);
        }
        for &n in &self.sizes.on_axis {
            self.size_mark(picture, n);
        }
        for (idx, &n) in self.sizes.apart.iter().enumerate() {
            self.size_apart(picture, idx, n);
        }
        picture.rectangle((x, y, width, height), "none", Some(INK));
        let middle = x + width / 2.0;
        picture.text(
            middle,
            y - 10.0,
            &format!("joint {joint}"),
            Font::Heading,
            Align::Centre,
        );
        picture.text(x, y - 10.0, &self.axis.unit(), Font::Remark, Align::Left);
    }

    /// A plus on the axis at every size, a number at those that the chapter labels.
    fn size_mark(&self, picture: &mut Picture, n: usize) {
        let (x, y) = (self.place_n(n), self.y + PANEL.1);
        let pen = Pen {
            colour: QUIET,
            width: 1.0,
            dashes: None,
        };
        picture.line((x, self.y), (x, y));
        picture.stroke(vec![(x - 3.0, y), (x + 3.0, y)], pen);
        picture.stroke(vec![(x, y - 3.0), (x, y + 3.0)], pen);
        let are_few = self.sizes.on_axis.len() < 4;
        if LABELLED.contains(&n) || are_few {
            picture.text(x, y + 18.0, &n.to_string(), Font::Remark, Align::Centre);
        }
    }

    /// A column of its own behind a rule, with its number.
    fn size_apart(&self, picture: &mut Picture, idx: usize, n: usize) {
        let (x, bottom) = (self.place_n(n), self.y + PANEL.1);
        let edge = self.left_of_column(idx);
        let rule = Pen {
            colour: INK,
            width: 1.0,
            dashes: None,
        };
        picture.stroke(vec![(edge, self.y), (edge, bottom)], rule);
        picture.line((x, self.y), (x, bottom));
        // Five digits would run into the last of the axis.
        let number = if n.is_multiple_of(1000) {
            format!("{}k", n / 1000)
        } else {
            n.to_string()
        };
        picture.text(x, bottom + 18.0, &number, Font::Remark, Align::Centre);
    }

    fn line(&self, picture: &mut Picture, key: &CurveKey, points: &[Point]) {
        let pen = pen(key.series);
        let at = |point: &Point, value: f64| {
            let place = self.axis.place(value);
            ((self.place_n(point.n), self.height_of(place)), place)
        };
        let joined = || points.iter().filter(|p| !self.sizes.apart.contains(&p.n));
        if joined().any(|p| p.low < p.high) {
            let low = joined().map(|p| at(p, p.low).0);
            let high = joined().rev().map(|p| at(p, p.high).0);
            let corners: Vec<(f64, f64)> = low.chain(high).collect();
            picture.area(&corners, pen.colour);
        }
        picture.stroke(joined().map(|p| at(p, p.value).0).collect(), pen);
        for point in points {
            let (centre, place) = at(point, point.value);
            let fill = if place.is_above {
                "#ffffff"
            } else {
                pen.colour
            };
            picture.start_group(format!("{key}, n = {}: {:.2e}", point.n, point.value));
            picture.disc(centre, 3.0, fill, pen.colour);
            picture.end_group();
        }
    }

    /// Left edge of a column that stands apart.
    fn left_of_column(&self, idx: usize) -> f64 {
        let n_right = self.sizes.apart.len() - idx;
        self.x + PANEL.0 - APART * n_right as f64
    }

    /// Horizontal place of a size: linear in log n on the axis, in the middle of its column apart.
    fn place_n(&self, n: usize) -> f64 {
        let (on_axis, apart) = (&self.sizes.on_axis, &self.sizes.apart);
        if let Some(idx) = apart.iter().position(|&size| size == n) {
            return self.left_of_column(idx) + APART / 2.0;
        }
        let log = |n: usize| (n as f64).log2();
        let first = on_axis.first().map_or(0.0, |&n| log(n));
        let last = on_axis.last().map_or(1.0, |&n| log(n));
        let spread = if last > first { last - first } else { 1.0 };
        let inside = PANEL.0 - APART * apart.len() as f64 - 2.0 * INSET;
        self.x + INSET + inside * (log(n) - first) / spread
    }

    fn height_of(&self, place: Place) -> f64 {
        self.y + PANEL.1 * (1.0 - place.fraction)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::curves::tests::{curves, record};

    #[test]
    fn every_panel_is_drawn_and_values_above_the_axis_are_open() {
        let records = [
            record(1, 280, [1e-6, 2e-6, 1e-5, 1e-6, 1e-6]),
            record(1, 1820, [1.0, 2e-6, 1e-5, 1e-6, 1e-6]),
            record(6, 532, [1e-4; 5]),
        ];
        let svg = draw(&curves(&records), TestSet::Interp, Scale::Chapter)
            .unwrap()
            .to_svg();
        for part in [
            "joint 1",
            "joint 6",
            "mGP-BIC",
            "×10⁻⁵",
            "average of nMSEs",
            "n = 532: 2.00e-4",
        ] {
            assert!(svg.contains(part), "{part}");
        }
        assert!(svg.contains("joint 1, interp, median of sGP, n = 1820: 2.00e0"));
        // sGP of joint 1 at n = 1820 is above the axis in both rows.
        let n_open = svg.matches("fill=\"#ffffff\"").count() + svg.matches("fill=\"#fff\"").count();
        assert!(n_open >= 2, "{n_open} open circles");
        let log = draw(&curves(&records), TestSet::Extrap, Scale::Log).unwrap();
        assert!(log.to_svg().contains("10⁻⁵"));
    }

    #[test]
    fn a_size_beyond_the_chapters_stands_apart_and_moves_no_scale_of_others() {
        let all = [280, 1820, 56_000].map(|n| record(3, n, [1e-4; 5]));
        let axis = Axis::Linear {
            top: 1e-3,
            tick: 1e-3,
        };
        let place = |records: &[_], n| {
            let sizes = Sizes::of(&curves(records));
            let (x, y, axis) = (100.0, 0.0, &axis);
            Panel { x, y, axis, sizes }.place_n(n)
        };
        // The last column is 40 wide; the axis ends 12 before it.
        let expected = [112.0, 100.0 + 170.0 - 40.0 - 12.0, 100.0 + 170.0 - 20.0];
        for (n, x) in [280, 1820, 56_000].into_iter().zip(expected) {
            assert!((place(&all, n) - x).abs() < 1e-9, "{n}: {}", place(&all, n));
        }
        assert!((place(&all[..2], 1820) - 258.0).abs() < 1e-9);
        // Alone, it is the axis.
        assert!((place(&all[2..], 56_000) - 112.0).abs() < 1e-9);
    }
}
