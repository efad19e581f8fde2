//! Pictures: soil coloured by a quantity ([`soil`]) in its [`setting`], moving ([`animation`]), the [`section`] as given, and
//! charts ([`chart`], [`forest`]), as PNG, SVG or GIF, with fonts of our own so that the host needs none.
//!
//! Everything is drawn on a canvas of whole pixels at the scale of a 2000-pixel-wide page; a picture on paper or on
//! a page is that canvas shrunk.

pub mod animation;
pub mod axes;
pub mod chart;
pub mod forest;
pub mod section;
pub mod setting;
pub mod soil;

use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, IntoDrawingArea};
use plotters::element::{Circle, PathElement, Polygon, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontStyle, FontTransform, RGBColor, ShapeStyle, TextStyle, register_font};
use std::fmt::Display;
use std::sync::Once;
use thiserror::Error;

/// Text and axes; [`svg`] figures embedded in a page take the page's text colour in its place.
pub const INK: RGBColor = RGBColor(0x1f, 0x23, 0x28);
/// Secondary text, grid lines' darker relative.
pub const GREY: RGBColor = RGBColor(0x6e, 0x77, 0x81);
/// Grid lines.
pub const GRID: RGBColor = RGBColor(0xd8, 0xdc, 0xe0);

/// Size of ordinary text, px.
pub const TEXT_PX: u32 = 34;

const FONT: &str = "sans-serif";

/// A picture that cannot be drawn.
#[derive(Debug, Error)]
#[error("the picture cannot be drawn: {0}")]
pub struct PictureError(String);

impl PictureError {
    fn from(error: impl Display) -> PictureError {
        PictureError(error.to_string())
    }
}

/// Something that can be drawn on a canvas of its own size.
pub trait Draw {
    /// Width and height, px.
    fn size(&self) -> (u32, u32);

    /// Draws it.
    ///
    /// # Errors
    /// The backend's.
    fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>) -> Result<(), PictureError>;
}

/// The picture as rows of red, green and blue bytes, with its width and height.
///
/// # Errors
/// The backend's.
pub fn pixels(picture: &impl Draw) -> Result<(Vec<u8>, (u32, u32)), PictureError> {
    let (width, height) = picture.size();
    let mut pixels = vec![255; width as usize * height as usize * 3];
    {
        let area = BitMapBackend::with_buffer(&mut pixels, (width, height)).into_drawing_area();
        Canvas::on(&area, BITMAP_TEXT_DROP)?.render(picture)?;
    }
    Ok((pixels, (width, height)))
}

/// The picture as a PNG file's bytes.
///
/// # Errors
/// The backend's, or the encoder's.
pub fn png(picture: &impl Draw) -> Result<Vec<u8>, PictureError> {
    let (pixels, (width, height)) = pixels(picture)?;
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header().map_err(PictureError::from)?;
    writer.write_image_data(&pixels).map_err(PictureError::from)?;
    writer.finish().map_err(PictureError::from)?;
    Ok(file)
}

/// The picture as SVG text.
///
/// # Errors
/// The backend's.
pub fn svg(picture: &impl Draw) -> Result<String, PictureError> {
    let mut text = String::new();
    {
        let area = SVGBackend::with_string(&mut text, picture.size()).into_drawing_area();
        Canvas::on(&area, 0.0)?.render(picture)?;
    }
    Ok(text)
}

/// A drawing surface with the few strokes that the pictures need; coordinates in pixels from the upper left corner.
pub struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    /// How far below its point a text is put, as a share of its size.
    text_drop: f64,
}

/// A bitmap's text is centred by its font's whole height, accents and all: letters then stand this share of their size too
/// high. An SVG's reader centres by the letters.
const BITMAP_TEXT_DROP: f64 = 0.18;

