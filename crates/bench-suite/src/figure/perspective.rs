//! A box of data seen in perspective: its floor and back walls with grids, ticks and labels, and curves inside.

use super::axis::Axis;
use super::colour::{GRID, INK, QUIET};
use super::line::Line;
use super::picture::{Align, Font, Picture};

/// Azimuth of the camera about the vertical, from the first axis, degrees.
const AZIMUTH: f64 = -127.5;
/// Elevation of the camera above the floor, degrees.
const ELEVATION: f64 = 26.0;
/// Distance of the camera from the middle of the box; its longest side is 1.
const DISTANCE: f64 = 4.0;
/// From the box to the tick labels and to the axis labels, in points.
const OUTWARD: (f64, f64) = (10.0, 42.0);

/// A point of the box, each coordinate from 0 to 1 along its axis.
type Corner = [f64; 3];

/// A box of data on the page.
#[derive(Debug, Clone, PartialEq)]
pub struct View {
    /// The three axes; the third is vertical.
    axes: [Axis; 3],
    /// Sides of the box; the longest is 1.
    sides: [f64; 3],
    /// Page position of the middle of the view, and points per unit.
    centre: (f64, f64),
    zoom: f64,
}

impl View {
    /// Fits a box with the given sides into a rectangle (left, top, width, height) on the page.
    pub fn new(axes: [Axis; 3], sides: [f64; 3], place: (f64, f64, f64, f64)) -> Self {
        let (x, y, width, height) = place;
        let mut view = Self {
            axes,
            sides,
            centre: (0.0, 0.0),
            zoom: 1.0,
        };
        let corners: Vec<(f64, f64)> = corners().iter().map(|c| view.corner_on_page(*c)).collect();
        let low = |f: fn(&(f64, f64)) -> f64| corners.iter().map(f).fold(f64::INFINITY, f64::min);
        let high =
            |f: fn(&(f64, f64)) -> f64| corners.iter().map(f).fold(f64::NEG_INFINITY, f64::max);
        let (left, right) = (low(|c| c.0), high(|c| c.0));
        let (top, bottom) = (low(|c| c.1), high(|c| c.1));

        view.zoom = (width / (right - left)).min(height / (bottom - top));
        view.centre = (
            x + width / 2.0 - view.zoom * f64::midpoint(left, right),
            y + height / 2.0 - view.zoom * f64::midpoint(top, bottom),
        );
        view
    }

    /// Where a point of the data lies on the page.
    pub fn on_page(&self, point: [f64; 3]) -> (f64, f64) {
        self.corner_on_page([0, 1, 2].map(|i| self.axes[i].fraction(point[i])))
    }

    /// Draws a curve through points of the data.
    pub fn curve(
        &self,
        picture: &mut Picture,
        line: &Line,
        points: impl IntoIterator<Item = [f64; 3]>,
    ) {
        let points: Vec<(f64, f64)> = points
            .into_iter()
            .map(|point| self.on_page(point))
            .collect();
        line.draw(picture, &points);
    }

    /// Lower end of the vertical axis: the height of the floor.
    pub fn floor(&self) -> f64 {
        self.axes[2].low()
    }

    /// Draws the floor, the two back walls, the ticks and the labels.
    pub fn frame(&self, picture: &mut Picture) {
        // The camera looks from where both horizontal coordinates are low: the walls at 1 are behind the data.
        for axis in 0..3 {
            for (at, _) in self.axes[axis].ticks() {
                for wall in (0..3).filter(|&wall| wall != axis) {
                    self.grid_line(picture, axis, wall, at);
                }
            }
        }
        self.edges(picture);
        self.labels(picture, 0, [0.0, 0.0, 0.0], 1);
        self.labels(picture, 1, [0.0, 0.0, 0.0], 0);
        self.labels(picture, 2, [0.0, 1.0, 0.0], 0);
    }

    /// Line of a grid: `axis` stays at a fraction, `wall` at its back (or on the floor), and the third runs.
    fn grid_line(&self, picture: &mut Picture, axis: usize, wall: usize, at: f64) {
        let runs = 3 - axis - wall;
        let mut from = [0.0; 3];
        from[axis] = at;
        from[wall] = if wall == 2 { 0.0 } else { 1.0 };
        let mut to = from;
        to[runs] = 1.0;
        self.segment(picture, from, to, (GRID, 0.8));
    }

