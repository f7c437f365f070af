//! Hinton diagrams: a matrix of numbers as squares of proportional size.

use super::colour::{INK, PAPER};
pub use super::picture::{Align, Font, Picture};

/// Side of a matrix element, in points.
pub const PITCH: f64 = 36.0;
/// Side of the largest square in units of [`PITCH`].
const LARGEST: f64 = 0.92;
/// Side of the smallest square in units of [`PITCH`]: still visible, so that "smallest" and "absent" differ.
const SMALLEST: f64 = 0.07;
/// Range of a logarithmic scale.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LogRange {
    /// Value of the smallest square.
    pub low: f64,
    /// Value of the largest square.
    pub high: f64,
}

impl LogRange {
    /// Place of a value in the range, from 0 to 1, clipped.
    ///
    /// ```text
    /// (log v − log low) / (log high − log low)
    /// ```
    pub fn fraction(&self, value: f64) -> f64 {
        let place = (value / self.low).ln() / (self.high / self.low).ln();
        place.clamp(0.0, 1.0)
    }

    /// Side of the square of a value, in points; linear in the logarithm.
    pub fn side(&self, value: f64) -> f64 {
        PITCH * (SMALLEST + (LARGEST - SMALLEST) * self.fraction(value))
    }
}

/// Side of the square that has a fraction of the largest square's area, in points.
pub fn side_of_area(fraction: f64) -> f64 {
    PITCH * LARGEST * fraction.clamp(0.0, 1.0).sqrt()
}

impl Picture {
    /// Background and grid of a matrix whose top left corner is (x, y).
    pub fn frame(&mut self, x: f64, y: f64, n_rows: usize, n_columns: usize) {
        let (width, height) = (PITCH * n_columns as f64, PITCH * n_rows as f64);
        self.rectangle((x, y, width, height), PAPER, None);
        for column in 1..n_columns {
            let x = x + PITCH * column as f64;
            self.line((x, y), (x, y + height));
        }
        for row in 1..n_rows {
            let y = y + PITCH * row as f64;
            self.line((x, y), (x + width, y));
        }
        self.rectangle((x, y, width, height), "none", Some(INK));
    }

    /// Square of a value in the element whose top left corner is (x, y); its SVG tooltip is `title`.
    pub fn square(&mut self, x: f64, y: f64, side: f64, title: String) {
        let margin = (PITCH - side) / 2.0;
        self.start_group(title);
        self.rectangle((x + margin, y + margin, side, side), INK, None);
        self.end_group();
    }

    /// Mark of a missing value.
    pub fn absent(&mut self, x: f64, y: f64) {
        let (x, y) = (x + PITCH / 2.0, y + PITCH / 2.0 + 4.0);
        self.text(x, y, "–", Font::Remark, Align::Centre);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_are_linear_in_the_logarithm_and_clipped() {
        let range = LogRange {
            low: 1e-4,
            high: 1.0,
        };
        assert!((range.fraction(1e-2) - 0.5).abs() <= 4.0 * f64::EPSILON);
        let (low, middle, high) = (range.side(1e-4), range.side(1e-2), range.side(1.0));
        assert!((middle - f64::midpoint(low, high)).abs() <= 8.0 * f64::EPSILON * PITCH);
        assert_eq!(range.side(1e-9).to_bits(), low.to_bits());
        assert!(low > 0.0 && high < PITCH);
    }

    #[test]
    fn png_has_a_png_signature_and_svg_carries_the_tooltip() {
        let mut picture = Picture::new(100.0, 60.0);
        picture.frame(10.0, 10.0, 1, 2);
        picture.square(10.0, 10.0, 20.0, "nMSE < 1".to_string());
        assert_eq!(picture.to_png().unwrap()[..4], [0x89, b'P', b'N', b'G']);
        assert!(
            picture.to_svg().contains("nMSE &lt; 1"),
            "{}",
            picture.to_svg()
        );
    }
}
