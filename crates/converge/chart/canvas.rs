//! Lines, marks and words in points of a drawing of [`WIDTH`] x [`HEIGHT`], whatever it becomes.

use std::fmt::Display;
use std::sync::Once;

use plotters::coord::Shift;
use plotters::prelude::{
    Circle, DrawingArea, DrawingBackend, PathElement, Polygon, RGBColor, Rectangle, Text,
};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{
    Color, FontDesc, FontFamily, FontStyle, FontTransform, ShapeStyle, TextStyle, register_font,
};

use crate::chart::ChartError;

/// Points across.
pub const WIDTH: u32 = 900;
/// Points down.
pub const HEIGHT: u32 = 600;
/// Pixels of the library's, whose coordinates are whole numbers, for a point.
pub const FINENESS: u32 = 4;

/// What an SVG asks for; our own font is registered by the whole of it.
const FAMILY: &str = "Roboto, Helvetica, Arial, sans-serif";

const REGULAR: &[u8] = include_bytes!("../fonts/Roboto-Regular.ttf");
const MEDIUM: &[u8] = include_bytes!("../fonts/Roboto-Medium.ttf");

/// A place, points from the upper left corner.
pub type At = (f64, f64);

/// How a backend of the library sets letters: both have their own idea of a font's size and of where text sits.
#[derive(Clone, Copy, Debug)]
pub enum Letters {
    /// `font-size` is the size over 1.24; text that is centred has its line half an ex below the place.
    OfSvg,
    /// The size is from the lowest descender to the highest ascender; the line is half of it below the place.
    OfBitmap,
}

impl Letters {
    /// The library's size of letters with an em of 1. Roboto's ascender and descender are 2400 of 2048 units apart.
    fn size(self) -> f64 {
        match self {
            Self::OfSvg => 1.24,
            Self::OfBitmap => 2400.0 / 2048.0,
        }
    }

    /// How far below the place given the library puts the line, ems. Roboto's ex is 1082 of 2048 units.
    fn line(self) -> f64 {
        match self {
            Self::OfSvg => 0.5 * 1082.0 / 2048.0,
            Self::OfBitmap => 0.5 * self.size(),
        }
    }

    fn anchor(self) -> VPos {
        match self {
            Self::OfSvg => VPos::Center,
            Self::OfBitmap => VPos::Top,
        }
    }
}

/// How words look.
#[derive(Clone, Copy)]
pub struct Words {
    /// Of the em, points.
    pub size: f64,
    /// Heavier.
    pub bold: bool,
    /// Of the letters.
    pub color: RGBColor,
    /// Where the place is in them.
    pub from: HPos,
    /// Upwards.
    pub turned: bool,
}

/// Forms that can be told apart without colour.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    Circle,
    Square,
    Diamond,
    Up,
    Down,
    Cross,
}

/// What is drawn on.
pub struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    letters: Letters,
}

