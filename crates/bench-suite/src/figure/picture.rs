//! A picture made of rectangles, lines and labels, written as SVG and PNG.

use kuva::backend::png::PngBackend;
use kuva::backend::svg::SvgBackend;
use kuva::render::render::{PathData, Primitive, Scene, TextAnchor};

use super::colour::{GRID, INK, QUIET};
use crate::error::BenchError;

/// Pixels a point in the PNG.
const PNG_SCALE: f32 = 2.0;

/// The letters of the pictures, inside every SVG file: no font of the system is needed.
pub(crate) const FONTS: &str = include_str!("../../fonts/dejavu.css");

/// Size and weight of a label.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Font {
    /// Title of the picture.
    Title,
    /// Name of a block of rows or columns.
    Heading,
    /// Row and column labels.
    Label,
    /// Remarks below the picture.
    Remark,
}

/// Where a label's reference point lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Align {
    /// At its left end.
    Left,
    /// In its middle.
    Centre,
    /// At its right end.
    Right,
}

/// A picture; coordinates in points from the top left.
pub struct Picture {
    scene: Scene,
}

impl Picture {
    /// Empty white picture.
    pub fn new(width: f64, height: f64) -> Self {
        let mut scene = Scene::new(width, height);
        scene.font_family = Some("DejaVu Sans, Helvetica, Arial, sans-serif".to_string());
        scene.text_color = Some(INK.to_string());
        Self { scene }
    }

    /// Label whose baseline is at y.
    pub fn text(&mut self, x: f64, y: f64, content: &str, font: Font, align: Align) {
        self.turned_text((x, y), content, font, align, None);
    }

    /// Label read from bottom to top whose middle is at (x, y).
    pub fn vertical_text(&mut self, x: f64, y: f64, content: &str, font: Font) {
        self.turned_text((x, y), content, font, Align::Centre, Some(-90.0));
    }

    fn turned_text(
        &mut self,
        (x, y): (f64, f64),
        content: &str,
        font: Font,
        align: Align,
        rotate: Option<f64>,
    ) {
        let (size, bold, colour) = match font {
            Font::Title => (16, true, INK),
            Font::Heading => (13, true, INK),
            Font::Label => (12, false, INK),
            Font::Remark => (11, false, QUIET),
        };
        self.scene.add(Primitive::Text {
            x,
            y,
            content: content.to_string(),
            size,
            anchor: match align {
                Align::Left => TextAnchor::Start,
                Align::Centre => TextAnchor::Middle,
                Align::Right => TextAnchor::End,
            },
            rotate,
            bold,
            color: Some(colour.into()),
        });
    }

    /// The picture as SVG text, with its fonts.
    pub fn to_svg(&self) -> String {
        let svg = SvgBackend::default().render_scene(&self.scene);
        // With a view box the picture shrinks with its page instead of being cut off.
        let (width, height) = (self.scene.width, self.scene.height);
        let svg = svg.replacen(
            "<svg ",
            &format!("<svg viewBox=\"0 0 {width} {height}\" "),
            1,
        );
        // The first `>` ends the opening tag.
        svg.replacen('>', &format!(">{}", font_style()), 1)
    }

    /// The picture as a PNG file's bytes.
    ///
    /// # Errors
    /// `Picture` with the library's reason.
    pub fn to_png(&self) -> Result<Vec<u8>, BenchError> {
        PngBackend::new()
            .with_scale(PNG_SCALE)
            .render_scene(&self.scene)
            .map_err(|message| BenchError::Picture { message })
    }

    /// Rectangle (x, y, width, height); a fill of "none" leaves it open.
    pub fn rectangle(
        &mut self,
        (x, y, width, height): (f64, f64, f64, f64),
        fill: &str,
        stroke: Option<&str>,
    ) {
        self.scene.add(Primitive::Rect {
            x,
            y,
            width,
            height,
            fill: fill.into(),
            stroke: stroke.map(Into::into),
            stroke_width: stroke.map(|_| 1.0),
            opacity: None,
        });
    }

    /// Grid line.
    pub fn line(&mut self, from: (f64, f64), to: (f64, f64)) {
        self.stroke(vec![from, to], GRID, 1.0);
    }

    /// Solid line of a width in points through points.
    pub fn stroke(&mut self, points: Vec<(f64, f64)>, colour: &str, width: f64) {
        self.scene.add(Primitive::PolyLine {
            points,
            stroke: colour.into(),
            stroke_width: width,
            stroke_dasharray: None,
        });
    }

    /// Area inside a closed line, without an outline and half transparent.
    pub fn area(&mut self, corners: &[(f64, f64)], colour: &str) {
        let steps: Vec<String> = corners
            .iter()
            .map(|(x, y)| format!("{x:.2} {y:.2}"))
            .collect();
        self.scene.add(Primitive::Path(Box::new(PathData {
            d: format!("M {} Z", steps.join(" L ")),
            fill: Some(colour.into()),
            stroke: "none".into(),
            stroke_width: 0.0,
            opacity: Some(0.2),
            stroke_dasharray: None,
        })));
    }

    /// Filled disc.
    pub fn disc(&mut self, (cx, cy): (f64, f64), radius: f64, fill: &str, outline: &str) {
        self.scene.add(Primitive::Circle {
            cx,
            cy,
            r: radius,
            fill: fill.into(),
            fill_opacity: None,
            stroke: Some(outline.into()),
            stroke_width: Some(1.5),
        });
    }

    /// Starts a group whose SVG tooltip is `title`; [`Picture::end_group`] ends it.
    pub fn start_group(&mut self, title: String) {
        self.scene.add(Primitive::GroupStart {
            transform: None,
            title: Some(title),
            extra_attrs: None,
        });
    }

    /// Ends a group.
    pub fn end_group(&mut self) {
        self.scene.add(Primitive::GroupEnd);
    }
}

/// What makes an SVG file independent of the system's fonts.
fn font_style() -> String {
    format!("\n<style>\n{FONTS}</style>")
}

/// The text of [`Picture::to_svg`] for a page that has the fonts itself.
pub(crate) fn without_fonts(svg: &str) -> String {
    svg.replacen(&font_style(), "", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn png_has_a_png_signature_and_svg_carries_lines_and_turned_text() {
        let mut picture = Picture::new(100.0, 60.0);
        picture.stroke(vec![(1.0, 2.0), (30.0, 40.0)], "#123456", 2.0);
        picture.area(&[(1.0, 2.0), (30.0, 2.0), (30.0, 9.0)], "#123456");
        picture.vertical_text(9.0, 30.0, "nMSE", Font::Label);
        assert_eq!(picture.to_png().unwrap()[..4], [0x89, b'P', b'N', b'G']);
        let svg = picture.to_svg();
        assert!(svg.starts_with("<svg ") && svg.matches("<style>").count() == 1);
        for part in ["viewBox=\"0 0 100 60\"", "#123456", "rotate(-90"] {
            assert!(svg.contains(part), "{part}: {svg}");
        }
    }
}
