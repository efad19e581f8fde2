//! An animated GIF of soil that moves: pictures with one view and one colour bar, a frame each.
//!
//! A GIF has at most 256 colours. They are taken from the pictures themselves: each pixel's nearest among the colour
//! map's, the few of lines and backgrounds, and greys for the edges of text; nothing is dithered. A frame holds what
//! differs from the one before: the rest of it is transparent, so that what stands still costs next to no bytes.

use super::soil::SoilPicture;
use super::{PictureError, pixels};
use gif::{DisposalMethod, Encoder, Frame, Repeat};

/// A GIF shows on a screen what a picture prints: half its width is enough.
const SHRINK: usize = 2;
/// Colours of a GIF, one of them kept for what does not change.
const COLOURS: usize = 255;
const UNCHANGED: u8 = 255;
/// Of these, taken from the colour map.
const FROM_GRADIENT: usize = 192;
/// Levels of a channel in the table of nearest colours: 5 bits.
const LEVELS: usize = 32;

/// One picture of an animation and how long it stays, in hundredths of a second.
#[derive(Debug)]
pub struct Scene<'a> {
    /// The picture; all of an animation have one size.
    pub picture: SoilPicture<'a>,
    /// Time until the next.
    pub delay_cs: u16,
}

/// The scenes as a GIF that repeats for ever.
///
/// # Errors
/// A picture that cannot be drawn, or the encoder's.
pub fn gif<'a>(scenes: impl Iterator<Item = Scene<'a>>) -> Result<Vec<u8>, PictureError> {
    let mut file = Vec::new();
    let mut room = Some(&mut file);
    let mut begun: Option<(Encoder<&mut Vec<u8>>, Nearest)> = None;
    let mut before: Vec<u8> = Vec::new();
    for scene in scenes {
        let (full, size) = pixels(&scene.picture)?;
        let (small, [width, height]) = shrunk(&full, [size.0 as usize, size.1 as usize]);
        let fits = |length: usize| u16::try_from(length).map_err(PictureError::from);
        let (width, height) = (fits(width)?, fits(height)?);
        if let Some(file) = room.take() {
            let palette = palette(&scene.picture);
            let flat: Vec<u8> = palette.iter().flatten().copied().collect();
            let mut encoder = Encoder::new(file, width, height, &flat).map_err(PictureError::from)?;
            encoder.set_repeat(Repeat::Infinite).map_err(PictureError::from)?;
            begun = Some((encoder, Nearest::new(&palette)));
        }
        let Some((encoder, nearest)) = &mut begun else { break };
        let indices: Vec<u8> = small.iter().map(|pixel| nearest.of(*pixel)).collect();
        let fresh = |(k, now): (usize, &u8)| if before.get(k) == Some(now) { UNCHANGED } else { *now };
        let changes: Vec<u8> = indices.iter().enumerate().map(fresh).collect();
        before = indices;
        let frame = Frame::from_indexed_pixels(width, height, changes, Some(UNCHANGED));
        let frame = Frame { delay: scene.delay_cs, dispose: DisposalMethod::Keep, ..frame };
        encoder.write_frame(&frame).map_err(PictureError::from)?;
    }
    drop(begun);
    Ok(file)
}

/// Every [`SHRINK`] by [`SHRINK`] pixels as their mean.
fn shrunk(full: &[u8], [width, height]: [usize; 2]) -> (Vec<[u8; 3]>, [usize; 2]) {
    let small = [width / SHRINK, height / SHRINK];
    let count = (SHRINK * SHRINK) as u32;
    let mean = |column: usize, row: usize, channel: usize| {
        let all = (0..SHRINK * SHRINK).map(|k| {
            let (x, y) = (column * SHRINK + k % SHRINK, row * SHRINK + k / SHRINK);
            u32::from(full[3 * (y * width + x) + channel])
        });
        ((all.sum::<u32>() + count / 2) / count) as u8
    };
    let places = (0..small[1]).flat_map(|row| (0..small[0]).map(move |column| (column, row)));
    (places.map(|(column, row)| [0, 1, 2].map(|channel| mean(column, row, channel))).collect(), small)
}

/// The colour map's colours, those of the setting, and greys from black to white.
fn palette(picture: &SoilPicture<'_>) -> Vec<[u8; 3]> {
    let mut palette: Vec<[u8; 3]> = picture.setting_colours();
    let gradient = picture.panels.first().map(|panel| panel.gradient);
    for k in 0..FROM_GRADIENT {
        let share = k as f64 / (FROM_GRADIENT - 1) as f64;
        palette.extend(gradient.map(|g| g.eval_continuous(share)).map(|c| [c.r, c.g, c.b]));
    }
    let greys = COLOURS - palette.len();
    palette.extend((0..greys).map(|k| [(255 * k / (greys - 1)) as u8; 3]));
    palette
}