    fn edges(&self, picture: &mut Picture) {
        let back: [(Corner, Corner); 5] = [
            ([0.0, 1.0, 0.0], [1.0, 1.0, 0.0]),
            ([1.0, 0.0, 0.0], [1.0, 1.0, 0.0]),
            ([1.0, 1.0, 0.0], [1.0, 1.0, 1.0]),
            ([0.0, 1.0, 1.0], [1.0, 1.0, 1.0]),
            ([1.0, 0.0, 1.0], [1.0, 1.0, 1.0]),
        ];
        let front: [(Corner, Corner); 4] = [
            ([0.0, 0.0, 0.0], [1.0, 0.0, 0.0]),
            ([0.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
            ([0.0, 1.0, 0.0], [0.0, 1.0, 1.0]),
            ([1.0, 0.0, 0.0], [1.0, 0.0, 1.0]),
        ];
        for (from, to) in back {
            self.segment(picture, from, to, (QUIET, 0.8));
        }
        for (from, to) in front {
            self.segment(picture, from, to, (INK, 1.0));
        }
    }

    /// Ticks and name of an axis along the edge through `origin`; `away` is the axis along which labels move outward.
    fn labels(&self, picture: &mut Picture, axis: usize, origin: Corner, away: usize) {
        let on_edge = |at: f64| {
            let mut corner = origin;
            corner[axis] = at;
            self.corner_on_page(corner)
        };
        let outward = self.outward(axis, origin, away);
        let beside = |(x, y): (f64, f64), distance: f64| {
            (x + distance * outward.0, y + distance * outward.1 + 4.0)
        };
        // The first axis has its labels to its right, the others to their left.
        let align = if axis == 0 { Align::Left } else { Align::Right };
        for (at, text) in self.axes[axis].ticks() {
            let edge = on_edge(at);
            let end = (edge.0 + 5.0 * outward.0, edge.1 + 5.0 * outward.1);
            picture.stroke(vec![edge, end], INK, 1.0);
            let (x, y) = beside(edge, OUTWARD.0);
            picture.text(x, y, text, Font::Label, align);
        }
        let name = &self.axes[axis].label;
        if axis == 2 {
            let (x, y) = beside(on_edge(0.5), OUTWARD.1 + 10.0);
            picture.vertical_text(x, y, name, Font::Label);
        } else {
            let (x, y) = beside(on_edge(0.5), OUTWARD.1);
            picture.text(x, y, name, Font::Label, align);
        }
    }

    /// Unit vector on the page that leads away from the box at an edge.
    fn outward(&self, axis: usize, origin: Corner, away: usize) -> (f64, f64) {
        if axis == 2 {
            return (-1.0, 0.0);
        }
        let (mut inner, mut outer) = (origin, origin);
        (inner[axis], outer[axis]) = (0.5, 0.5);
        inner[away] = 0.1;
        let (from, to) = (self.corner_on_page(inner), self.corner_on_page(outer));
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        (dx / length, dy / length)
    }

    fn segment(
        &self,
        picture: &mut Picture,
        from: Corner,
        to: Corner,
        (colour, width): (&'static str, f64),
    ) {
        let ends = vec![self.corner_on_page(from), self.corner_on_page(to)];
        picture.stroke(ends, colour, width);
    }

    /// Central projection of a point of the box.
    ///
    /// ```text
    /// c = (cos e cos a, cos e sin a, sin e)     towards the camera
    /// r = (−sin a, cos a, 0)                    to the right
    /// u = c × r                                 up
    /// page = zoom (p·r, −p·u) d / (d − p·c)
    /// ```
    fn corner_on_page(&self, corner: Corner) -> (f64, f64) {
        let p = [0, 1, 2].map(|i| (corner[i] - 0.5) * self.sides[i]);
        let (sin_a, cos_a) = AZIMUTH.to_radians().sin_cos();
        let (sin_e, cos_e) = ELEVATION.to_radians().sin_cos();
        let right = -sin_a * p[0] + cos_a * p[1];
        let towards = cos_e * (cos_a * p[0] + sin_a * p[1]) + sin_e * p[2];
        let up = -sin_e * (cos_a * p[0] + sin_a * p[1]) + cos_e * p[2];
        let scale = self.zoom * DISTANCE / (DISTANCE - towards);
        (self.centre.0 + scale * right, self.centre.1 - scale * up)
    }
}

/// The eight corners of the box.
fn corners() -> [Corner; 8] {
    std::array::from_fn(|i| [0, 1, 2].map(|axis| f64::from(u8::from(i >> axis & 1 == 1))))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view() -> View {
        let axis = |name| Axis::linear(name, (0.0, 1.0), 0.5);
        let axes = [axis("a"), axis("b"), axis("c")];
        View::new(axes, [1.0, 1.0, 0.8], (100.0, 50.0, 300.0, 300.0))
    }

    #[test]
    fn the_box_fills_its_place_in_one_direction_and_stays_inside() {
        let view = view();
        let points: Vec<(f64, f64)> = corners().iter().map(|c| view.on_page(*c)).collect();
        let tolerance = 1e-9;
        for (x, y) in &points {
            assert!(
                *x >= 100.0 - tolerance && *x <= 400.0 + tolerance,
                "{points:?}"
            );
            assert!(
                *y >= 50.0 - tolerance && *y <= 350.0 + tolerance,
                "{points:?}"
            );
        }
        let width = points.iter().map(|p| p.0).fold(0.0, f64::max)
            - points.iter().map(|p| p.0).fold(f64::INFINITY, f64::min);
        let height = points.iter().map(|p| p.1).fold(0.0, f64::max)
            - points.iter().map(|p| p.1).fold(f64::INFINITY, f64::min);
        assert!((width.max(height) - 300.0).abs() < 1e-9);
    }

    #[test]
    fn what_is_nearer_is_larger_and_what_is_higher_is_higher() {
        let view = view();
        let length = |from: Corner, to: Corner| {
            let (a, b) = (view.on_page(from), view.on_page(to));
            (a.0 - b.0).hypot(a.1 - b.1)
        };
        let near = length([0.0, 0.0, 0.0], [0.0, 0.0, 1.0]);
        let far = length([1.0, 1.0, 0.0], [1.0, 1.0, 1.0]);
        assert!(near > far, "{near} {far}");
        assert!(view.on_page([0.5, 0.5, 1.0]).1 < view.on_page([0.5, 0.5, 0.0]).1);
    }
}
