//! Curves through thousands of samples: thinned to what can be seen, and dashed along their whole length.

use super::picture::Picture;

/// Largest distance between a curve and its thinned form, in points: a fifth of a pixel of the PNG.
const TOLERANCE: f64 = 0.1;

/// Colour, width and dashes of a curve.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Line {
    /// Colour, as in SVG.
    pub colour: &'static str,
    /// Width in points.
    pub width: f64,
    /// Lengths of dashes and gaps in turn, points; empty for a solid line.
    pub dashes: &'static [f64],
}

impl Line {
    /// Solid line.
    pub const fn solid(colour: &'static str, width: f64) -> Self {
        Self::dashed(colour, width, &[])
    }

    /// Dashed line.
    pub const fn dashed(colour: &'static str, width: f64, dashes: &'static [f64]) -> Self {
        Self {
            colour,
            width,
            dashes,
        }
    }

    /// Draws a curve through points on the page.
    pub fn draw(&self, picture: &mut Picture, points: &[(f64, f64)]) {
        for piece in dashed(&thinned(points, TOLERANCE), self.dashes) {
            picture.stroke(piece, self.colour, self.width);
        }
    }
}

/// The points that a polyline needs to stay within a tolerance of all of them.
///
/// Douglas and Peucker: keep the ends; while a point lies further from their chord, keep the furthest and go on with
/// both halves. Jumps survive, since they are far from every chord.
pub fn thinned(points: &[(f64, f64)], tolerance: f64) -> Vec<(f64, f64)> {
    if points.len() < 3 {
        return points.to_vec();
    }
    let mut is_kept = vec![false; points.len()];
    let mut open = vec![(0, points.len() - 1)];
    while let Some((first, last)) = open.pop() {
        (is_kept[first], is_kept[last]) = (true, true);
        let furthest = (first + 1..last)
            .map(|i| (i, distance(points[i], points[first], points[last])))
            .max_by(|a, b| a.1.total_cmp(&b.1));
        if let Some((i, _)) = furthest.filter(|(_, distance)| *distance > tolerance) {
            open.extend([(first, i), (i, last)]);
        }
    }
    let kept = points.iter().zip(is_kept).filter(|(_, is_kept)| *is_kept);
    kept.map(|(point, _)| *point).collect()
}

/// Distance of a point from a segment.
fn distance(point: (f64, f64), from: (f64, f64), to: (f64, f64)) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let (px, py) = (point.0 - from.0, point.1 - from.1);
    let square = dx * dx + dy * dy;
    let along = if square > 0.0 {
        ((px * dx + py * dy) / square).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (px - along * dx).hypot(py - along * dy)
}

/// The dashes of a polyline; the pattern runs on through its corners.
///
/// Written out here because not every program restarts SVG's dash arrays at the same places.
pub fn dashed(points: &[(f64, f64)], pattern: &[f64]) -> Vec<Vec<(f64, f64)>> {
    if pattern.is_empty() || points.is_empty() {
        return vec![points.to_vec()];
    }
    let mut pieces = Vec::new();
    let mut piece = vec![points[0]];
    let (mut step, mut left) = (0, pattern[0]);
    for ends in points.windows(2) {
        let (mut from, to) = (ends[0], ends[1]);
        let mut length = (to.0 - from.0).hypot(to.1 - from.1);
        while length > left {
            let share = left / length;
            from = (
                from.0 + share * (to.0 - from.0),
                from.1 + share * (to.1 - from.1),
            );
            length -= left;
            if step % 2 == 0 {
                piece.push(from);
                pieces.push(std::mem::take(&mut piece));
            } else {
                piece = vec![from];
            }
            step += 1;
            left = pattern[step % pattern.len()];
        }
        left -= length;
        if step % 2 == 0 {
            piece.push(to);
        }
    }
    if piece.len() > 1 {
        pieces.push(piece);
    }
    pieces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn thinning_keeps_corners_and_jumps_and_drops_what_is_straight() {
        let mut points: Vec<(f64, f64)> = (0..=100).map(|i| (f64::from(i), 0.0)).collect();
        points.extend((101..=200).map(|i| (f64::from(i), 9.0)));
        let expected = [(0.0, 0.0), (100.0, 0.0), (101.0, 9.0), (200.0, 9.0)];
        assert_eq!(thinned(&points, 0.05), expected);
    }

    #[test]
    fn a_closed_curve_survives_thinning() {
        let circle: Vec<(f64, f64)> = (0..=360)
            .map(|i| f64::from(i).to_radians().sin_cos())
            .collect();
        let thin = thinned(&circle, 0.01);
        // A chord of a unit circle is 0.01 away from it when it spans 2·acos(0.99) = 16.2°.
        assert!((23..60).contains(&thin.len()), "{}", thin.len());
    }

    #[test]
    fn dashes_run_on_through_corners() {
        // Two sides of length 3; dashes of 2, gaps of 1: 0–2, 3–5.
        let corner = [(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)];
        let pieces = dashed(&corner, &[2.0, 1.0]);
        assert_eq!(pieces[0], [(0.0, 0.0), (2.0, 0.0)]);
        let total: f64 = pieces
            .iter()
            .flat_map(|piece| {
                piece
                    .windows(2)
                    .map(|w| (w[1].0 - w[0].0).hypot(w[1].1 - w[0].1))
            })
            .sum();
        assert!((total - 4.0).abs() <= 16.0 * f64::EPSILON, "{pieces:?}");
        let over_the_corner = [(0.0, 0.0), (3.0, 0.0), (3.0, 1.0)];
        assert_eq!(dashed(&corner, &[4.0, 5.0]), [over_the_corner.to_vec()]);
        assert_eq!(dashed(&corner, &[]), [corner.to_vec()]);
    }
}