/// The nearest of a palette's colours, from a table.
struct Nearest(Vec<u8>);

impl Nearest {
    fn new(palette: &[[u8; 3]]) -> Nearest {
        // White and black keep their places at the ends.
        let value = |level: usize| (255 * level / (LEVELS - 1)) as i32;
        let nearest = |place: usize| {
            let colour = [place / LEVELS / LEVELS, place / LEVELS % LEVELS, place % LEVELS].map(value);
            let distance = |candidate: &[u8; 3]| -> i32 {
                candidate.iter().zip(colour).map(|(a, b)| (i32::from(*a) - b).pow(2)).sum()
            };
            (0..palette.len()).min_by_key(|k| distance(&palette[*k])).unwrap_or(0) as u8
        };
        Nearest((0..LEVELS * LEVELS * LEVELS).map(nearest).collect())
    }

    fn of(&self, colour: [u8; 3]) -> u8 {
        let [r, g, b] = colour.map(|channel| usize::from(channel) * LEVELS / 256);
        self.0[(r * LEVELS + g) * LEVELS + b]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::setting::Setting;
    use crate::picture::soil::{Panel, View};
    use crate::picture::svg;

    /// Four points that move to the right by `shift` m, on flat ground.
    fn picture(shift: f64) -> SoilPicture<'static> {
        let setting = Setting { ground: vec![(0.0, 2.0), (9.0, 2.0)], base_m: 0.0, ..Setting::default() };
        let panel = Panel {
            label: "displacement (m)".to_owned(),
            x: vec![0.5 + shift, 1.5 + shift, 0.5, 1.5].into(),
            y: vec![1.5, 1.5, 0.5, 0.5].into(),
            values: vec![shift, shift, 0.0, 0.0],
            range: (0.0, 4.0),
            gradient: colorous::VIRIDIS,
            reversed: false,
        };
        SoilPicture {
            title: "A slide <&>".to_owned(),
            subtitle: "s".to_owned(),
            setting,
            moved: true,
            point_size_m: 1.0,
            panels: vec![panel],
            view: Some(View { x: (0.0, 10.0), y: (-0.5, 3.0) }),
        }
    }

    /// Frames come back in their number, size and time, and the colour of what moves is that of the colour map.
    #[test]
    fn a_gif_reads_back_as_what_was_drawn() {
        let shifts = [0.0, 2.0, 4.0];
        let scenes = shifts.map(|shift| Scene { picture: picture(shift), delay_cs: 10 + shift as u16 });
        let file = gif(scenes.into_iter()).expect("it can be drawn");
        let mut options = gif::DecodeOptions::new();
        options.set_color_output(gif::ColorOutput::RGBA);
        let mut decoder = options.read_info(&file[..]).expect("it is a GIF");
        let size = super::super::Draw::size(&picture(0.0));
        assert_eq!((u32::from(decoder.width()), u32::from(decoder.height())), (size.0 / 2, size.1 / 2));
        let mut canvas = vec![[0u8; 4]; usize::from(decoder.width()) * usize::from(decoder.height())];
        let mut delays = Vec::new();
        let mut yellow = Vec::new();
        while let Some(frame) = decoder.read_next_frame().expect("a sound frame") {
            delays.push(frame.delay);
            for (pixel, now) in
                canvas.iter_mut().zip(frame.buffer.chunks_exact(4)).filter(|(_, now)| now[3] > 0)
            {
                pixel.copy_from_slice(now);
            }
            // Viridis ends in a yellow that nothing else here has; the colour bar always shows some.
            yellow.push(canvas.iter().filter(|c| c[0] > 230 && c[1] > 215 && c[2] < 70).count());
        }
        assert_eq!(delays, [10, 12, 14]);
        assert!(canvas.iter().filter(|c| c[..3] == [255; 3]).count() > canvas.len() / 4, "paper stays white");
        assert_eq!(yellow[0], yellow[1]);
        assert!(yellow[2] > 10 * yellow[0].max(1), "{yellow:?}");
    }

    #[test]
    fn a_slide_as_svg_is_well_formed_and_holds_every_point() {
        let text = svg(&picture(2.0)).expect("it can be drawn");
        let document = roxmltree::Document::parse(&text).expect("it is XML");
        let squares = document.descendants().filter(|n| n.has_tag_name("rect"));
        let moved = colorous::VIRIDIS.eval_continuous(0.5);
        let colour = format!("#{:02X}{:02X}{:02X}", moved.r, moved.g, moved.b);
        // Two points, drawn twice: as a ground and as themselves.
        assert!(squares.filter(|n| n.attribute("fill") == Some(&colour)).count() >= 4);
    }
}
