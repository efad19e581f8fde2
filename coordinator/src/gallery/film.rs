//! The moments of a slide as frames of an animation, in bounded memory.

use super::colour::Colour;
use super::{Look, slide};
use crate::picture::PictureError;
use crate::picture::animation::{self, Scene};
use runout_core::realisation::Snapshot;

/// Most memory of all frames, in single-precision numbers: 256 MiB.
const MOST_NUMBERS: usize = 64 << 20;
/// Time for which a frame stays, hundredths of a second; the last one longer, so that the end is seen.
const DELAY_CS: u16 = 10;
const LAST_DELAY_CS: u16 = 250;

/// A moment: positions, m, and the quantity that colours it.
#[derive(Debug, Clone)]
struct Moment {
    time_s: f64,
    x: Vec<f32>,
    y: Vec<f32>,
    values: Vec<f32>,
}

/// The moments seen so far.
#[derive(Debug, Clone)]
pub(super) struct Film {
    colour: Colour,
    moments: Vec<Moment>,
    /// Every how many moments one is kept.
    every: usize,
    seen: usize,
}

impl Film {
    pub(super) fn new(colour: Colour) -> Film {
        Film { colour, moments: Vec::new(), every: 1, seen: 0 }
    }

    /// Keeps a moment. When they would fill the memory, every second one goes, and of those to come as many.
    pub(super) fn observe(&mut self, snapshot: &Snapshot<'_>) {
        // The end is seen twice if it falls on a multiple of the period.
        if self.moments.last().is_some_and(|moment| moment.time_s >= snapshot.time_s) {
            return;
        }
        let is_due = self.seen.is_multiple_of(self.every);
        self.seen += 1;
        if !is_due {
            return;
        }
        let single = |values: &[f64]| values.iter().map(|v| *v as f32).collect();
        self.moments.push(Moment {
            time_s: snapshot.time_s,
            x: single(&snapshot.state.x),
            y: single(&snapshot.state.y),
            values: single(&self.colour.values(snapshot)),
        });
        let numbers: usize = self.moments.iter().map(|moment| 3 * moment.x.len()).sum();
        if numbers > MOST_NUMBERS {
            let mut place = 0;
            self.moments.retain(|_| {
                place += 1;
                place % 2 == 1
            });
            self.every *= 2;
        }
    }

    /// The film as a GIF in one view and with one colour bar.
    pub(super) fn gif(&self, look: &Look<'_>) -> Result<Vec<u8>, PictureError> {
        let wide = |values: &[f32]| -> Vec<f64> { values.iter().map(|v| f64::from(*v)).collect() };
        let all: Vec<f64> = match self.colour {
            // Strains only grow: the last moment has the highest.
            Colour::PlasticStrain => self.moments.last().map(|m| wide(&m.values)).unwrap_or_default(),
            _ => self.moments.iter().flat_map(|m| wide(&m.values)).collect(),
        };
        let range = self.colour.range(&all);
        let picture = |moment: &Moment| {
            let subtitle = format!(
                "{}, {:.2} s after failure; {}",
                self.colour.in_words(),
                moment.time_s,
                look.legend()
            );
            let (x, y) = (wide(&moment.x), wide(&moment.y));
            slide(look, subtitle, (x.into(), y.into()), wide(&moment.values), self.colour, range)
        };
        let views = self.moments.iter().map(|moment| picture(moment).view());
        let view = views.reduce(|a, b| a.and(b));
        let last = self.moments.len().saturating_sub(1);
        animation::gif(self.moments.iter().enumerate().map(|(i, moment)| {
            let mut picture = picture(moment);
            picture.view = view;
            Scene { picture, delay_cs: if i == last { LAST_DELAY_CS } else { DELAY_CS } }
        }))
    }
}