pub fn failed(error: impl Display) -> ChartError {
    ChartError::Draw(error.to_string())
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// A white one.
    pub fn new(area: &'a DrawingArea<B, Shift>, letters: Letters) -> Result<Self, ChartError> {
        register_fonts();
        area.fill(&RGBColor(255, 255, 255)).map_err(failed)?;
        Ok(Self { area, letters })
    }

    pub fn line(&self, points: &[At], color: RGBColor, width: f64) -> Result<(), ChartError> {
        let path = PathElement::new(fine(points), stroke(color, width));
        self.area.draw(&path).map_err(failed)
    }

    /// A straight line in dashes of `dash` points and gaps as long.
    pub fn dashed(
        &self,
        from: At,
        to: At,
        dash: f64,
        color: RGBColor,
        width: f64,
    ) -> Result<(), ChartError> {
        let length = (to.0 - from.0).hypot(to.1 - from.1);
        let dashes = (length / dash).ceil().clamp(1.0, 1000.0) as usize;
        let at = |share: f64| {
            let share = (share * dash / length.max(dash)).min(1.0);
            (
                from.0 + share * (to.0 - from.0),
                from.1 + share * (to.1 - from.1),
            )
        };
        for i in (0..dashes).step_by(2) {
            self.line(&[at(i as f64), at(i as f64 + 1.0)], color, width)?;
        }
        Ok(())
    }

    pub fn rectangle(&self, from: At, to: At, color: RGBColor) -> Result<(), ChartError> {
        let corners = [pixel(from), pixel(to)];
        self.area
            .draw(&Rectangle::new(corners, color.filled()))
            .map_err(failed)
    }

    /// A mark of `radius` with a white rim, or a hollow one.
    pub fn mark(
        &self,
        mark: Mark,
        at: At,
        radius: f64,
        color: RGBColor,
        hollow: bool,
    ) -> Result<(), ChartError> {
        const WHITE: RGBColor = RGBColor(255, 255, 255);
        self.shape(mark, at, radius + 1.2, WHITE)?;
        self.shape(mark, at, radius, color)?;
        if hollow {
            self.shape(mark, at, radius - 1.4, WHITE)?;
        }
        Ok(())
    }

    fn shape(&self, mark: Mark, at: At, radius: f64, color: RGBColor) -> Result<(), ChartError> {
        let polygon = |corners: &[At]| {
            let places: Vec<At> = corners
                .iter()
                .map(|(x, y)| (at.0 + x * radius, at.1 + y * radius))
                .collect();
            self.area
                .draw(&Polygon::new(fine(&places), color.filled()))
                .map_err(failed)
        };
        match mark {
            Mark::Circle => {
                let radius = (radius * f64::from(FINENESS)).round() as i32;
                self.area
                    .draw(&Circle::new(pixel(at), radius, color.filled()))
                    .map_err(failed)
            }
            Mark::Square => polygon(&[(-0.9, -0.9), (0.9, -0.9), (0.9, 0.9), (-0.9, 0.9)]),
            Mark::Diamond => polygon(&[(0.0, -1.25), (1.25, 0.0), (0.0, 1.25), (-1.25, 0.0)]),
            Mark::Up => polygon(&[(0.0, -1.25), (1.15, 0.85), (-1.15, 0.85)]),
            Mark::Down => polygon(&[(0.0, 1.25), (1.15, -0.85), (-1.15, -0.85)]),
            Mark::Cross => {
                let (a, b) = (0.4, 1.2);
                polygon(&[
                    (-a, -b),
                    (a, -b),
                    (a, -a),
                    (b, -a),
                    (b, a),
                    (a, a),
                    (a, b),
                    (-a, b),
                    (-a, a),
                    (-b, a),
                    (-b, -a),
                    (-a, -a),
                ])
            }
        }
    }

    /// Words whose line begins, ends or has its middle at `at`.
    pub fn words(&self, text: &str, at: At, words: Words) -> Result<(), ChartError> {
        let below = self.letters.line() * words.size;
        let place = if words.turned {
            (at.0 - below, at.1)
        } else {
            (at.0, at.1 - below)
        };
        let anchor = Pos::new(words.from, self.letters.anchor());
        let style = TextStyle::from(self.font(words))
            .color(&words.color)
            .pos(anchor);
        self.area
            .draw(&Text::new(text.to_owned(), pixel(place), style))
            .map_err(failed)
    }

    fn font(&self, words: Words) -> FontDesc<'static> {
        let size = words.size * self.letters.size() * f64::from(FINENESS);
        let font = FontDesc::new(FontFamily::Name(FAMILY), size, style_of(words.bold));
        if words.turned {
            font.transform(FontTransform::Rotate270)
        } else {
            font
        }
    }
}

fn style_of(bold: bool) -> FontStyle {
    if bold {
        FontStyle::Bold
    } else {
        FontStyle::Normal
    }
}

/// How long words of this size are, points; by our own font, whoever draws it in the end.
pub fn length(text: &str, size: f64, bold: bool) -> f64 {
    register_fonts();
    let fine = size * Letters::OfBitmap.size() * f64::from(FINENESS);
    let font = FontDesc::new(FontFamily::Name(FAMILY), fine, style_of(bold));
    match font.box_size(text) {
        Ok((width, _)) => f64::from(width) / f64::from(FINENESS),
        // Of letters in the mean.
        Err(_) => 0.55 * size * text.chars().count() as f64,
    }
}

/// Fonts of ours can't be bad: a test draws with them.
fn register_fonts() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let _ = register_font(FAMILY, FontStyle::Normal, REGULAR);
        let _ = register_font(FAMILY, FontStyle::Bold, MEDIUM);
    });
}

fn stroke(color: RGBColor, width: f64) -> ShapeStyle {
    let width = (width * f64::from(FINENESS)).round().max(1.0) as u32;
    color.stroke_width(width)
}

fn pixel((x, y): At) -> (i32, i32) {
    let fine = |value: f64| (value * f64::from(FINENESS)).round() as i32;
    (fine(x), fine(y))
}

fn fine(points: &[At]) -> Vec<(i32, i32)> {
    points.iter().map(|point| pixel(*point)).collect()
}
