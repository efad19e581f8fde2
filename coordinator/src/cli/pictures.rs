//! Which pictures `simulate` and `replay` make.

use super::Failure;
use crate::gallery::{Colour, Gallery, Options};
use clap::Args;
use std::path::Path;

/// What is wanted besides displacement and plastic strain.
#[derive(Debug, Args)]
pub(super) struct PictureArguments {
    /// Colour a picture of the final state by this too (repeatable); the first one also colours the animation
    #[arg(long, value_name = "FIELD", value_enum, requires = "out")]
    colour: Vec<Colour>,
    /// Write the final states as SVG too: some megabytes each
    #[arg(long, requires = "out")]
    svg: bool,
    /// No animation
    #[arg(long, requires = "out")]
    no_animation: bool,
}

impl PictureArguments {
    /// The gallery in `out`, if there is one to be.
    pub(super) fn gallery(&self, out: Option<&Path>) -> Result<Option<Gallery>, Failure> {
        let options =
            || Options { colours: self.colour.clone(), svg: self.svg, animation: !self.no_animation };
        let gallery = out.map(|out| Gallery::new(out, options())).transpose();
        gallery.map_err(|e| Failure::Input(e.to_string()))
    }
}
