//! Statistics, random fields and the two-phase GIMP solver of Runout.
//!
//! The modules stand in the order in which the data passes them:
//!
//! 1. [`site`] reads a table of measured properties (text in, [`site::SiteData`] out).
//! 2. [`campaign`] reads and checks the campaign file: [`campaign::Campaign`] cannot be wrong.
//! 3. [`marginal`] and [`copula`] are the distribution families, over the functions in [`special`]; [`fit`] fits them
//!    to the site data.
//! 4. [`spec`] freezes campaign and fit; its digest is the campaign's identity.
//! 5. [`seed`] derives the random streams from (campaign seed, index, purpose).
//! 6. [`field`] turns a stream into cross-correlated random fields.
//! 7. [`slope`] and [`points`] lay out the geometry and the material points.
//! 8. [`gimp`] carries the points through failure to rest.
//! 9. [`runout`] measures what moved, [`profile`] what it did to the ground in front of the toe; [`outcome`] is the record
//!    of one realisation.
//! 10. [`realisation`] is the whole way from (spec, index) to an outcome.
//! 11. [`estimate`] folds outcomes, in index order, into estimates, intervals and the stopping decision.
//!
//! [`validation`] stands beside the way: cases that hold the solver against closed forms and benchmarks.
//!
//! A tiny campaign, start to end:
//!
//! ```
//! use runout_core::{campaign, estimate::Estimator, fit, gimp::Kernel, site};
//! use runout_core::realisation::{Prepared, Progress};
//! use runout_core::spec::{SPEC_FORMAT, Spec};
//!
//! // Text in: the coordinator reads the files.
//! let text = include_str!("../../campaigns/quick/campaign.toml");
//! let mut campaign = campaign::parse(text)?;
//! campaign.model.analysis.duration_s = 0.5;
//! let table = campaign.site.as_ref().expect("this campaign is measured");
//! let data = site::parse(include_str!("../../campaigns/quick/site.csv"), &table.columns, table.zeros)?;
//!
//! // Fit once, freeze.
//! let fit = fit::fit(&campaign.random, Some(&data), &campaign.fit)?;
//! let spec = Spec {
//!     format: SPEC_FORMAT,
//!     seed: campaign.seed,
//!     random: fit.random(&campaign.random),
//!     copula: fit.copula.best.clone(),
//!     model: campaign.model.clone(),
//! };
//!
//! // Realisations, each from (spec, index) alone; estimates over them in index order.
//! let prepared = Prepared::new(spec, Kernel::best())?;
//! let mut estimator = Estimator::new(&campaign.stop, &campaign.model.sample, &campaign.run);
//! for index in 0..2 {
//!     estimator.push(&prepared.realise(index, &Progress::default())?)?;
//! }
//! assert_eq!(estimator.estimate().realisations, 2);
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```
//!
//! Nothing here knows a file, a clock, an environment variable or a transport.

pub mod site;

pub mod campaign;

mod numeric;
pub mod special;

pub mod copula;
pub mod marginal;

pub mod fit;

pub mod spec;

pub mod seed;

pub mod field;

pub mod points;
pub mod slope;

pub mod gimp;

pub mod profile;
pub mod runout;

pub mod outcome;

pub mod realisation;

pub mod estimate;

pub mod validation;
