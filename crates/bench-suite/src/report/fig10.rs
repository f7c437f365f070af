//! Figures 10 and 11: average and median nMSE over the contexts against n, a column a joint.

use super::curves::{CurveKey, Curves, Point, Series, Statistic};
use super::published_fig10::Published;
use crate::cell::TestSet;
use crate::error::BenchError;
use crate::figure::axis::Axis;
use crate::figure::colour::INK;
use crate::figure::palette::line_of;
use crate::figure::panel::{Panel, legend_row};
use crate::figure::picture::{Align, Font, Picture};

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
const MIN_WIDTH: f64 = 800.0;
/// Room between the outermost sizes and the frame.
const INSET: f64 = 12.0;
/// Width of a column for a size beyond the chapter's.
const APART: f64 = 40.0;
/// Largest size of the chapter's axis.
const LARGEST_ON_AXIS: usize = 1820;
/// Sizes that the chapter labels.
const LABELLED: [usize; 4] = [280, 532, 896, 1820];
/// Height at which a number above the axis is drawn.
///
/// # Source
/// Section 4.6: "If a value lies above the upper limit of the vertical range, it is given a nominal value near the upper limit."
const NOMINAL: f64 = 0.97;

/// Vertical axes of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Scale {
    /// The chapter's: linear from 0, values above drawn near the top.
    Chapter,
    /// Logarithmic, each joint's own range.
    Log,
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
            let corner = (LEFT + STEP.0 * column as f64, TOP + STEP.1 * row as f64);
            let plot = Plot::new(corner, axis.clone(), Sizes::of(curves));
            plot.frame(&mut picture, joint);
            for series in drawn(scale) {
                let key = CurveKey::new(joint, set, statistic, series);
                let points = curves.0.get(&key).map_or(&[][..], Vec::as_slice);
                plot.line(&mut picture, &key, points);
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
        Series::RigidBodyAndProcess | Series::Shared(_) => scale == Scale::Log,
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
    match scale {
        Scale::Chapter => {
            let axes = published.axes(set);
            Axis::from_zero("", axes.tops[joint - 1], axes.ticks[joint - 1])
        }
        Scale::Log => {
            let lines = curves.0.iter();
            let of_joint = lines.filter(|(key, _)| (key.joint, key.set) == (joint, set));
            let values = of_joint.flat_map(|(_, points)| points.iter().map(|p| p.value));
            Axis::decades("", values)
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
    let entries = drawn(scale).filter(is_drawn);
    let entries = entries.map(|series| (line_of(series.name()), series.name()));
    legend_row(picture, (LEFT, y + 14.0), entries);
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

/// A plot whose larger sizes stand apart in columns of their own.
struct Plot {
    panel: Panel,
    sizes: Sizes,
}

impl Plot {
    fn new((x, y): (f64, f64), vertical: Axis, sizes: Sizes) -> Self {
        let are_few = sizes.on_axis.len() < 4;
        let marks = sizes.on_axis.iter().map(|&n| {
            let is_labelled = LABELLED.contains(&n) || are_few;
            let text = if is_labelled {
                n.to_string()
            } else {
                String::new()
            };
            (n as f64, text)
        });
        let mut panel = Panel::new(
            (x, y, PANEL.0, PANEL.1),
            Axis::of_numbers("", marks),
            vertical,
        );
        panel.inset = (INSET, INSET + APART * sizes.apart.len() as f64);
        Self { panel, sizes }
    }

    fn frame(&self, picture: &mut Picture, joint: usize) {
        self.panel.frame(picture);
        self.panel.heading(picture, &format!("joint {joint}"));
        for (idx, &n) in self.sizes.apart.iter().enumerate() {
            self.size_apart(picture, idx, n);
        }
    }

    /// A column of its own behind a rule, with its number.
    fn size_apart(&self, picture: &mut Picture, idx: usize, n: usize) {
        let (x, edge) = (self.place_n(n), self.left_of_column(idx));
        let (_, top, _, height) = self.panel.place;
        let bottom = top + height;
        picture.stroke(vec![(edge, top), (edge, bottom)], INK, 1.0);
        picture.line((x, top), (x, bottom));
        // Five digits would run into the last of the axis.
        let number = if n.is_multiple_of(1000) {
            format!("{}k", n / 1000)
        } else {
            n.to_string()
        };
        picture.text(x, bottom + 16.0, &number, Font::Remark, Align::Centre);
    }

    fn line(&self, picture: &mut Picture, key: &CurveKey, points: &[Point]) {
        let line = line_of(key.series.name());
        let at = |point: &Point, value: f64| (self.place_n(point.n), self.height_of(value).0);
        let joined = || points.iter().filter(|p| !self.sizes.apart.contains(&p.n));
        if joined().any(|p| p.low < p.high) {
            let low = joined().map(|p| at(p, p.low));
            let high = joined().rev().map(|p| at(p, p.high));
            let corners: Vec<(f64, f64)> = low.chain(high).collect();
            picture.area(&corners, line.colour);
        }
        let joined: Vec<(f64, f64)> = joined().map(|p| at(p, p.value)).collect();
        line.draw(picture, &joined);
        for point in points {
            let (_, is_above) = self.height_of(point.value);
            let fill = if is_above { "#ffffff" } else { line.colour };
            picture.start_group(format!("{key}, n = {}: {:.2e}", point.n, point.value));
            picture.disc(at(point, point.value), 3.0, fill, line.colour);
            picture.end_group();
        }
    }

    /// Left edge of a column that stands apart.
    fn left_of_column(&self, idx: usize) -> f64 {
        let n_right = self.sizes.apart.len() - idx;
        let (x, _, width, _) = self.panel.place;
        x + width - APART * n_right as f64
    }

    /// Horizontal place of a size: on the axis, or in the middle of its column apart.
    fn place_n(&self, n: usize) -> f64 {
        match self.sizes.apart.iter().position(|&size| size == n) {
            Some(idx) => self.left_of_column(idx) + APART / 2.0,
            None => self.panel.across(n as f64),
        }
    }

    /// Vertical place of a number, and whether it is above the axis, whose nominal place this is.
    fn height_of(&self, value: f64) -> (f64, bool) {
        let fraction = self.panel.vertical.fraction(value);
        let is_above = fraction > 1.0 || fraction.is_nan();
        let fraction = if is_above { NOMINAL } else { fraction.max(0.0) };
        let (_, y, _, height) = self.panel.place;
        (y + height * (1.0 - fraction), is_above)
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
    fn a_number_above_the_axis_gets_its_nominal_place() {
        let axis = Axis::from_zero("", 2e-4, 5e-5);
        let plot = Plot::new((0.0, 0.0), axis, Sizes::of(&curves(&[])));
        assert_eq!(plot.height_of(1e-4), (PANEL.1 / 2.0, false));
        let (height, is_above) = plot.height_of(2.1e-4);
        assert!(is_above && height > 0.0);
        assert!(plot.height_of(f64::NAN).1);
    }

    #[test]
    fn a_size_beyond_the_chapters_stands_apart_and_moves_no_scale_of_others() {
        let all = [280, 1820, 56_000].map(|n| record(3, n, [1e-4; 5]));
        let place = |records: &[_], n| {
            let axis = Axis::from_zero("", 1e-3, 1e-3);
            Plot::new((100.0, 0.0), axis, Sizes::of(&curves(records))).place_n(n)
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
