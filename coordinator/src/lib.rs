//! Runout's coordinator and its user's command, as a library that the binary and the tests call.
//!
//! In the order of the data's way:
//!
//! 1. [`load`] reads what the user wrote, with [`overrides`] of single keys; [`schema`] describes it; [`advice`] says what may be wrong with it although it is allowed.
//! 2. [`run_directory`], [`store`] and [`events`] keep a campaign's files, [`queue`] and [`engine`] (with the [`essence`] of outcomes, if they are as [`expected`]) decide what is run next and when
//!    it is enough, [`rulings`] whom to believe, [`service`] and [`serve`] (with what is [`shared`]) and [`local`] let workers take part, [`listen`] lets
//!    in whom [`tls`] has certified, within [`limits`], [`status`], [`seen`], [`progress`], [`history`], [`page`] and [`logs`]
//!    tell, [`verify`] checks; [`submit`] hands all that to a batch system.
//! 3. [`outcomes`] is the table of results; [`fit_tables`], [`replays`], [`report`], [`gallery`], [`picture`] and [`vtu`] show what came out; [`validation`] shows that the
//!    solver is right.
//! 4. [`cli`] holds one command a file.

pub mod load;
pub mod overrides;
pub mod schema;

pub mod advice;

pub mod difference;
pub mod engine;
pub mod essence;
pub mod events;
pub mod expected;
pub mod history;
pub mod limits;
pub mod listen;
pub mod local;
pub mod logs;
pub mod machine;
pub mod page;
pub mod progress;
pub mod queue;
pub mod rulings;
pub mod run_directory;
pub mod seen;
pub mod serve;
pub mod service;
pub mod shared;
pub mod status;
pub mod store;
pub mod submit;
pub mod tls;
pub mod verify;
pub mod writer;

pub mod fit_tables;
pub mod gallery;
pub mod outcomes;
pub mod picture;
pub mod replays;
pub mod report;
pub mod table;
pub mod validation;
pub mod vtu;

pub mod cli;