/// Where a text stands relative to its point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Anchor {
    /// The point is the middle of the text's left end.
    Left,
    /// The point is the text's centre.
    Centre,
    /// The point is the middle of the text's right end.
    Right,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    fn on(area: &'a DrawingArea<B, Shift>, text_drop: f64) -> Result<Canvas<'a, B>, PictureError> {
        static FONTS: Once = Once::new();
        let mut registered = Ok(());
        FONTS.call_once(|| {
            registered = register_font(FONT, FontStyle::Normal, epaint_default_fonts::UBUNTU_LIGHT)
                .map_err(|_| PictureError("its font cannot be read".to_owned()));
        });
        registered.map(|()| Canvas { area, text_drop })
    }

    fn render(&self, picture: &impl Draw) -> Result<(), PictureError> {
        picture.draw(self)?;
        self.area.present().map_err(PictureError::from)
    }

    /// A filled rectangle between two corners.
    ///
    /// # Errors
    /// The backend's.
    pub fn rectangle(
        &self,
        from: (i32, i32),
        to: (i32, i32),
        colour: RGBColor,
        opacity: f64,
    ) -> Result<(), PictureError> {
        let style = ShapeStyle { color: colour.mix(opacity), filled: true, stroke_width: 0 };
        self.area.draw(&Rectangle::new([from, to], style)).map_err(PictureError::from)
    }

    /// A filled disc.
    ///
    /// # Errors
    /// The backend's.
    pub fn dot(&self, at: (i32, i32), radius: i32, colour: RGBColor) -> Result<(), PictureError> {
        let style = ShapeStyle { color: colour.to_rgba(), filled: true, stroke_width: 0 };
        self.area.draw(&Circle::new(at, radius, style)).map_err(PictureError::from)
    }

    /// A line through points.
    ///
    /// # Errors
    /// The backend's.
    pub fn path(&self, points: Vec<(i32, i32)>, colour: RGBColor, width: u32) -> Result<(), PictureError> {
        if points.len() < 2 {
            return Ok(());
        }
        let style = ShapeStyle { color: colour.to_rgba(), filled: false, stroke_width: width };
        self.area.draw(&PathElement::new(points, style)).map_err(PictureError::from)
    }

    /// A dashed line through points.
    ///
    /// # Errors
    /// The backend's.
    pub fn dashed(
        &self,
        points: &[(i32, i32)],
        colour: RGBColor,
        width: u32,
        dash: (f64, f64),
    ) -> Result<(), PictureError> {
        for piece in dashes(points, dash) {
            self.path(piece, colour, width)?;
        }
        Ok(())
    }

    /// A filled polygon.
    ///
    /// # Errors
    /// The backend's.
    pub fn polygon(
        &self,
        points: Vec<(i32, i32)>,
        colour: RGBColor,
        opacity: f64,
    ) -> Result<(), PictureError> {
        self.area.draw(&Polygon::new(points, colour.mix(opacity))).map_err(PictureError::from)
    }

    /// A line of text.
    ///
    /// # Errors
    /// The backend's.
    pub fn text(
        &self,
        text: &str,
        at: (i32, i32),
        size_px: u32,
        colour: RGBColor,
        anchor: Anchor,
    ) -> Result<(), PictureError> {
        self.write(text, at, size_px, colour, anchor, FontTransform::None)
    }

    /// A line of text that reads upwards, centred.
    ///
    /// # Errors
    /// The backend's.
    pub fn upward_text(
        &self,
        text: &str,
        at: (i32, i32),
        size_px: u32,
        colour: RGBColor,
    ) -> Result<(), PictureError> {
        self.write(text, at, size_px, colour, Anchor::Centre, FontTransform::Rotate270)
    }

    fn write(
        &self,
        text: &str,
        at: (i32, i32),
        size_px: u32,
        colour: RGBColor,
        anchor: Anchor,
        transform: FontTransform,
    ) -> Result<(), PictureError> {
        let horizontal = match anchor {
            Anchor::Left => HPos::Left,
            Anchor::Centre => HPos::Center,
            Anchor::Right => HPos::Right,
        };
        let drop = (self.text_drop * f64::from(size_px)).round() as i32;
        // Below the letters is to the right of what reads upwards.
        let at = match transform {
            FontTransform::Rotate270 => (at.0 + drop, at.1),
            _ => (at.0, at.1 + drop),
        };
        let style = TextStyle::from((FONT, size_px))
            .color(&colour)
            .pos(Pos::new(horizontal, VPos::Center))
            .transform(transform);
        self.area.draw(&Text::new(text.to_owned(), at, style)).map_err(PictureError::from)
    }
}

/// Cuts a path into dashes of `dash.0` px with gaps of `dash.1` px.
fn dashes(points: &[(i32, i32)], dash: (f64, f64)) -> Vec<Vec<(i32, i32)>> {
    let mut pieces = vec![Vec::new()];
    let (mut drawing, mut left) = (true, dash.0);
    for pair in points.windows(2) {
        let (from, to) = (pair[0], pair[1]);
        let (dx, dy) = (f64::from(to.0 - from.0), f64::from(to.1 - from.1));
        let length = dx.hypot(dy);
        let at = |s: f64| {
            ((f64::from(from.0) + dx * s).round() as i32, (f64::from(from.1) + dy * s).round() as i32)
        };
        let mut done = 0.0;
        while done < length {
            let step = left.min(length - done);
            if drawing {
                let piece = pieces.last_mut().expect("there is always a piece");
                if piece.is_empty() {
                    piece.push(at(done / length));
                }
                piece.push(at((done + step) / length));
            }
            done += step;
            left -= step;
            if left <= 0.0 {
                drawing = !drawing;
                left = if drawing { dash.0 } else { dash.1 };
                if drawing {
                    pieces.push(Vec::new());
                }
            }
        }
    }
    pieces
}
