//! The `mimic` program as its users meet it.

mod attacked;
mod bounded;
mod completions;
mod disturbed;
mod edit;
mod exit_codes;
mod import;
mod info;
#[cfg(not(feature = "rerun"))]
mod lean;
mod meant;
mod output;
#[cfg(feature = "rerun")]
mod readme;
#[cfg(feature = "rerun")]
mod replay;
mod runs;
mod shown;
mod spared;
mod stages;
mod steered;
mod talk;
mod told;
mod training;
mod verdict;
mod workbench;
