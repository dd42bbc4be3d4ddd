//! The work-precision diagram: run time to the right, error upwards, both in logarithms, a line for each ladder.
//!
//! SVG and PNG come from the same drawing. Text is set in Roboto, a subset of which lies in `fonts/` (Apache 2.0), so that the
//! picture is the same on a machine without any font; an SVG names it, and similar ones for who does not have it.

mod axis;
mod canvas;
mod labels;
mod plot;

use plotters::prelude::{BitMapBackend, IntoDrawingArea, SVGBackend};
use raytree_film::Rgb8Picture;

use crate::summary::Summary;
use canvas::{Canvas, FINENESS, HEIGHT, Letters, WIDTH};

/// Why there is no diagram.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum ChartError {
    /// No point has both a run time with a spread and an error.
    #[error("there is nothing to draw: no setting has two timed runs yet")]
    Empty,
    /// Of the library's.
    #[error("the diagram can't be drawn: {0}")]
    Draw(String),
}

/// Pixels of a PNG for one of the drawing's: sharp in print.
const PNG_FINENESS: u32 = 2;

/// The diagram as SVG, 900 x 600.
///
/// # Errors
/// [`ChartError`].
pub fn svg(summary: &Summary) -> Result<String, ChartError> {
    let mut text = String::new();
    {
        let size = (WIDTH * FINENESS, HEIGHT * FINENESS);
        let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
        plot::draw(&Canvas::new(&area, Letters::OfSvg)?, summary)?;
        area.present().map_err(canvas::failed)?;
    }
    // Drawn finer than it is shown, since the library's coordinates are whole.
    let fine = format!(
        r#"width="{}" height="{}""#,
        WIDTH * FINENESS,
        HEIGHT * FINENESS
    );
    let shown = format!(r#"width="{WIDTH}" height="{HEIGHT}""#);
    Ok(text.replacen(&fine, &shown, 1))
}

/// The diagram as pixels, 1800 x 1200.
///
/// # Errors
/// [`ChartError`].
pub fn png(summary: &Summary) -> Result<Rgb8Picture, ChartError> {
    let (width, height) = (WIDTH * FINENESS, HEIGHT * FINENESS);
    let mut bytes = vec![255; 3 * width as usize * height as usize];
    {
        let area = BitMapBackend::with_buffer(&mut bytes, (width, height)).into_drawing_area();
        plot::draw(&Canvas::new(&area, Letters::OfBitmap)?, summary)?;
        area.present().map_err(canvas::failed)?;
    }
    Ok(shrunk(&bytes, width, height, FINENESS / PNG_FINENESS))
}

/// Mean of `factor` x `factor` pixels: what smooths edges, which the library leaves hard.
fn shrunk(bytes: &[u8], width: u32, height: u32, factor: u32) -> Rgb8Picture {
    let (columns, rows) = (width / factor, height / factor);
    let at = |x: u32, y: u32, channel: usize| {
        u32::from(bytes[3 * (y as usize * width as usize + x as usize) + channel])
    };
    let mean = |x: u32, y: u32, channel: usize| {
        let inner =
            (0..factor * factor).map(|i| (x * factor + i % factor, y * factor + i / factor));
        let sum: u32 = inner.map(|(x, y)| at(x, y, channel)).sum();
        ((sum + factor * factor / 2) / (factor * factor)) as u8
    };
    let pixels = (0..columns * rows)
        .map(|i| [0, 1, 2].map(|channel| mean(i % columns, i / columns, channel)))
        .collect();
    Rgb8Picture {
        width: columns,
        height: rows,
        pixels,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::test_summary;

    #[test]
    fn both_forms_are_drawn_and_name_the_scene() {
        let summary = test_summary::summary();
        let svg = svg(&summary).unwrap();
        assert!(svg.starts_with(r#"<svg width="900" height="600" viewBox="0 0 3600 2400""#));
        for word in ["made-up", "samples a pixel", "depth", "Pareto", "95"] {
            assert!(svg.contains(word), "no '{word}' in the diagram");
        }
        let png = png(&summary).unwrap();
        assert_eq!((png.width, png.height), (1800, 1200));
        let dark = png
            .pixels
            .iter()
            .filter(|p| p[0] < 128 && p[1] < 128 && p[2] < 128);
        assert!(dark.count() > 2000, "text is dark");
    }

    #[test]
    fn the_same_numbers_give_the_same_diagram() {
        let summary = test_summary::summary();
        assert_eq!(svg(&summary).unwrap(), svg(&summary).unwrap());
        assert_eq!(png(&summary).unwrap().pixels, png(&summary).unwrap().pixels);
    }

    #[test]
    fn without_spreads_there_is_nothing_to_draw() {
        let mut summary = test_summary::summary();
        for point in &mut summary.points {
            point.cpu_s = None;
        }
        assert_eq!(svg(&summary), Err(ChartError::Empty));
        assert_eq!(png(&summary).map(|_| ()), Err(ChartError::Empty));
    }

    #[test]
    fn shrinking_takes_the_mean() {
        let bytes = [0, 0, 0, 100, 0, 0, 0, 0, 0, 100, 255, 1];
        let picture = shrunk(&bytes, 2, 2, 2);
        assert_eq!(picture.pixels, [[50, 64, 0]]);
    }
}
