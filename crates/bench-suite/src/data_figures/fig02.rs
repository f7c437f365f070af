//! Figure 2: the four paths of the end effector, in perspective.

use super::samples::Samples;
use super::section::{Section, csv, extent};
use crate::error::BenchError;
use crate::figure::axis::Axis;
use crate::figure::colour::{DATA, QUIET};
use crate::figure::line::Line;
use crate::figure::perspective::View;
use crate::figure::picture::{Align, Font, Picture};
use crate::split::{N_PATHS, N_SAMPLES};

/// Dashes that tell the paths apart without colour.
const DASHES: [&[f64]; N_PATHS] = [&[], &[9.0, 4.5], &[2.5, 4.0], &[10.0, 4.0, 1.5, 4.0]];

/// Points of a path, m; the origin is on the floor below joint 1.
fn path(samples: &Samples, path_idx: usize) -> Vec<[f64; 3]> {
    let phase = |k| 2.0 * std::f64::consts::PI * k as f64 / N_SAMPLES as f64;
    (0..N_SAMPLES)
        .map(|k| samples.scenario().path_point(path_idx, phase(k)))
        .collect()
}

/// Makes the figure.
///
/// # Errors
/// `Picture` if it cannot be drawn.
///
/// # Source
/// Fig. 2.
pub fn make(samples: &Samples) -> Result<Section, BenchError> {
    let paths: Vec<Vec<[f64; 3]>> = (0..N_PATHS).map(|i| path(samples, i)).collect();
    let range = |axis: usize| extent(paths.iter().flatten().map(|point| point[axis]));
    let [x, y, z] = [range(0), range(1), range(2)];

    let mut section = Section::default();
    section.show("fig02", "The four paths in 3-D", &draw(&paths))?;
    let rows = paths.iter().enumerate().flat_map(|(i, points)| {
        let row = move |(k, point): (usize, &[f64; 3])| {
            let phase = 2.0 * k as f64 / N_SAMPLES as f64;
            let labels = vec![format!("p{}", i + 1)];
            (labels, vec![phase, point[0], point[1], point[2]])
        };
        points.iter().enumerate().map(row)
    });
    section.file("fig02.csv", csv("path,phase_over_pi,x_m,y_m,z_m", rows));
    let span = |(low, high): (f64, f64)| format!("{low:.2} to {high:.2} m").replace('-', "−");
    section.found(
        "x axis from 0.3 to 0.7 m",
        format!("paths over {}", span(x)),
    );
    section.found(
        "y axis from −0.2 to 0.2 m",
        format!("paths over {}", span(y)),
    );
    section.found(
        "z axis from 0.1 to 0.7 m",
        format!("paths over {}", span(z)),
    );
    Ok(section)
}

fn draw(paths: &[Vec<[f64; 3]>]) -> Picture {
    let mut picture = Picture::new(640.0, 540.0);
    let title = "The four paths p1 to p4 (the chapter's figure 2)";
    picture.text(24.0, 34.0, title, Font::Title, Align::Left);
    let axes = [
        Axis::linear("x/m", (0.28, 0.72), 0.1),
        Axis::linear("y/m", (-0.22, 0.22), 0.1),
        Axis::linear("z/m", (0.07, 0.75), 0.1),
    ];
    let view = View::new(axes, [0.9, 0.9, 1.0], (85.0, 56.0, 500.0, 400.0));
    view.frame(&mut picture);

    for (i, points) in paths.iter().enumerate() {
        let shadow = points.iter().map(|p| [p[0], p[1], view.floor()]);
        view.curve(&mut picture, &Line::solid(QUIET, 0.8), shadow);
        let line = Line::dashed(DATA[i], 2.2, DASHES[i]);
        let closed = points.iter().chain(points.first());
        view.curve(&mut picture, &line, closed.copied());
        // Of the two lobes one is higher on the page: its top has room for the name.
        let on_page = points.iter().map(|point| view.on_page(*point));
        if let Some((x, y)) = on_page.min_by(|a, b| a.1.total_cmp(&b.1)) {
            let name = format!("p{}", i + 1);
            picture.text(x, y - 8.0, &name, Font::Heading, Align::Centre);
        }
    }
    let remark = "The robot's base is at (0, 0, 0). Thin lines: the paths seen from above, on the floor of the box.";
    picture.text(24.0, 522.0, remark, Font::Remark, Align::Left);
    picture
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_paths_fit_into_the_chapters_axes() {
        let samples = Samples::reference().unwrap();
        for i in 0..N_PATHS {
            for [x, y, z] in path(&samples, i) {
                assert!((0.3..=0.7).contains(&x), "{x}");
                assert!((-0.2..=0.2).contains(&y), "{y}");
                assert!((0.1..=0.75).contains(&z), "{z}");
            }
        }
    }
}
